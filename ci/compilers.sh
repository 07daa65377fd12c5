#!/usr/bin/env bash
# What drivers' compilers make of the kernels, without a GPU. RADV compiles all of them for generations of
# AMD's GPUs, on the null device of Debian's Mesa: none may spill registers or need scratch memory, and enough
# subgroups must run at a time. Lavapipe remeshes with subgroups of 4, 8 and 16 lanes, and with garbage in
# fresh memory: all give the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."

# GFX9, GFX10 and GFX10.3, which Mesa 22.3 knows; newer versions also know GFX11 and GFX12.
families=(vega10 navi10 navi21)
newer=(navi31 gfx1200)

driver=$(find /usr/share/vulkan/icd.d -name 'radeon_icd*.json' -print -quit)
[ -n "$driver" ] || { echo "compilers: RADV is missing: run ./ci/setup.sh" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT

# compile FAMILY: 0 if all is well.
compile() {
  RADV_FORCE_FAMILY=$1 RADV_DEBUG=nocache VK_ICD_FILENAMES=$driver VK_DRIVER_FILES=$driver RTFMESH_DEVICE=0 \
    RTFMESH_CACHE_DIR=$work/$1 RUST_BACKTRACE=0 cargo test --quiet --bench compilers \
    >"$work/$1.txt" 2>"$work/$1.err"
}

for family in "${families[@]}" "${newer[@]}"; do
  if compile "$family"; then
    tail -n 1 "$work/$family.txt"
  elif [[ " ${newer[*]} " == *" $family "* ]] && grep -q 'Unknown family' "$work/$family.err"; then
    echo "this Mesa does not know $family"
  else
    cat "$work/$family.err" >&2
    exit 1
  fi
done

# The program of the tests: `cargo build` would compile the library once more, without its inner parts.
cargo test --quiet --test tests --no-run
program=${CARGO_TARGET_DIR:-target}/debug/rtfmesh
"$program" sample genus3 "$work/in.obj"
# remesh NAME [VARIABLE=VALUE]: with the self-test, which depends on the lanes.
remesh() {
  env RTFMESH_DEVICE=cpu RTFMESH_SELF_TEST=1 "RTFMESH_CACHE_DIR=$work/cache-$1" "${@:2}" \
    "$program" remesh "$work/in.obj" "$work/$1.ply" -n 3k --quiet
}
remesh plain
remesh lanes-4 LP_NATIVE_VECTOR_WIDTH=128
remesh lanes-8 LP_NATIVE_VECTOR_WIDTH=256
remesh lanes-16 LP_NATIVE_VECTOR_WIDTH=512
# The C library then fills what it allocates, and lavapipe's memory comes from it.
remesh garbage MALLOC_PERTURB_=165
for name in lanes-4 lanes-8 lanes-16 garbage; do
  cmp "$work/plain.ply" "$work/$name.ply" || { echo "compilers: $name changes the mesh" >&2; exit 1; }
done
echo "lavapipe: the same mesh with subgroups of 4, 8 and 16, and with garbage in fresh memory"
