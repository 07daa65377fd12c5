//! Parts of the surface that a result leaves out.

use std::sync::OnceLock;

use crate::mesh::bvh::Bvh;
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::sizing::SizeField;
use crate::{ProgressToken, Result, TriMesh};
use rayon::prelude::*;

/// A vertex of the surface farther from the result than this many edge lengths is missing there.
pub(crate) const MISSING: f64 = 1.5;

/// The vertices of `surface` that are farther than [`MISSING`] edges from `result`, which has edges of about
/// `spacing` times their size, the farthest first.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn missing_vertices(
    surface: &TriMesh,
    result: &TriMesh,
    edges: (f64, &SizeField),
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    far_vertices(surface, result, MISSING, edges, progress)
}

/// The vertices of `surface` that are farther than `most` edges from `result`, likewise.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn far_vertices(
    surface: &TriMesh,
    result: &TriMesh,
    most: f64,
    (spacing, sizes): (f64, &SizeField),
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    progress.poll()?;
    // Nearly always there is a vertex near, and no triangle need be looked for.
    let mut grid = HashGrid::new(most * spacing, result.vertices.len());
    (0..).zip(&result.vertices).for_each(|(v, at): (u32, _)| grid.insert(*at, v));
    let bvh = OnceLock::new();
    let far = |v: u32| {
        let point = surface.vertices[v as usize];
        let most_sq = (most * spacing * sizes.at_vertex(v)).powi(2);
        let is_near = |w: u32| result.vertices[w as usize].distance_squared(point) <= most_sq;
        if grid.any(point, is_near) {
            return None;
        }
        let distance_sq = bvh.get_or_init(|| Bvh::new(result)).closest(point)?.distance_sq;
        (distance_sq > most_sq).then_some((distance_sq / most_sq, v))
    };
    let vertices = (0..surface.vertices.len() as u32).into_par_iter();
    let mut far: Vec<(f64, u32)> = vertices.filter_map(far).collect();
    progress.poll()?;
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    Ok(far.into_iter().map(|(_, v)| v).collect())
}
