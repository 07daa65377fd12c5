#!/usr/bin/env bash
# The least Rust that Cargo.toml names: no dependency asks for a later one, and clippy's incompatible_msrv
# sees to the standard library. With --compile all of it is compiled with that Rust, which must be installed:
# rustup toolchain install VERSION --profile minimal.
set -euo pipefail
cd "$(dirname "$0")/.."

least=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)
[ -n "$least" ] || { echo "msrv: Cargo.toml has no rust-version" >&2; exit 1; }
host=$(rustc -vV | sed -n 's/^host: //p')
most=$(cargo metadata --format-version 1 --locked --filter-platform "$host" |
  grep -o '"rust_version":"[^"]*"' | cut -d '"' -f 4 | cat - <(echo "$least") | sort -V | tail -n 1)
if [ "$most" != "$least" ] && [ "$most" != "$least.0" ]; then
  echo "msrv: Cargo.toml says Rust $least, and a dependency needs $most" >&2
  exit 1
fi
if [ "${1:-}" = --compile ]; then
  cargo "+$least" check --quiet --locked --workspace --target-dir "${CARGO_TARGET_DIR:-target}/msrv"
fi
