//! Holes filled by patches that follow the surface around them, as dense as that.
//!
//! After Liepa, "Filling holes in meshes" (2003): a hole is triangulated, the triangles are divided until
//! they are as small as those around it, and the new vertices move to where the surface bends least.

mod fair;
mod loops;
mod patch;
mod triangulate;

use glam::DVec3;

use super::RepairCounts;
use crate::mesh::TriMesh;
use crate::mesh::csr::triangles_around;
use crate::mesh::half_edges::{EdgeSet, EdgeTable, edge_key};
use crate::mesh::intersections::intersecting_faces;
use crate::{ProgressToken, Result};
pub(crate) use loops::{Hole, boundary_loops};
use patch::Patch;
pub(crate) use triangulate::triangulate;

/// Fills all holes no larger than `largest` across, in the mesh's unit. The triangles of patches come last,
/// and each has the `origin` of the closest triangle at the hole. The mesh must be oriented.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fill_holes(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    largest: f64,
    counts: &mut RepairCounts,
    progress: &ProgressToken,
) -> Result<()> {
    let holes = boundary_loops(mesh, &EdgeTable::new(&mesh.triangles));
    let count = holes.len();
    let small: Vec<Hole> = holes.into_iter().filter(|hole| hole.width(mesh) <= largest).collect();
    if small.is_empty() {
        counts.holes_left = count;
        return Ok(());
    }
    let taken = edges_between(&small, mesh);
    let around = triangles_around(mesh.vertices.len(), &mesh.triangles);
    let first = mesh.triangles.len();
    // Of each patch, where its new vertices lay in the flat triangulation.
    let mut added: Vec<Added> = Vec::new();
    for hole in small {
        progress.poll()?;
        let Some(mut patch) = Patch::of(&hole, mesh, &taken) else { continue };
        let flat = patch.inner().to_vec();
        fair::fair(&mut patch, &hole, mesh, &around);
        let vertices = mesh.vertices.len() as u32;
        let beside = |k: usize| origin[hole.half_edges[k] as usize / 3];
        let origins: Vec<u32> = patch.sides().into_iter().map(beside).collect();
        origin.extend(origins);
        added.push(Added { vertices, triangles: mesh.triangles.len() as u32, flat });
        let number = |v: u32| hole.vertices.get(v as usize).copied().unwrap_or(vertices + v - hole.len());
        mesh.triangles.extend(patch.triangles.iter().map(|t| t.map(number)));
        mesh.vertices.extend(patch.inner());
    }
    (counts.holes_filled, counts.holes_left) = (added.len(), count - added.len());
    flatten_crossing(mesh, first, &added, progress)
}

/// What was added for a hole.
struct Added {
    /// The first of its new vertices.
    vertices: u32,
    /// The first of its triangles.
    triangles: u32,
    /// The places of the new vertices before they were made fair.
    flat: Vec<DVec3>,
}

/// Makes patches flat again that run into other triangles; those from `first` on are of patches.
fn flatten_crossing(
    mesh: &mut TriMesh,
    first: usize,
    added: &[Added],
    progress: &ProgressToken,
) -> Result<()> {
    for t in intersecting_faces(mesh, progress)?.into_iter().filter(|t| *t as usize >= first) {
        let patch = added.partition_point(|patch| patch.triangles <= t) - 1;
        let Added { vertices, flat, .. } = &added[patch];
        let start = *vertices as usize;
        mesh.vertices[start..start + flat.len()].copy_from_slice(flat);
    }
    Ok(())
}

/// The edges of the mesh between vertices of these holes.
pub(crate) fn edges_between(holes: &[Hole], mesh: &TriMesh) -> EdgeSet {
    let mut is_on_hole = vec![false; mesh.vertices.len()];
    holes.iter().flat_map(|hole| &hole.vertices).for_each(|v| is_on_hole[*v as usize] = true);
    let sides = mesh.triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]);
    let between = sides.filter(|(v, w)| is_on_hole[*v as usize] && is_on_hole[*w as usize]);
    between.map(|(v, w)| edge_key(v, w)).collect()
}
