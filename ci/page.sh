#!/usr/bin/env bash
# Opens a page of `rtfmesh remesh --html` in a browser without a window, tries its controls, and fails with what is
# wrong. ci/page.sh [PAGE.html]; without one, makes one of a model with curves.
set -euo pipefail
own=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"

browser=
for name in ${RTFMESH_BROWSER:-chromium chromium-browser google-chrome chrome}; do
  if command -v "$name" >/dev/null; then browser=$name; break; fi
done
[ -n "$browser" ] || { echo "page: install chromium, or name a browser in RTFMESH_BROWSER" >&2; exit 1; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
page=$own
if [ -z "$page" ]; then
  page=$work/report.html
  cargo run --quiet -- sample box "$work/in.ply"
  cargo run --quiet -- remesh "$work/in.ply" "$work/out.ply" -n 400 --iterations 3 --quiet --html "$page"
fi

# The check goes first, so that it hears of every error.
awk -v check=ci/page_check.js '{ print } /^<head>$/ { print "<script>"; while ((getline line < check) > 0) print line
  print "</script>" }' "$page" >"$work/check.html"
for width in 1280 800; do
  # The page is our own file, so it needs no sandbox, which needs rights that containers lack. Virtual time ends the
  # visit when nothing is left to do, however slow the machine.
  timeout 100 "$browser" --headless --no-sandbox --user-data-dir="$work/profile" --window-size="$width,900" \
    --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-dev-shm-usage \
    --virtual-time-budget=60000 --dump-dom "file://$work/check.html" >"$work/dom.html" 2>"$work/log.txt" ||
    { tail -20 "$work/log.txt" >&2; echo "page: the browser failed" >&2; exit 1; }
  if ! grep -q '<pre id="check">passed' "$work/dom.html"; then
    sed -n '/<pre id="check">/,/<\/pre>/p' "$work/dom.html" | head -40 >&2
    echo "page: the page fails in a window $width wide" >&2
    exit 1
  fi
  echo "page: works in a window $width wide"
done
