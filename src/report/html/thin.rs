//! Meshes with more faces than a page can hold, made coarse for drawing only.

use crate::mesh::spacing;
use crate::mesh::triangle::area;
use glam::DVec3;
use std::collections::HashMap;

/// What is left of a mesh.
pub(super) struct Thinned {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The face of the mesh that each triangle was.
    pub faces: Vec<u32>,
}

/// Cells are enlarged by this factor until few enough faces are left.
const GROWTH: f64 = 1.2;

/// At most `most` of the triangles, by making one of all points in a cell of a grid. The points lie between 0 and 1.
pub(super) fn thin(points: &[DVec3], triangles: &[[u32; 3]], most: usize) -> Thinned {
    let whole: f64 = triangles.iter().map(|t| area(t.map(|v| points[v as usize]))).sum();
    // Half as many vertices as faces; cells below a ten thousandth are finer than anybody sees.
    let mut cell = spacing(whole, most.max(2) / 2).max(1e-4);
    loop {
        let thinned = clustered(points, triangles, cell);
        if thinned.triangles.len() <= most {
            return thinned;
        }
        cell *= GROWTH;
    }
}

fn clustered(points: &[DVec3], triangles: &[[u32; 3]], cell: f64) -> Thinned {
    let mut first_in = HashMap::new();
    let mut kept = Vec::new();
    let renamed: Vec<u32> = points
        .iter()
        .map(|p| {
            *first_in.entry((*p / cell).floor().as_i64vec3()).or_insert_with(|| {
                kept.push(*p);
                kept.len() as u32 - 1
            })
        })
        .collect();
    let (triangles, faces) = triangles
        .iter()
        .zip(0..)
        .map(|(t, face)| (t.map(|v| renamed[v as usize]), face))
        .filter(|([a, b, c], _)| a != b && b != c && c != a)
        .unzip();
    Thinned { points: kept, triangles, faces }
}
