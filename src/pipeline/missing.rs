//! Parts of the surface that a result leaves out.

use crate::mesh::bvh::Bvh;
use crate::mesh::sizing::SizeField;
use crate::{ProgressToken, Result, TriMesh};
use rayon::prelude::*;

/// A vertex of the surface farther from the result than this many edge lengths is missing there.
pub(crate) const MISSING: f64 = 1.5;
/// Vertices that one thread takes in a row, each starting its search where the last one ended.
const CHUNK: usize = 1024;

/// The vertices of `surface` that are far from `result`, which has edges of about `spacing` times their size,
/// the farthest first.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn missing_vertices(
    surface: &TriMesh,
    result: &TriMesh,
    (spacing, sizes): (f64, &SizeField),
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    progress.poll()?;
    let bvh = Bvh::new(result);
    let far = |(chunk, points): (usize, &[glam::DVec3])| {
        let mut rank = 0;
        let mut far = Vec::new();
        for (v, point) in (chunk * CHUNK..).zip(points) {
            let most = (MISSING * spacing * sizes.at_vertex(v as u32)).powi(2);
            let nearest = bvh.closest_or_near(*point, &mut rank, most);
            if let Some(nearest) = nearest.filter(|nearest| nearest.distance_sq > most) {
                far.push((nearest.distance_sq / most, v as u32));
            }
        }
        far
    };
    let mut far: Vec<(f64, u32)> =
        surface.vertices.par_chunks(CHUNK).enumerate().flat_map_iter(far).collect();
    progress.poll()?;
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    Ok(far.into_iter().map(|(_, v)| v).collect())
}
