//! Which side of a closed surface is the outside.

use super::fallback::components::Components;
use crate::TriMesh;
use crate::measure::relative_volume;
use crate::mesh::topology::topology;

/// Closed surfaces with a smaller volume, relative to that of their bounding box, have no clear outside.
const FLAT: f64 = 1e-3;

/// Whether two closed surfaces of these relative volumes face opposite ways.
pub(crate) fn are_opposite(one: f64, other: f64) -> bool {
    one.abs() > FLAT && other.abs() > FLAT && one.signum() != other.signum()
}

/// Turns a closed result over if it is inside out, compared with its closed surface of one component: with
/// few vertices, faces on the far side of a dent can outweigh the others.
pub(crate) fn face_as(result: &mut TriMesh, surface: &TriMesh) {
    let is_closed = |mesh: &TriMesh| topology(mesh).boundary_edges == 0;
    if are_opposite(relative_volume(result), relative_volume(surface))
        && is_closed(result)
        && is_closed(surface)
        && Components::new(surface).count() == 1
    {
        result.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}
