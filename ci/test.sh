#!/usr/bin/env bash
# What must hold before each commit: format, lints, house rules, documentation, tests. ./ci/more.sh checks the
# rest. Stops at the first failure. RTFMESH_DEVICE chooses the device of the tests; the CPU if unset.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"
source ci/step.sh

# First what needs no code from the compiler: all passes share what they learn of the dependencies.
step "setup" ./ci/setup.sh --tests
step "house rules" ./ci/rules.sh
step "versions" ./ci/version.sh
step "format" cargo fmt --check
step "lints" cargo clippy --workspace --all-targets -- -D warnings
step "the least Rust" ./ci/msrv.sh
step "licences of the dependencies" "${PYTHON:-python3}" ci/licenses.py
step "public items" ./ci/public_api.sh
step "documentation" env RUSTDOCFLAGS="-D warnings" cargo doc --no-deps
# Of an older program.
rm -rf "${CARGO_TARGET_DIR:-target}/tmp/gltf"
step "tests and the examples of the documentation on device '$RTFMESH_DEVICE'" cargo test
