#!/usr/bin/env bash
# Builds the program for this system, tries it without a device, and packs it with manual, completions and
# licences: target/dist/rtfmesh-VERSION-TARGET.tar.gz, on Windows .zip. From the repository or from the
# sources of ci/sources.sh. PYTHON chooses the interpreter that packs; RTFMESH_GLIBC=2.28 links against that
# version of Linux's C library, by zig.
set -euo pipefail
cd "$(dirname "$0")/.."
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
dist=$CARGO_TARGET_DIR/dist
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
target=$(rustc -vV | sed -n 's/^host: //p')
folder=$dist/binary/rtfmesh-$version-$target
case $target in
*windows*) program=rtfmesh.exe archive=zip ;;
*) program=rtfmesh archive=tar.gz ;;
esac

# Programs that users install have no line tables.
export CARGO_PROFILE_RELEASE_DEBUG=none CARGO_PROFILE_RELEASE_STRIP=true
built=$CARGO_TARGET_DIR/release/$program
if [ -n "${RTFMESH_GLIBC:-}" ]; then
  source ci/zig.sh
  cargo zigbuild --release --locked --target "$target.$RTFMESH_GLIBC"
  built=$CARGO_TARGET_DIR/$target/release/$program
else
  cargo build --release --locked
fi
rm -rf "$dist/binary"
mkdir -p "$folder/man" "$folder/completions"
cp "$built" README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT "$folder"
run() { "$folder/$program" "$@"; }
run man "$folder/man"
for shell in bash elvish fish powershell zsh; do
  run completions $shell >"$folder/completions/rtfmesh.$shell"
done
run licences >"$folder/LICENSE-THIRD-PARTY"

# What it does without a device.
try=$dist/binary/try
mkdir "$try"
run --version | grep -qF "rtfmesh $version"
run sample genus3 "$try/in.ply"
run measure "$try/in.ply" | grep -q 'quality'
run render "$try/in.ply" "$try/in.png"
run bug-report --no-self-test
"${PYTHON:-python3}" ci/pack.py "$folder" "$dist/rtfmesh-$version-$target.$archive"
ls -l "$dist/rtfmesh-$version-$target.$archive"
