//! Boundary loops of a surface through points closed by triangles.

use crate::mesh::TriMesh;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::repair::holes::{boundary_of, edges_between, sides, triangulate};
use crate::{ProgressToken, Result};

/// Fills all boundary loops no larger than `largest` across, in the mesh's unit; returns how many. The mesh
/// must be manifold.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fill(mesh: &mut TriMesh, largest: f64, progress: &ProgressToken) -> Result<usize> {
    let boundary = boundary_of(mesh, &EdgeTable::new(&mesh.triangles));
    let small: Vec<_> = boundary.holes.into_iter().filter(|hole| hole.width(mesh) <= largest).collect();
    let mut taken = edges_between(&small, mesh);
    let mut filled = 0;
    for hole in small {
        progress.poll()?;
        let mut added = Vec::new();
        if triangulate(&hole.vertices, &mesh.vertices, &taken, &mut added) {
            taken.extend(added.iter().flat_map(sides));
            mesh.triangles.extend(added);
            filled += 1;
        }
    }
    Ok(filled)
}
