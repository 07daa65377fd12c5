#!/usr/bin/env bash
# The tests that need no device, built for another system: ci/cross.sh aarch64 runs them by qemu-user;
# ci/cross.sh windows only links them, because wine of Debian 12 lacks a library of Rust's programs
# (bcryptprimitives.dll). From the repository it takes the sources of ci/sources.sh, which need no shader
# compiler. Needs `rustup target add`, and Debian's packages that it names.
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
aarch64)
  target=aarch64-unknown-linux-gnu
  packages=(gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user)
  options=()
  export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
  export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=$PWD/ci/qemu.sh
  # It limits memory by ulimit, which the emulator needs itself.
  export RTFMESH_SKIP=io::hostile::compressed_files_of_many_gibibytes
  ;;
windows)
  target=x86_64-pc-windows-gnu
  packages=(gcc-mingw-w64-x86-64-posix)
  export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_LINKER=x86_64-w64-mingw32-gcc-posix
  options=(--no-run)
  ;;
*)
  echo "usage: ci/cross.sh aarch64|windows" >&2
  exit 2
  ;;
esac
for package in "${packages[@]}"; do
  dpkg -s "$package" >/dev/null 2>&1 || { echo "cross: install ${packages[*]}" >&2; exit 1; }
done
dist=$(realpath -m "${CARGO_TARGET_DIR:-target}")/dist
tree=$(compgen -G "$dist/sources/rtfmesh-*-sources") || { echo "cross: run ci/sources.sh first" >&2; exit 1; }
export CARGO_TARGET_DIR=$dist/cross/$1
exec "$tree/ci/no_device.sh" --target "$target" "${options[@]}"
