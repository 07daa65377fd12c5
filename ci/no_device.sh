#!/usr/bin/env bash
# The tests that need no Vulkan device, on a system that has none or hides it: ci/no_device.sh [OPTION...]
# with options of cargo; RTFMESH_SKIP names more tests to leave out. From the repository or from the sources
# of ci/sources.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
# A driver that is opened all the same would not be found.
export VK_DRIVER_FILES=none VK_ICD_FILENAMES=none RTFMESH_DEVICE=none

folders=(mesh:: io:: volume:: cloud:: local:: polish:: sites:: cli::shell)
# Tests of these folders that remesh something.
devices=(
  the_program stages:: mesh::attributes mesh::follow local::mend
  cloud::survey::a_batch_remeshes_points_as_it_does_meshes
  io::gltf_materials::every_material_has_its_primitive
  io::references::what_is_no_image_does_not_get_into_a_result
  io::round_trips::runs_do_not_depend_on_the_files
  io::vtk::cell_data_are_labels_whose_borders_can_be_kept
  mesh::correspondence::runs_tell_it_only_when_asked
  mesh::correspondence::vertices_on_curves_lie_on_edges
  volume::boxes::
  volume::labels::a_lens_between_two_balls
)
skipped=()
for name in "${devices[@]}" ${RTFMESH_SKIP:-}; do skipped+=(--skip "$name"); done
cargo test --quiet --locked "$@" --test tests -- "${folders[@]}" "${skipped[@]}"
