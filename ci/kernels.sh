#!/usr/bin/env bash
# Compiles the kernels and copies them with their declarations to FOLDER, so that a build there needs no
# shader compiler: ci/kernels.sh FOLDER. The folder is made; build/published.rs reads it as kernels/.
set -euo pipefail
folder=$(realpath -m "$1")
cd "$(dirname "$0")/.."

id=$(cargo pkgid)
# As ci/test.sh lints it, so that nothing is compiled again; kernels depend on no feature or profile.
out=$(cargo clippy --quiet --workspace --all-targets --message-format json-render-diagnostics |
  grep -F "\"reason\":\"build-script-executed\",\"package_id\":\"$id\"" |
  sed 's/.*"out_dir":"\([^"]*\)".*/\1/')
mkdir -p "$folder"
cp "$out"/kernels.rs "$out"/*.spv "$folder"
diff <(find glsl -name '*.comp' | wc -l) <(find "$folder" -name '*.spv' ! -name '*.texels.spv' | wc -l) ||
  { echo "kernels: not as many kernels as in glsl" >&2; exit 1; }
