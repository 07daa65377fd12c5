#!/usr/bin/env bash
# Builds the Python package as a wheel and tests it as its users have it: installed into an empty environment,
# first with numpy alone, then with PyVista, trimesh and a local Ray. The wheel stays in target/python/wheels;
# --release makes one to publish. PYTHON chooses the interpreter, RTFMESH_DEVICE the device.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}" PIP_DISABLE_PIP_VERSION_CHECK=1
root=$PWD
work=$(realpath -m "${CARGO_TARGET_DIR:-target}")/python
# What other tests have compiled serves this one, too, since features are the same.
build=(--profile dev --features rtfmesh/internals)
if [ "${1:-}" = --release ]; then build=(--profile release); fi

environment() {
  rm -rf "$work/$1"
  "${PYTHON:-python3}" -m venv "$work/$1"
}

mkdir -p "$work"
environment tools
"$work/tools/bin/pip" install --quiet -r python/requirements-tools.txt
"$work/tools/bin/ruff" check --quiet python
"$work/tools/bin/ruff" format --quiet --check python

# maturin puts LICENSE-* into the wheel.
gzip -dc src/cli/licences.txt.gz >python/LICENSE-THIRD-PARTY
rm -rf "$work/wheels"
"$work/tools/bin/maturin" build --quiet --locked "${build[@]}" --manifest-path python/Cargo.toml \
  --out "$work/wheels"

# A fresh machine: the lines of README.md give a mesh.
environment user
"$work/user/bin/pip" install --quiet "$work"/wheels/*.whl
"$work/user/bin/python" ci/licenses.py --check \
  "$work"/user/lib/python*/site-packages/rtfmesh-*.dist-info/licenses/LICENSE-THIRD-PARTY
rm -rf "$work/fresh"
mkdir "$work/fresh"
awk '/^```/ { inside = /^```python/; next } inside' README.md >"$work/fresh/readme.py"
(
  cd "$work/fresh"
  "$work/user/bin/rtfmesh" sample bumpy-sphere scan.ply
  "$work/user/bin/python" -W error readme.py
  "$work/user/bin/rtfmesh" measure scan-10k.ply | grep -q '^ *vertices, faces *10000,'
)

"$work/user/bin/pip" install --quiet -r python/requirements-test.txt
# From elsewhere, so that nothing is taken from the sources.
cd "$work/fresh"
# Where ./ci/gltf.sh looks for files to check.
export RTFMESH_GLTF=${work%/python}/tmp/gltf
mkdir -p "$RTFMESH_GLTF"
"$work/user/bin/mypy" --config-file "$root/python/pyproject.toml" -p rtfmesh
"$work/user/bin/mypy" --config-file "$root/python/pyproject.toml" "$root/python/tests/typed.py"
"$work/user/bin/pytest" --quiet -c "$root/python/pyproject.toml" --rootdir "$root/python" \
  -o cache_dir="$work/cache" "$root/python/tests"
