#!/usr/bin/env bash
# Builds the site into target/site/html, strictly, and checks it: links, the weight of the start page, and in
# a browser that no page is wider than a window of 390 or 1400 pixels. The gallery's commands are run with
# RTFMESH_PROGRAM, by default the program of `cargo build --release`. RTFMESH_DEVICE chooses the device. To
# look at the site: `python3 -m http.server --directory target/site/html`.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}" PIP_DISABLE_PIP_VERSION_CHECK=1 NO_MKDOCS_2_WARNING=1
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
work=$target/site
program=${RTFMESH_PROGRAM:-}
if [ -z "$program" ]; then
  cargo build --release --quiet
  program=$target/release/rtfmesh
fi
browser=
for name in ${RTFMESH_BROWSER:-chromium chromium-browser google-chrome chrome}; do
  if command -v "$name" >/dev/null; then browser=$name; break; fi
done
[ -n "$browser" ] || { echo "site: install chromium, or name a browser in RTFMESH_BROWSER" >&2; exit 1; }

mkdir -p "$work"
if ! cmp -s site/requirements.txt "$work/env/installed.txt"; then
  rm -rf "$work/env"
  "${PYTHON:-python3}" -m venv "$work/env"
  "$work/env/bin/pip" install --quiet -r site/requirements.txt
  cp site/requirements.txt "$work/env/installed.txt"
fi
"$work/env/bin/ruff" check --quiet --config python/pyproject.toml site
"$work/env/bin/ruff" format --quiet --check --config python/pyproject.toml site
"$work/env/bin/python" site/make.py "$work" "$program"
# Not --quiet, with which warnings are no failures.
"$work/env/bin/mkdocs" build --strict --config-file "$work/mkdocs.yml" >"$work/build.log" 2>&1 ||
  { cat "$work/build.log" >&2; exit 1; }
"$work/env/bin/python" site/check.py "$work" "$browser"
