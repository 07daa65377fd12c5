#!/usr/bin/env bash
# The kernels against their references, and whole runs, on SwiftShader as on a device with no more than it
# must have: subgroups of four, 16 KiB of shared memory, 128 invocations a workgroup, no timestamps. It comes
# with Chromium. ci/swiftshader.sh [TEST...]; without a name, those that suit a second driver.
set -euo pipefail
cd "$(dirname "$0")/.."

driver=
for folder in /usr/lib/chromium /usr/lib/chromium-browser /opt/google/chrome; do
  if [ -f "$folder/vk_swiftshader_icd.json" ]; then driver=$folder/vk_swiftshader_icd.json; break; fi
done
[ -n "$driver" ] || { echo "swiftshader: install chromium" >&2; exit 1; }
# The loader's old name of the variable, and its new one.
export VK_ICD_FILENAMES=$driver VK_DRIVER_FILES=$driver RTFMESH_DEVICE=swiftshader RTFMESH_LEAST_LIMITS=1

tests=("$@")
if [ ${#tests[@]} -eq 0 ]; then
  tests=(stages:: gpu:: pipeline::presets pipeline::coarse_to_fine)
  # Long runs of kernels that the others run, too, and what is the host's.
  for name in pipeline::presets::{presets_find_the_faults,planes_of_a_cloud,power_faces_relax} \
    pipeline::coarse_to_fine::{divided_dispatches,lists_in_several_buffers,few_sites_open} \
    stages::face::planar::faces_are_exact_with_short_lists gpu::memory::; do
    tests+=(--skip "$name")
  done
fi
cargo test --quiet --test tests -- "${tests[@]}"
