//! Coarsens meshes with more faces than a page can hold, for drawing only.

use crate::mesh::spacing;
use crate::mesh::triangle::area;
use glam::DVec3;
use std::collections::HashMap;

/// A coarsened mesh.
pub(super) struct Coarsened {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The face of the mesh that each triangle was.
    pub faces: Vec<u32>,
}

/// Cells are enlarged by this factor until few enough faces are left.
const GROWTH: f64 = 1.2;

/// At most `most` of the triangles, by making one of all points in a cell of a grid. The points lie between 0
/// and 1.
pub(super) fn coarsen(points: &[DVec3], triangles: &[[u32; 3]], most: usize) -> Coarsened {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let total_area: f64 = triangles.iter().map(area).sum();
    // Half as many vertices as faces; cells below a ten thousandth are too fine to be seen.
    let mut cell = spacing(total_area, most.max(2) / 2).max(1e-4);
    loop {
        let coarsened = cluster_vertices(points, triangles, cell);
        if coarsened.triangles.len() <= most {
            return coarsened;
        }
        cell *= GROWTH;
    }
}

fn cluster_vertices(points: &[DVec3], triangles: &[[u32; 3]], cell: f64) -> Coarsened {
    let mut first_in = HashMap::new();
    let mut cell_points = Vec::new();
    let new_indices: Vec<u32> = points
        .iter()
        .map(|p| {
            *first_in.entry((*p / cell).floor().as_i64vec3()).or_insert_with(|| {
                cell_points.push(*p);
                cell_points.len() as u32 - 1
            })
        })
        .collect();
    let (triangles, faces) = triangles
        .iter()
        .zip(0..)
        .map(|(t, face)| (t.map(|v| new_indices[v as usize]), face))
        .filter(|([a, b, c], _)| a != b && b != c && c != a)
        .unzip();
    Coarsened { points: cell_points, triangles, faces }
}
