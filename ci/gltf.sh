#!/usr/bin/env bash
# Has the Khronos validator look at every GLB file that the tests left in target/tmp/gltf, and fails if it finds an error or
# warns. Needs node, npm and the network.
set -euo pipefail
cd "$(dirname "$0")/.."

validator=2.0.0-dev.3.10
integrity=sha512-odJ4k0tRkGXiDGn78yDBg+fBbAIvBnXxh3RwAta0emSxGtyagFE8B4xELB1oYe3S5RD8Ci3uZAsZaascH2LAEQ==

folder=${CARGO_TARGET_DIR:-target}/tmp/gltf
files=("$folder"/*.glb)
[ -f "${files[0]}" ] || { echo "gltf: no files: run the tests first" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
archive=$work/gltf-validator-$validator.tgz
(cd "$work" && npm pack --silent "gltf-validator@$validator" >/dev/null)
found=sha512-$(openssl dgst -sha512 -binary "$archive" | base64 -w0)
[ "$found" = "$integrity" ] || { echo "gltf: gltf-validator $validator has the integrity $found" >&2; exit 1; }
tar -xzf "$archive" -C "$work"
node ci/gltf_check.js "$work/package" "${files[@]}"
