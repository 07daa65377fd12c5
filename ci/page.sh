#!/usr/bin/env bash
# Opens a page of `rtfmesh remesh --html` in a browser without a window, tries its controls, and fails with
# what is wrong. ci/page.sh [PAGE.html]; without one, makes one with the debug program as it stands.
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
browser_pid=
leave() {
  if [ -n "$browser_pid" ]; then kill "$browser_pid" 2>/dev/null; fi
  # The browser's last processes may still write into its profile.
  for _ in 1 2 3 4 5; do rm -rf "$work" 2>/dev/null && return; sleep 1; done
  echo "page: $work could not be removed" >&2
}
trap leave EXIT
page=$own
if [ -z "$page" ]; then
  page=$work/report.html
  # The program that the tests built; building it without them takes minutes, with other dependency features.
  rtfmesh=${CARGO_TARGET_DIR:-target}/debug/rtfmesh
  [ -x "$rtfmesh" ] || cargo build --quiet
  "$rtfmesh" sample open-hemisphere "$work/in.ply"
  "$rtfmesh" remesh "$work/in.ply" "$work/out.ply" -n 400 --iterations 3 --quiet --html "$page"
fi

# The check comes first, so that it sees every error.
awk -v check=ci/page_check.js '{ print }
  /^<head>$/ { print "<script>"; while ((getline line < check) > 0) print line; print "</script>" }
' "$page" >"$work/check.html"
for width in 1280 800; do
  log=$work/log.txt
  : >"$log"
  # The page is our own file, so no sandbox is needed, which containers do not permit. The port keeps the
  # browser open until the page has logged its result.
  "$browser" --headless --no-sandbox --user-data-dir="$work/profile-$width" --window-size="$width,900" \
    --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-dev-shm-usage \
    --enable-logging=stderr --remote-debugging-port=0 "file://$work/check.html" >"$log" 2>&1 &
  browser_pid=$!
  for _ in $(seq 90); do
    if grep -q 'page check:' "$log" || ! kill -0 "$browser_pid" 2>/dev/null; then break; fi
    sleep 1
  done
  kill "$browser_pid" 2>/dev/null || true
  wait "$browser_pid" 2>/dev/null || true
  browser_pid=
  if ! grep -q 'page check: passed' "$log"; then
    { grep -o 'page problem: .*' "$log" || tail -20 "$log"; } >&2
    echo "page: the page fails in a window $width pixels wide" >&2
    exit 1
  fi
  echo "page: works in a window $width pixels wide"
done
