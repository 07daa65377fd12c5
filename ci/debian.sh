#!/usr/bin/env bash
# The tests on the Mesa of another Debian: makes a minimal root of that release with its lavapipe, loader and
# validation layers, and runs in it the tests that this system has built. As root, with debootstrap. The root
# is kept for the next time in DEBIAN_ROOT (/var/tmp/rtfmesh-debian-RELEASE). The release's C library must be
# no older than this system's. DEBIAN_MIRROR chooses another mirror than that of debootstrap.
# ci/debian.sh [RELEASE [TEST...]]; without a release, trixie (Debian 13); without a test, all.
set -euo pipefail
cd "$(dirname "$0")/.."
release=${1:-trixie}
shift || true
root=${DEBIAN_ROOT:-/var/tmp/rtfmesh-debian-$release}
[ "$(id -u)" = 0 ] || { echo "debian: run as root" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "debian: install debootstrap" >&2; exit 1; }

# A root that was made completely has this mark.
if [ ! -f "$root/.rtfmesh" ]; then
  if [ -e "$root" ]; then
    echo "debian: $root is there but is no complete root of this script; remove it" >&2; exit 1
  fi
  trap 'rm -rf -- "$root.part"' EXIT
  rm -rf -- "$root.part"
  debootstrap --variant=minbase --include=libvulkan1,mesa-vulkan-drivers,vulkan-validationlayers,spirv-tools \
    "$release" "$root.part" ${DEBIAN_MIRROR:+"$DEBIAN_MIRROR"} >"$root.log" 2>&1 \
    || { echo "debian: debootstrap failed, see $root.log" >&2; exit 1; }
  touch "$root.part/.rtfmesh"
  mv "$root.part" "$root"
fi

cargo test --no-run --quiet --test tests
binary=$(cargo test --no-run --test tests 2>&1 | sed -n 's/.*Executable tests.*(\(.*\))$/\1/p')
[ -n "$binary" ] || { echo "debian: cargo names no test binary" >&2; exit 1; }
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
binary=$(realpath "$binary")
mesa=$(chroot "$root" dpkg-query -W -f='${Version}' mesa-vulkan-drivers)
echo "debian: $release, Mesa $mesa"

# The repository and what it built are at the same paths inside, for tests know these from when they were
# compiled. The mounts end with the process.
export root target binary
exec unshare --mount --propagation private bash -c '
  set -eu
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  for folder in "$PWD" "$target"; do
    mkdir -p "$root$folder"
    mount --bind "$folder" "$root$folder"
  done
  exec chroot "$root" env HOME=/root bash -c "cd \"\$1\" && shift && exec \"\$@\"" in "$PWD" "$binary" "$@"
' tests "$@"
