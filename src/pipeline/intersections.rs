//! Faces that intersect others, in the input and in a result.

use crate::mesh::intersections::intersecting_faces;
use crate::mesh::unit_frame::UnitFrame;
use crate::{ProgressToken, Result, TriMesh};
use std::sync::OnceLock;

/// The faces of a mesh in the unit-diagonal frame that intersect others in the input's units, since rounding
/// to these may fold thin parts.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn intersecting_in_units(
    mesh: &TriMesh,
    frame: &UnitFrame,
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    let vertices = mesh.vertices.iter().map(|p| frame.from_unit(*p)).collect();
    intersecting_faces(&TriMesh { vertices, triangles: mesh.triangles.clone() }, progress)
}

/// The number of faces of the input that intersect others, counted only if it is not known yet.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn input_intersections(
    known: &OnceLock<usize>,
    input: &TriMesh,
    progress: &ProgressToken,
) -> Result<usize> {
    if let Some(count) = known.get() {
        return Ok(*count);
    }
    let count = intersecting_faces(input, progress)?.len();
    Ok(*known.get_or_init(|| count))
}
