//! The boundary of a mesh: edges with one face.

use crate::TriMesh;
use crate::mesh::half_edges::EdgeTable;

/// An edge with one face, from `from` to `to` of its triangle.
pub(super) struct BoundaryEdge {
    pub triangle: usize,
    pub from: u32,
    pub to: u32,
    pub apex: u32,
}

/// The edges with one face, in the order of the table.
pub(super) fn boundary_edges(mesh: &TriMesh, table: &EdgeTable) -> Vec<BoundaryEdge> {
    let corners = mesh.triangles.as_flattened();
    let of = |sides: &[_]| match sides {
        [side] => Some(*side),
        _ => None,
    };
    let edge = |side: crate::mesh::half_edges::HalfEdge| {
        let (from, to) = side.corners();
        let [a, b, c] = mesh.triangles[side.triangle()];
        let apex = a ^ b ^ c ^ corners[from] ^ corners[to];
        BoundaryEdge { triangle: side.triangle(), from: corners[from], to: corners[to], apex }
    };
    table.edges().filter_map(of).map(edge).collect()
}

/// Their vertices, in ascending order.
pub(super) fn vertices_of(edges: &[BoundaryEdge]) -> Vec<u32> {
    let mut vertices: Vec<u32> = edges.iter().flat_map(|edge| [edge.from, edge.to]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}
