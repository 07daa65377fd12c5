//! Components: triangles connected by shared vertices.

use super::counts::RepairCounts;
use crate::TriMesh;
use crate::mesh::submesh::without_unused_vertices;
use crate::mesh::topology::Partition;

/// The component of each triangle, in the order of their first triangles, and the area of each component.
pub(crate) fn connected_components(mesh: &TriMesh) -> (Vec<u32>, Vec<f64>) {
    let mut sets = Partition::new(mesh.vertices.len());
    for [a, b, c] in &mesh.triangles {
        sets.join(*a, *b);
        sets.join(*a, *c);
    }
    let mut number = vec![u32::MAX; mesh.vertices.len()];
    let mut areas: Vec<f64> = Vec::new();
    let mut of_triangle = Vec::with_capacity(mesh.triangles.len());
    for t in 0..mesh.triangles.len() {
        let part = &mut number[sets.root(mesh.triangles[t][0]) as usize];
        if *part == u32::MAX {
            *part = areas.len() as u32;
            areas.push(0.0);
        }
        areas[*part as usize] += mesh.triangle_area(t);
        of_triangle.push(*part);
    }
    (of_triangle, areas)
}

/// Keeps some triangles, with their origin, in their old order; returns their old numbers.
pub(super) fn keep_triangles(
    mesh: &mut TriMesh,
    origin: &mut Vec<u32>,
    stays: impl Fn(usize) -> bool,
) -> Vec<usize> {
    let kept: Vec<usize> = (0..mesh.triangles.len()).filter(|t| stays(*t)).collect();
    *mesh = without_unused_vertices(mesh, kept.iter().map(|t| mesh.triangles[*t]).collect());
    *origin = kept.iter().map(|t| origin[*t]).collect();
    kept
}

/// Drops components with less than this share of the area, but never the largest.
pub(super) fn drop_small(mesh: &mut TriMesh, origin: &mut Vec<u32>, share: f64, counts: &mut RepairCounts) {
    let (of_triangle, areas) = connected_components(mesh);
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let least = (share * areas.iter().sum::<f64>()).min(largest);
    counts.components_removed = areas.iter().filter(|area| **area < least).count();
    if counts.components_removed > 0 {
        keep_triangles(mesh, origin, |t| areas[of_triangle[t] as usize] >= least);
    }
}
