#!/usr/bin/env bash
# All places that name the version name the same one; with a tag such as v0.1.0 or refs/tags/v0.1.0, that of
# the tag, and CHANGELOG.md has its date. Other references are ignored.
set -euo pipefail
cd "$(dirname "$0")/.."

version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
fail() {
  echo "version: $*" >&2
  exit 1
}
same() { [ "$2" = "$version" ] || fail "$1 has '$2', and Cargo.toml '$version'"; }
same python/Cargo.toml "$(sed -n 's/^version = "\(.*\)"$/\1/p' python/Cargo.toml | head -1)"
same blender/extension/blender_manifest.toml \
  "$(sed -n 's/^version = "\(.*\)"$/\1/p' blender/extension/blender_manifest.toml)"
same CITATION.cff "$(sed -n 's/^version: //p' CITATION.cff)"
same CHANGELOG.md "$(sed -n 's/^## \[\([0-9.]*\)\].*/\1/p' CHANGELOG.md | head -1)"
tag=${1:-}
tag=${tag#refs/tags/}
if [[ $tag == v[0-9]* ]]; then
  same "the tag" "${tag#v}"
  grep -qE "^## \[$version\] - [0-9]{4}-[0-9]{2}-[0-9]{2}$" CHANGELOG.md || fail "CHANGELOG.md has no date"
fi
