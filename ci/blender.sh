#!/usr/bin/env bash
# Builds the extension for Blender with its wheels, target/blender/rtfmesh-blender-*.zip, installs it into the
# package bpy, which is Blender without a window, and runs blender/tests. ci/blender.sh [VERSION...] names
# versions of bpy; without any, these are the oldest supported one and the newest. The wheels are those of
# ci/wheel.sh, which it calls if there are none, and of ci/cpu_wheel.sh, if there are any. PYTHON chooses the
# interpreter: these versions need 3.11. RTFMESH_DEVICE chooses the device.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}" PIP_DISABLE_PIP_VERSION_CHECK=1
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
root=$PWD
python=${PYTHON:-python3}
work=$CARGO_TARGET_DIR/blender
versions=("$@")
if [ $# = 0 ]; then versions=(4.2.23 5.0.1); fi
if [ "$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')" != 3.11 ]; then
  echo "blender: bpy ${versions[*]} needs Python 3.11; name it in PYTHON" >&2
  exit 1
fi

# What bpy is linked with.
./ci/packages.sh libgl1 libice6 libsm6 libx11-6 libxfixes3 libxi6 libxkbcommon0 libxrender1

compgen -G "$CARGO_TARGET_DIR/dist/rtfmesh-*.whl" >/dev/null || ./ci/wheel.sh

# An environment for each version of bpy; it stays, because bpy has 350 MB.
for bpy in "${versions[@]}"; do
  if [ ! -e "$work/bpy-$bpy/installed" ]; then
    rm -rf "$work/bpy-$bpy"
    "$python" -m venv "$work/bpy-$bpy"
    "$work/bpy-$bpy/bin/pip" install --quiet "bpy==$bpy" -r blender/requirements-test.txt
    touch "$work/bpy-$bpy/installed"
  fi
done
newest=$work/bpy-${versions[-1]}
"$newest/bin/ruff" check --quiet blender
"$newest/bin/ruff" format --quiet --check blender

rm -rf "$work/source" "$work"/*.zip
mkdir -p "$work/source/wheels"
cp blender/extension/*.{py,toml} LICENSE-* "$work/source"
cp "$CARGO_TARGET_DIR"/dist/rtfmesh-*.whl "$work/source/wheels"
for wheel in "$CARGO_TARGET_DIR"/{dist,python/wheels}/rtfmesh_cpu-*.whl; do
  if [ -e "$wheel" ]; then cp "$wheel" "$work/source/wheels"; fi
done
"$python" blender/finish_manifest.py "$work/source"
# Blender's own program for extensions.
pack() { "$newest/bin/python" "$(find "$newest/lib" -name blender_ext.py)" "$@"; }
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' blender/extension/blender_manifest.toml)
extension=$work/rtfmesh-blender-$version.zip
pack build --source-dir "$work/source" --output-filepath "$extension"
pack validate "$extension"

for bpy in "${versions[@]}"; do
  echo "blender: $bpy"
  # From elsewhere, so that nothing is taken from the sources.
  (cd "$work" && "$work/bpy-$bpy/bin/pytest" --quiet -c "$root/blender/pytest.ini" \
    --rootdir "$root/blender" -o cache_dir="$work/cache" "$root/blender/tests")
done
ls -sh "$extension"
