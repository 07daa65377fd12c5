#!/usr/bin/env bash
# Draws the pictures of README.md, docs/method.md and docs/guide.md into docs/pictures; cells.svg there is
# drawn by hand.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"

cargo build --release --quiet
rtfmesh=$PWD/target/release/rtfmesh
pictures=$PWD/docs/pictures
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
cd "$work"

for model in genus3 bumpy-sphere box; do "$rtfmesh" sample $model $model.ply; done
# Arguments: input, output, options.
remesh() { "$rtfmesh" remesh "$1.ply" "$2.ply" --quiet "${@:3}"; }
rings=(--azimuth 0 --elevation 22)

# README: before and after.
remesh genus3 after -n 2000
"$rtfmesh" render genus3.ply after.ply "$pictures/demo.png" --size 600x260 "${rings[@]}"

# Scattered sites, and what moving them does.
remesh genus3 scattered -n 500 --preset rvd --iterations 0
remesh genus3 moved -n 500 --preset rvd --iterations 8
remesh genus3 relaxed -n 500 --preset cvd
"$rtfmesh" render scattered.ply moved.ply relaxed.ply "$pictures/relaxed.png" --size 270x150 \
  --color quality "${rings[@]}"

# What comes after moving: levels, polish, fit.
remesh genus3 polished -n 500
"$rtfmesh" render relaxed.ply polished.ply "$pictures/polished.png" --size 350x190 \
  --color quality "${rings[@]}"

# Levels from few sites to many.
for n in 75 250 1000; do remesh genus3 level-$n -n $n; done
"$rtfmesh" render level-75.ply level-250.ply level-1000.ply "$pictures/levels.png" --size 300x165 \
  "${rings[@]}"

# Sharp edges, kept or not.
remesh box kept -n 400
remesh box loose -n 400 --feature-angle 180
"$rtfmesh" render kept.ply loose.ply "$pictures/edges.png" --size 300x250

# Edges of one length, and shorter ones where the surface bends.
remesh bumpy-sphere uniform -n 700
for g in 1 2; do remesh bumpy-sphere gradation-$g -n 700 --sizing curvature --gradation $g; done
"$rtfmesh" render uniform.ply gradation-1.ply gradation-2.ply "$pictures/sizing.png" --size 205x185

# The cells of vertices: exact ones, tangent faces, and those of the uneven mesh by their neighbours.
remesh bumpy-sphere exact -n 700 --cells cells-1.ply
remesh bumpy-sphere tangent -n 700 --preset rtf --cells cells-2.ply
remesh bumpy-sphere uneven -n 700 --sizing curvature --cells cells-3.ply --cell-color valence
"$rtfmesh" render cells-1.ply cells-2.ply cells-3.ply "$pictures/polygons.png" --cells --size 205x185
