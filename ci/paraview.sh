#!/usr/bin/env bash
# Tests the filter for ParaView, python/paraview, in Debian's ParaView, and rtfmesh.vtk with its VTK. Installs
# ParaView, which has hundreds of MB with its dependencies. The wheel is that of ci/wheel.sh, which this calls
# if there is none. PYTHON chooses the interpreter whose pip unpacks it, RTFMESH_DEVICE the device.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}" PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
root=$PWD
work=$CARGO_TARGET_DIR/paraview

./ci/packages.sh paraview python3-paraview python3-pytest

compgen -G "$CARGO_TARGET_DIR/dist/rtfmesh-*.whl" >/dev/null || ./ci/wheel.sh

# Without a numpy next to ParaView's own.
rm -rf "$work"
mkdir -p "$work"
"${PYTHON:-python3}" -m pip install --quiet --no-deps --target "$work/site" \
  "$CARGO_TARGET_DIR"/dist/rtfmesh-*.whl
# Without this function of older Pythons, ParaView 5.11 loads no plugin in Python 3.11.
cat >"$work/site/sitecustomize.py" <<'END'
import inspect

if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec
END

# From elsewhere, so that nothing is taken from the sources.
cd "$work"
export PYTHONPATH=$work/site PYTHONDONTWRITEBYTECODE=1
options=(-m pytest --quiet -c "$root/python/pyproject.toml" --rootdir "$root/python"
  -o cache_dir="$work/cache")
pvpython --force-offscreen-rendering "${options[@]}" "$root/python/paraview"
# The Python of pvpython, which cannot start another one.
/usr/bin/python3 "${options[@]}" "$root/python/tests/test_vtk.py"
