#!/usr/bin/env bash
# The licences and sources of all dependencies against deny.toml, by cargo-deny, which takes some minutes to
# build the first time.
set -euo pipefail
cd "$(dirname "$0")/.."
version=0.20.2
tools=$(realpath -m "${CARGO_TARGET_DIR:-target}")/deny

if [ "$("$tools/bin/cargo-deny" --version 2>/dev/null)" != "cargo-deny $version" ]; then
  CARGO_TARGET_DIR=$tools/build cargo install --quiet --locked --version "$version" --root "$tools" cargo-deny
  rm -rf "$tools/build"
fi
"$tools/bin/cargo-deny" --locked check bans licenses sources
