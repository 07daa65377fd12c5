#!/usr/bin/env bash
# Makes the package for crates.io, target/package/rtfmesh-VERSION.crate, and tries it as its users have it: a
# new crate depends on it, without any feature, shaderc, cmake or a C++ compiler, and remeshes a model;
# docs.rs's features are documented. With --install, also what `cargo install` gives, which takes a release
# build.
# To publish, then: cargo publish --no-verify --manifest-path target/package/source/Cargo.toml
set -euo pipefail
cd "$(dirname "$0")/.."
export RTFMESH_DEVICE="${RTFMESH_DEVICE:-cpu}"
root=$PWD
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
work=$target/package
id=$(cargo pkgid)
name=rtfmesh-${id##*[#@]}

fail() {
  echo "package: $*" >&2
  exit 1
}

# The files and the manifest as Cargo would publish them, then with kernels in place of what compiles them.
make_source() {
  cargo package --quiet --no-verify --allow-dirty --target-dir "$work/plain" 2>"$work/log" ||
    fail "$(cat "$work/log")"
  tar xzmf "$work/plain/package/$name.crate" -C "$work/source" --strip-components 1
  cp build/published.rs "$work/source/build.rs"
  gzip -dc src/cli/licences.txt.gz >"$work/source/LICENSE-THIRD-PARTY"
  ./ci/kernels.sh "$work/source/kernels"
  cd "$work/source"
  rm .cargo_vcs_info.json Cargo.toml.orig
  # Programs that users install have no line tables, which make them six times as large.
  sed -i -e '/^publish = false$/d' -e '/^\[profile\.release\]$/,/^$/ s/^debug = .*/strip = true/' Cargo.toml
  # No part of the repository's workspace, though it lies in it.
  printf '\n[workspace]\n' >>Cargo.toml
  cargo remove --quiet --offline --build shaderc spirq
  cargo package --quiet --no-verify --offline --allow-dirty --target-dir "$target"
  cd "$root"
}

# Runs a program where no compiler but Rust's and its linker can be found, and no library by pkg-config.
bare() {
  env -u VULKAN_SDK -u PKG_CONFIG_PATH PKG_CONFIG_LIBDIR=/nonexistent SHADERC_LIB_DIR=/nonexistent \
    PATH="$work/bin" CARGO_TARGET_DIR="$target" "$@"
}

make_user() {
  mkdir -p "$work/user/src"
  # Versions and profile of the repository, so that dependencies are not compiled again.
  cp Cargo.lock "$work/user"
  cat - <(awk '/^\[/ { dev = /^\[profile\.dev/ } dev' Cargo.toml) >"$work/user/Cargo.toml" <<'EOF'
[package]
name = "package-user"
edition = "2024"

[workspace]

# One small mesh takes less time than the optimiser.
[profile.dev.package.rtfmesh]
opt-level = 0

EOF
  cat >"$work/user/src/main.rs" <<'EOF'
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, DeviceOptions, Options, remesh};

fn main() -> rtfmesh::Result<()> {
    let device = Device::open(&DeviceOptions::from_env())?;
    let result = remesh(&device, &sample("genus3")?, &Options::new(2000))?;
    println!("{} vertices", result.mesh.vertices.len());
    Ok(())
}
EOF
}

try_package() {
  local found
  cd "$work/user"
  bare cargo add --quiet --offline --no-default-features --path "../$name"
  found=$(cargo tree --offline --edges normal,build --prefix none |
    grep -E '^(shaderc|shaderc-sys|spirq|cmake|cc|cxx|bindgen|pkg-config) ' || true)
  [ -z "$found" ] || fail "the package depends on ${found//$'\n'/, }"
  found=$(bare cargo run --quiet --offline)
  [ "$found" = "2000 vertices" ] || fail "the program printed '$found'"
  # As [package.metadata.docs.rs] has it.
  bare cargo add --quiet --offline --no-default-features --features html --path "../$name"
  bare cargo check --quiet --offline
  RUSTDOCFLAGS="-D warnings" bare cargo doc --quiet --offline --no-deps -p rtfmesh
  cd "$root"
}

try_install() {
  local bytes
  bare cargo install --quiet --offline --locked --path "$work/$name" --root "$work/installed"
  "$work/installed/bin/rtfmesh" sample genus3 "$work/in.ply"
  "$work/installed/bin/rtfmesh" remesh "$work/in.ply" "$work/out.ply" -n 2k
  bytes=$(wc -c <"$work/installed/bin/rtfmesh")
  echo "package: the installed program has $bytes bytes"
  [ "$bytes" -le 10000000 ] || fail "that is more than 10 MB"
}

rm -rf "$work"
mkdir -p "$work/source" "$work/bin"
for tool in cargo rustc rustdoc cc ld; do ln -s "$(command -v "$tool")" "$work/bin"; done
rustfmt --check build/published.rs
make_source
# With the time of now: the package's own, the same for all, would hide changes from Cargo.
tar xzmf "$work/$name.crate" -C "$work"
"${PYTHON:-python3}" ci/licenses.py --check "$work/$name/LICENSE-THIRD-PARTY"
make_user
try_package
if [ "${1:-}" = --install ]; then try_install; fi
bytes=$(wc -c <"$work/$name.crate")
echo "package: $work/$name.crate, $bytes bytes"
[ "$bytes" -le 10000000 ] || fail "crates.io takes 10 MB at most"
