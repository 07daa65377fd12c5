#!/usr/bin/env bash
# Makes target/dist/rtfmesh-VERSION-sources.tar.gz: the repository with compiled kernels and without the
# shader compiler, so that any system with Rust builds it, by ci/binary.sh, ci/wheel.sh or cargo. The unpacked
# tree stays in target/dist/sources.
set -euo pipefail
cd "$(dirname "$0")/.."
dist=$(realpath -m "${CARGO_TARGET_DIR:-target}")/dist
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
name=rtfmesh-$version-sources
tree=$dist/sources/$name

rm -rf "$dist/sources"
mkdir -p "$tree"
# As they are, not as they were committed.
git ls-files --cached --others --exclude-standard | while read -r file; do
  if [ -f "$file" ]; then echo "$file"; fi
done | tar -cf - -T - | tar -C "$tree" -xf -
./ci/kernels.sh "$tree/kernels"
cp build/published.rs "$tree/build.rs"
(
  cd "$tree"
  rm -r build .cargo
  # Programs that users install have no line tables, which make them six times as large.
  sed -i -e '/^\[profile\.release\]$/,/^$/ s/^debug = .*/strip = true/' Cargo.toml
  cargo remove --quiet --offline --build shaderc spirq
  # The shader compiler's lines leave Cargo.lock; --locked works from then on.
  cargo metadata --quiet --offline --format-version 1 >/dev/null
)
"${PYTHON:-python3}" ci/pack.py "$tree" "$dist/$name.tar.gz"
