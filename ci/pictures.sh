#!/usr/bin/env bash
# Draws the pictures of README.md into docs/pictures.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"

cargo build --release --quiet
rtfmesh=target/release/rtfmesh
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT

"$rtfmesh" sample genus3 "$work/before.obj"
"$rtfmesh" remesh "$work/before.obj" "$work/after.ply" -n 2000 --quiet
"$rtfmesh" render "$work/before.obj" "$work/after.ply" docs/pictures/demo.png \
  --size 600x260 --azimuth 0 --elevation 22
