#!/usr/bin/env bash
# Installs what building and testing rtfmesh needs on Debian or Ubuntu, and prepares the shaderc library.
# With --tests, also what testing alone needs. Idempotent; works as root or through sudo. Prints only what it
# does.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
  build-essential pkg-config
  libvulkan1 mesa-vulkan-drivers vulkan-validationlayers # loader, lavapipe, validation layers
  libshaderc-dev glslang-dev spirv-tools                 # parts of the shader compiler, spirv-val
)
# A browser for ci/page.sh, which tests need; on Ubuntu, whose package is an empty shell, bring your own.
if [ "${1:-}" = --tests ] && ! command -v "${RTFMESH_BROWSER:-chromium}" >/dev/null; then
  packages+=(chromium)
fi
# For ci/python.sh; other interpreters than Debian's bring it along.
if [ "${1:-}" = --tests ] && ! "${PYTHON:-python3}" -c 'import ensurepip, venv' 2>/dev/null; then
  packages+=(python3 python3-venv)
fi
# For gmsh in ci/python.sh, which is linked with them.
if [ "${1:-}" = --tests ]; then
  packages+=(libgl1 libglu1-mesa libgomp1 libxcursor1 libxft2 libxinerama1)
fi
# For ci/gltf.sh; there may be others than Debian's.
if [ "${1:-}" = --tests ] && ! { command -v node && command -v npm; } >/dev/null; then
  packages+=(nodejs npm)
fi

as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"; elif command -v sudo >/dev/null; then sudo "$@"; else
    echo "setup: need root or sudo to install: ${missing[*]}" >&2; exit 1
  fi
}

missing=()
for p in "${packages[@]}"; do
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$p" 2>/dev/null || true)" = installed ] || missing+=("$p")
done
if [ ${#missing[@]} -gt 0 ]; then
  echo "setup: installing ${missing[*]}"
  as_root apt-get update -qq
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    "${missing[@]}" >/dev/null
fi

command -v cargo >/dev/null || { echo "setup: Rust is missing: see https://rustup.rs" >&2; exit 1; }

# Debian's libshaderc_combined.a lacks glslang and SPIRV-Tools; the shaderc crate wants one archive with
# everything. Building that from source takes a quarter of an hour on two cores, merging Debian's archives a
# second.
lib=.deps/shaderc/libshaderc_combined.a
if [ ! -f "$lib" ]; then
  dir=$(dirname "$(dpkg -L libshaderc-dev | grep '/libshaderc_combined\.a$')")
  mkdir -p "$(dirname "$lib")"
  {
    echo "create $lib.part"
    for part in shaderc_combined glslang SPIRV MachineIndependent GenericCodeGen OSDependent OGLCompiler \
      glslang-default-resource-limits SPIRV-Tools-opt SPIRV-Tools SPIRV-Tools-link; do
      if [ -f "$dir/lib$part.a" ]; then echo "addlib $dir/lib$part.a"; fi
    done
    echo save
    echo end
  } | ar -M
  mv "$lib.part" "$lib"
  echo "setup: prepared $lib"
fi
