//! Holes filled by patches that follow the surface around them.
//!
//! After Liepa, "Filling holes in meshes" (2003): a hole is triangulated, the triangles are divided until
//! they are about as small as those around it, and the new vertices move to where the surface bends least.

mod fair;
mod hanging;
mod loops;
mod patch;
mod triangulate;

use glam::DVec3;

use super::{RepairCounts, connected_components};
use crate::mesh::TriMesh;
use crate::mesh::csr::triangles_around;
use crate::mesh::half_edges::{EdgeSet, EdgeTable, edge_key};
use crate::mesh::intersections::intersecting_faces;
use crate::{ProgressToken, Result};
use loops::Boundary;
pub(crate) use loops::{Hole, boundary_of};
use patch::Patch;
pub(crate) use triangulate::triangulate;

/// Fills all holes no larger than `largest` across, in the mesh's unit. The rim of a flat part is none, and
/// neither are those of components no larger themselves. Small parts that hang in a hole by a vertex are
/// removed. The triangles of patches come last, and each has the `origin` of the closest triangle at its
/// hole. The mesh must be oriented. Returns the number of the first of them.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fill_holes(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    largest: f64,
    counts: &mut RepairCounts,
    progress: &ProgressToken,
) -> Result<usize> {
    let mut table = EdgeTable::new(&mesh.triangles);
    counts.parts_removed = hanging::remove(mesh, origin, largest, &table);
    if counts.parts_removed > 0 {
        table = EdgeTable::new(&mesh.triangles);
    }
    let Boundary { holes, is_open } = boundary_of(mesh, &table);
    let is_small = small_components(mesh, largest);
    let is_filled = |hole: &Hole| !is_small(hole) && hole.width(mesh) <= largest && !hole.is_rim(mesh);
    let (holes, wide): (Vec<Hole>, Vec<Hole>) = holes.into_iter().partition(is_filled);
    counts.holes_left = wide.len();
    counts.holes_unfilled = usize::from(is_open);
    let mut taken = edges_between(&holes, mesh);
    let around = triangles_around(mesh.vertices.len(), &mesh.triangles);
    let first = mesh.triangles.len();
    let mut added: Vec<Added> = Vec::new();
    for hole in holes {
        progress.poll()?;
        let Some(mut patch) = Patch::of(&hole, mesh, &taken) else {
            counts.holes_unfilled += 1;
            continue;
        };
        let flat = patch.inner().to_vec();
        fair::fair(&mut patch, &hole, (mesh, &around), progress)?;
        let vertices = mesh.vertices.len() as u32;
        let beside = |k: usize| origin[hole.half_edges[k] as usize / 3];
        let origins: Vec<u32> = patch.sides().into_iter().map(beside).collect();
        origin.extend(origins);
        let fair = patch.inner().to_vec();
        let number = |v: u32| hole.vertices.get(v as usize).copied().unwrap_or(vertices + v - hole.len());
        let triangles = patch.triangles.iter().map(|t| t.map(number));
        // Another hole may have the same two vertices.
        taken.extend(triangles.clone().flat_map(|t| sides(&t)));
        added.push(Added { vertices, triangles: mesh.triangles.len() as u32, flat, fair });
        mesh.triangles.extend(triangles);
        mesh.vertices.extend(patch.inner());
    }
    counts.holes_filled = added.len();
    if !added.is_empty() {
        flatten_crossing(mesh, first, &added, progress)?;
    }
    Ok(first)
}

/// Tells holes of components that are no larger than `largest` across, unless the whole mesh is not.
fn small_components(mesh: &TriMesh, largest: f64) -> impl Fn(&Hole) -> bool + use<> {
    let (of_triangle, areas) = connected_components(mesh);
    let mut bounds = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; areas.len()];
    for (t, part) in of_triangle.iter().enumerate() {
        let [low, high] = &mut bounds[*part as usize];
        mesh.corners(t).into_iter().for_each(|p| (*low, *high) = (low.min(p), high.max(p)));
    }
    let whole = mesh.bounds().map_or(0.0, |[low, high]| high.distance(low));
    move |hole| {
        let [low, high] = bounds[of_triangle[hole.half_edges[0] as usize / 3] as usize];
        largest < whole && high.distance(low) <= largest
    }
}

/// What was added for a hole.
struct Added {
    /// The first of its new vertices.
    vertices: u32,
    /// The first of its triangles.
    triangles: u32,
    /// The places of the new vertices before they were made fair.
    flat: Vec<DVec3>,
    /// The places after that.
    fair: Vec<DVec3>,
}

impl Added {
    fn put(&self, places: &[DVec3], mesh: &mut TriMesh) {
        let start = self.vertices as usize;
        mesh.vertices[start..start + places.len()].copy_from_slice(places);
    }
}

/// Makes patches flat again that run into other triangles, unless as many of theirs then do so; those from
/// `first` on are of patches.
fn flatten_crossing(
    mesh: &mut TriMesh,
    first: usize,
    added: &[Added],
    progress: &ProgressToken,
) -> Result<()> {
    let crossing = |mesh: &TriMesh| -> Result<Vec<usize>> {
        let mut counts = vec![0; added.len()];
        for t in intersecting_faces(mesh, progress)?.into_iter().filter(|t| *t as usize >= first) {
            counts[added.partition_point(|patch| patch.triangles <= t) - 1] += 1;
        }
        Ok(counts)
    };
    let before = crossing(mesh)?;
    if before.iter().all(|count| *count == 0) {
        return Ok(());
    }
    let hit = added.iter().zip(&before).filter(|(_, count)| **count > 0);
    hit.for_each(|(patch, _)| patch.put(&patch.flat, mesh));
    let after = crossing(mesh)?;
    for ((patch, before), after) in added.iter().zip(&before).zip(after) {
        if *before > 0 && after >= *before {
            patch.put(&patch.fair, mesh);
        }
    }
    Ok(())
}

/// The edges of a triangle.
pub(crate) fn sides([a, b, c]: &[u32; 3]) -> [(u32, u32); 3] {
    [edge_key(*a, *b), edge_key(*b, *c), edge_key(*c, *a)]
}

/// The edges of the mesh between vertices of these holes.
pub(crate) fn edges_between(holes: &[Hole], mesh: &TriMesh) -> EdgeSet {
    let mut is_on_hole = vec![false; mesh.vertices.len()];
    holes.iter().flat_map(|hole| &hole.vertices).for_each(|v| is_on_hole[*v as usize] = true);
    let is_between = |(v, w): &(u32, u32)| is_on_hole[*v as usize] && is_on_hole[*w as usize];
    mesh.triangles.iter().flat_map(sides).filter(is_between).collect()
}
