#!/usr/bin/env bash
# Everything that must hold before a change is taken: format, lints, house rules, documentation, tests.
# Stops at the first failure. RTFMESH_DEVICE chooses the device of the tests; the CPU if unset.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"

step() {
  local name=$1
  shift
  printf '\n==> %s\n' "$name"
  "$@" || { printf '\n==> failed: %s\n' "$name" >&2; exit 1; }
}

# Programs of their own, after `cargo test` has compiled them.
run_examples() {
  local example
  for example in sharp_edges onto many; do
    cargo run --quiet --example "$example" || return
  done
}

# First what needs no code from the compiler: all passes share what they learn of the dependencies.
step "setup" ./ci/setup.sh --tests
step "house rules" ./ci/rules.sh
step "format" cargo fmt --check
step "lints" cargo clippy --workspace --all-targets -- -D warnings
step "the library with pages" cargo check --quiet --lib --no-default-features --features html
# They use the library without any feature.
step "the library alone and the fuzz targets" cargo check --quiet --manifest-path fuzz/Cargo.toml \
  --no-default-features --target-dir "${CARGO_TARGET_DIR:-target}"
step "the least Rust" ./ci/msrv.sh
step "public items" ./ci/public_api.sh
step "documentation" env RUSTDOCFLAGS="-D warnings" cargo doc --no-deps
# Of an older program.
rm -rf "${CARGO_TARGET_DIR:-target}/tmp/gltf"
step "tests and the examples of the documentation on device '$RTFMESH_DEVICE'" cargo test
step "kernels and whole runs on SwiftShader, with the least limits" ./ci/swiftshader.sh
step "examples" run_examples
step "GLB files under the Khronos validator and in three.js" ./ci/gltf.sh
step "the page in a browser" ./ci/page.sh
step "the Python package" ./ci/python.sh
step "the driver for the CPU as a wheel" ./ci/cpu_wheel.sh
step "the package for crates.io" ./ci/package.sh
