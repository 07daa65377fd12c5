#!/usr/bin/env bash
# Builds rtfmesh and remeshes one of its own models, or a mesh of yours: ci/demo.sh [MESH N [OPTION...]]
# The CPU does the work unless RTFMESH_DEVICE says otherwise (see `rtfmesh devices`).
set -euo pipefail
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"

if [ $# = 1 ]; then
  echo "usage: ci/demo.sh [MESH N [OPTION...]]" >&2
  exit 2
fi
if [ $# -ge 2 ]; then
  own=$(realpath "$1")
fi
cd "$(dirname "$0")/.."

./ci/setup.sh
echo "==> build (a few minutes the first time)"
cargo build --release --quiet
rtfmesh=target/release/rtfmesh
mkdir -p out

if [ $# -ge 2 ]; then
  input=$own count=$2
  shift 2
else
  input=out/genus3.obj count=2000
  "$rtfmesh" sample genus3 "$input"
fi
name=$(basename "$input")
output=out/${name%.*}-remeshed.ply

printf '\n==> rtfmesh remesh %s\n' "$input $output -n $count --report out/report.json $*"
"$rtfmesh" remesh "$input" "$output" -n "$count" --report out/report.json "$@"

# Rows are "name   value", with at least two blanks between; bytes that continue a character have no width.
side_by_side() {
  LC_ALL=C awk -v left="$1" -v right="$2" '
    function pad(text, width, bare) { bare = text; gsub(/[\200-\277]/, "", bare)
      return sprintf("%s%*s", text, width - length(bare), "") }
    function cells(line, parts) { sub(/^ +/, "", line); parts[1] = line; sub(/  +.*/, "", parts[1])
      parts[2] = substr(line, length(parts[1]) + 1); sub(/^ +/, "", parts[2]) }
    FNR == NR { cells($0, c); name[FNR] = c[1]; value[FNR] = c[2]; rows = FNR; next }
    { cells($0, c); other[c[1]] = c[2] }
    END { print " " pad("", 37) pad(left, 48) right
      for (i = 1; i <= rows; i++) print " " pad(name[i], 37) pad(value[i], 48) other[name[i]] }' "$3" "$4"
}
printf '\n==> rtfmesh measure: before and after\n'
side_by_side "$name" "$(basename "$output")" <("$rtfmesh" measure "$input") <("$rtfmesh" measure "$output")
"$rtfmesh" render "$input" "$output" out/demo.png
printf '\nThe new mesh is in %s, the report in out/report.json, a picture of both in out/demo.png.\n' \
  "$PWD/$output"
