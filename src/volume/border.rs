//! Where a closed surface meets the volume's border; surfaces turned over.

use rayon::prelude::*;

use crate::TriMesh;
use crate::mesh::half_edges::{EdgeTable, HalfEdge};

/// The half-edges where faces along the volume's border meet the others, or those along another side. Places
/// are in units of nodes.
pub(super) fn rim(mesh: &TriMesh, size: [usize; 3]) -> Vec<u32> {
    let last = size.map(|length| length as f64 - 1.0);
    // The cells outside are those of the border; 1 to 6 are its sides.
    let side = |triangle: &[u32; 3]| {
        let corners = triangle.map(|v| mesh.vertices[v as usize]);
        let is_on = |side: &u8| {
            let axis = usize::from(side / 2);
            corners
                .iter()
                .all(|p| if side.is_multiple_of(2) { p[axis] <= 0.0 } else { p[axis] >= last[axis] })
        };
        (0..6_u8).find(is_on)
    };
    let sides: Vec<Option<u8>> = mesh.triangles.par_iter().map(side).collect();
    let edges = EdgeTable::new(&mesh.triangles);
    let meets = |edge: &[HalfEdge]| edge.iter().any(|h| sides[h.triangle()] != sides[edge[0].triangle()]);
    edges.edges().filter(|edge| meets(edge)).map(|edge| edge[0].corners().0 as u32).collect()
}

/// Turns all triangles over, and half-edges of them.
pub(super) fn turn(mesh: &mut TriMesh, half_edges: &mut [u32]) {
    mesh.triangles.par_iter_mut().for_each(|triangle| triangle.swap(1, 2));
    for half in half_edges {
        *half = *half - *half % 3 + (2 - *half % 3);
    }
}
