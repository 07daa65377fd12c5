//! Points without faces on the page: a face around each, of which the view draws a disc.

use crate::cloud::{PointCloud, survey};
use crate::mesh::bvh::Bvh;
use crate::{ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

/// Maximum number of points on a page; they take as much as half of [`super::MOST_FACES`] faces.
pub(super) const MOST_POINTS: usize = 100_000;
/// The diameter of discs, in spacings, as in the pictures of `render`.
const WIDTH: f64 = 2.0;

/// An equilateral triangle around each point, or around evenly chosen ones of many, that faces as the surface
/// through the points does there. The disc inside it is as wide as two spacings of the chosen points.
///
/// # Errors
/// Those of [`survey`].
pub(super) fn faces_around(points: &[DVec3], surface: &TriMesh) -> Result<TriMesh> {
    let step = points.len().div_ceil(MOST_POINTS);
    let chosen: Vec<DVec3> = points.iter().step_by(step).copied().collect();
    let cloud = PointCloud { points: chosen, ..PointCloud::default() };
    let radius = 0.5 * WIDTH * survey(&cloud, &ProgressToken::default())?.spacing;
    let hierarchy = Bvh::new(surface);
    let around = |p: &DVec3| {
        let nearest = hierarchy.closest(*p).map(|found| surface.doubled_normal(found.triangle as usize));
        let normal = nearest.and_then(DVec3::try_normalize).unwrap_or(DVec3::Z);
        let (along, across) = normal.any_orthonormal_pair();
        // The corners of a triangle are twice as far from its centre as its sides.
        [0.0, 1.0, 2.0].map(|k| {
            let (sin, cos) = (std::f64::consts::TAU / 3.0 * k).sin_cos();
            *p + 2.0 * radius * (cos * along + sin * across)
        })
    };
    let vertices: Vec<[DVec3; 3]> = cloud.points.par_iter().map(around).collect();
    let triangles = (0..vertices.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    Ok(TriMesh { vertices: vertices.concat(), triangles })
}
