//! Part of a mesh as a mesh of its own, and meshes put together.

use super::half_edges::par_fold_corners;
use super::{NONE, TriMesh};

/// New numbers for the vertices that stay, in their old order: [`NONE`] for those that do not. Also the old
/// number of each that stays.
pub(crate) fn renumber(stays: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let old: Vec<u32> = (0..).zip(stays).filter(|(_, stays)| **stays).map(|(v, _)| v).collect();
    let mut new = vec![NONE; stays.len()];
    (0..).zip(&old).for_each(|(place, v)| new[*v as usize] = place);
    (new, old)
}

/// Whether each of the vertices belongs to a triangle. Panics if an index is out of range.
pub(crate) fn used_vertices(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut is_used = vec![false; vertices];
    par_fold_corners(triangles.as_flattened(), &mut is_used, |is_used, _| *is_used = true);
    is_used
}

/// `triangles` over the vertices of `mesh`, except for those that none of them uses. Panics if an index is
/// out of range.
pub(crate) fn without_unused_vertices(mesh: &TriMesh, mut triangles: Vec<[u32; 3]>) -> TriMesh {
    let (new, old) = renumber(&used_vertices(mesh.vertices.len(), &triangles));
    triangles.as_flattened_mut().iter_mut().for_each(|v| *v = new[*v as usize]);
    TriMesh { vertices: old.iter().map(|v| mesh.vertices[*v as usize]).collect(), triangles }
}

/// The triangles with these indices as a mesh of their own, vertices in their old order. The time depends on
/// how many there are, not on the size of the mesh, which may have thousands of components. Panics if an
/// index is out of range.
pub(crate) fn extract(mesh: &TriMesh, triangles: &[u32]) -> TriMesh {
    let of = |t: &u32| mesh.triangles[*t as usize];
    let mut used: Vec<u32> = triangles.iter().flat_map(of).collect();
    used.sort_unstable();
    used.dedup();
    // All vertices of the triangles are in it.
    let new = |v: u32| used.binary_search(&v).unwrap_or(0) as u32;
    TriMesh {
        vertices: used.iter().map(|v| mesh.vertices[*v as usize]).collect(),
        triangles: triangles.iter().map(|t| of(t).map(new)).collect(),
    }
}

/// Adds another mesh, whose vertices and triangles follow those of `mesh`.
pub(crate) fn append(mesh: &mut TriMesh, other: &TriMesh) {
    let offset = mesh.vertices.len() as u32;
    mesh.vertices.extend_from_slice(&other.vertices);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
}
