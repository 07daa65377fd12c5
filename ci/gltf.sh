#!/usr/bin/env bash
# Checks every GLB file that the tests stored in target/tmp/gltf with the Khronos validator and by opening it
# in three.js; fails on any error or warning. Needs node, npm and the network.
set -euo pipefail
cd "$(dirname "$0")/.."

folder=${CARGO_TARGET_DIR:-target}/tmp/gltf
files=("$folder"/*.glb)
[ -f "${files[0]}" ] || { echo "gltf: no files: run the tests first" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT

# Extracts version $2 of package $1 as $work/$1 if its integrity is $3.
fetch() {
  local archive=$work/$1-$2.tgz found
  (cd "$work" && npm pack --silent "$1@$2" >/dev/null)
  found=sha512-$(openssl dgst -sha512 -binary "$archive" | base64 -w0)
  [ "$found" = "$3" ] || { echo "gltf: $1 $2 has the integrity $found" >&2; exit 1; }
  mkdir -p "$work/node_modules/$1"
  tar -xzf "$archive" -C "$work/node_modules/$1" --strip-components=1
}
fetch gltf-validator 2.0.0-dev.3.10 \
  sha512-odJ4k0tRkGXiDGn78yDBg+fBbAIvBnXxh3RwAta0emSxGtyagFE8B4xELB1oYe3S5RD8Ci3uZAsZaascH2LAEQ==
# The version that the HTML pages use.
source <(grep -E '^three(_sri)?=' ci/vendor.sh)
fetch three "$three" "$three_sri"
cp ci/gltf_check.mjs "$work"
node "$work/gltf_check.mjs" "${files[@]}"
