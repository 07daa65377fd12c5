#!/usr/bin/env bash
# What must hold beyond ./ci/test.sh before a change is taken: a second driver, examples, pages, GLB files,
# the Python package, wheels, the package for crates.io, workflows. Stops at a failure, but for steps that
# others do not wait for: theirs show in the end.
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"
source ci/step.sh

# Programs of their own, after `cargo test` has compiled them.
run_examples() {
  local example
  for example in sharp_edges onto many; do
    cargo run --quiet --example "$example" || return
  done
}

step "setup" ./ci/setup.sh --tests
beside "kernels and whole runs on SwiftShader, with the least limits" ./ci/swiftshader.sh
beside "workflows, forms and metadata" ./ci/workflows.sh
step "compilers of other GPUs, other subgroups, garbage in fresh memory" ./ci/compilers.sh
step "examples" run_examples
beside "the package for crates.io" ./ci/package.sh
step "the page in a browser" ./ci/page.sh
step "the Python package" ./ci/python.sh
step "GLB files under the Khronos validator and in three.js" ./ci/gltf.sh
step "the driver for the CPU as a wheel" ./ci/cpu_wheel.sh
wait_for_all
