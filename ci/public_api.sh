#!/usr/bin/env bash
# Compares the library's public items with docs/public-api.txt; with --write, makes that file anew.
set -euo pipefail
cd "$(dirname "$0")/.."

work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
# rustdoc's JSON is unstable. Only rustdoc itself is told to write it: what cargo is told would compile all
# dependencies again.
cat >"$work/rustdoc" <<'END'
#!/bin/sh
RUSTC_BOOTSTRAP=1 exec rustdoc "$@" -Z unstable-options --output-format json
END
chmod +x "$work/rustdoc"
RUSTDOC=$work/rustdoc cargo rustdoc --quiet --lib --target-dir "${CARGO_TARGET_DIR:-target}"
node ci/public_api.mjs "${CARGO_TARGET_DIR:-target}/doc/rtfmesh.json" >"$work/found.txt"
if [ "${1:-}" = --write ]; then
  cp "$work/found.txt" docs/public-api.txt
elif ! diff -u docs/public-api.txt "$work/found.txt" >&2; then
  echo "public-api: the public items differ; if that is meant, run ./ci/public_api.sh --write and commit" >&2
  exit 1
fi
