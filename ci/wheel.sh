#!/usr/bin/env bash
# Builds the wheel of this system, and tries it in an empty environment without a device; it stays in
# target/dist. From the repository or from the sources of ci/sources.sh. PYTHON chooses the interpreter; the
# wheel works with all versions from 3.10 on. RTFMESH_GLIBC=2.28 links against that version of Linux's C
# library, by zig. ci/python.sh tests it as a whole.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target} PIP_DISABLE_PIP_VERSION_CHECK=1
root=$PWD
dist=$CARGO_TARGET_DIR/dist
work=$dist/wheel

# The interpreter of a new environment, in $python.
environment() {
  "${PYTHON:-python3}" -m venv "$work/$1"
  python=$work/$1/bin/python
  if [ ! -e "$python" ]; then python=$work/$1/Scripts/python.exe; fi
}

rm -rf "$work"
mkdir -p "$work"
environment tools
"$python" -m pip install --quiet "$(grep '^maturin==' python/requirements-tools.txt | tr -d '\r')"
gzip -dc src/cli/licences.txt.gz >python/LICENSE-THIRD-PARTY
# Only what the index of Python packages takes.
options=(--compatibility pypi)
if [ -n "${RTFMESH_GLIBC:-}" ]; then
  source ci/zig.sh
  options=(--zig --compatibility "manylinux_${RTFMESH_GLIBC/./_}")
fi
"$python" -m maturin build --quiet --release --locked "${options[@]}" --manifest-path python/Cargo.toml \
  --out "$work/out"
cp "$work"/out/*.whl "$dist"

environment user
"$python" -m pip install --quiet "$work"/out/*.whl
cd "$work"
"$python" -m rtfmesh sample genus3 in.ply
"$python" -m rtfmesh bug-report --no-self-test
"$python" -W error - <<'END'
import rtfmesh

mesh = rtfmesh.read("in.ply")
assert rtfmesh.measure(mesh)["topology"]["genus"] == 3
END
cd "$root"
ls -l "$work"/out/*.whl
