//! Parts of a mesh as meshes of their own, and meshes put together.

use super::TriMesh;

/// The mesh of some triangles, with the vertices that they use, in the mesh's order.
pub(crate) fn extract(mesh: &TriMesh, triangles: &[u32]) -> TriMesh {
    let of = |t: &u32| mesh.triangles[*t as usize];
    let mut used: Vec<u32> = triangles.iter().flat_map(of).collect();
    used.sort_unstable();
    used.dedup();
    // `used` has all vertices of the triangles.
    let new_index = |v: u32| used.binary_search(&v).unwrap_or(0) as u32;
    TriMesh {
        vertices: used.iter().map(|v| mesh.vertices[*v as usize]).collect(),
        triangles: triangles.iter().map(|t| of(t).map(new_index)).collect(),
    }
}

/// Adds the vertices and triangles of another mesh.
pub(crate) fn append(mesh: &mut TriMesh, other: &TriMesh) {
    let offset = mesh.vertices.len() as u32;
    mesh.vertices.extend_from_slice(&other.vertices);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
}
