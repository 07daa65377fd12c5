//! Triangles with small angles, and why they may be hard to avoid.

use super::feature_distance::sharp_edges;
use super::half_edges::edge_key;
use super::quality::{TriangleQuality, angle_below};
use crate::TriMesh;
use rayon::prelude::*;
use std::collections::HashSet;

/// Triangles with an angle below a limit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SmallAngles {
    /// All triangles with a smaller angle.
    pub faces: usize,
    /// Triangles where two sharp or boundary edges meet at that angle.
    pub at_corners: usize,
    /// Other triangles with all vertices on such edges, as where these come close to each other.
    pub between_curves: usize,
}

/// Where a triangle with a small angle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SmallAnglePlace {
    /// Two sharp or boundary edges meet at that angle.
    Corner,
    /// All vertices are on such edges.
    BetweenCurves,
    Elsewhere,
}

/// The triangles of a mesh with an angle below `limit`. Edges are sharp where the surface turns by at least
/// `feature_angle`. Both are in degrees. Panics if an index is out of range.
pub fn small_angles(mesh: &TriMesh, limit: f64, feature_angle: f64) -> SmallAngles {
    let places = small_angle_places(mesh, limit, feature_angle);
    let count = |place| places.iter().filter(|(_, other)| *other == place).count();
    SmallAngles {
        faces: places.len(),
        at_corners: count(SmallAnglePlace::Corner),
        between_curves: count(SmallAnglePlace::BetweenCurves),
    }
}

/// The triangles that [`small_angles`] counts.
pub(crate) fn small_angle_places(
    mesh: &TriMesh,
    limit: f64,
    feature_angle: f64,
) -> Vec<(usize, SmallAnglePlace)> {
    let is_small = |t: &usize| angle_below(mesh.corners(*t), limit).is_some();
    let small: Vec<usize> = (0..mesh.triangles.len()).into_par_iter().filter(is_small).collect();
    if small.is_empty() {
        return Vec::new();
    }
    let sharp: HashSet<(u32, u32)> = sharp_edges(mesh, feature_angle).into_iter().collect();
    let on_sharp: HashSet<u32> = sharp.iter().flat_map(|(a, b)| [*a, *b]).collect();
    let place = |t: usize| {
        let triangle = mesh.triangles[t];
        let angles = TriangleQuality::new(mesh.corners(t)).angles;
        let k = (0..3).min_by(|a, b| angles[*a].total_cmp(&angles[*b])).unwrap_or(0);
        let [a, b, c] = [k, k + 1, k + 2].map(|k| triangle[k % 3]);
        if sharp.contains(&edge_key(a, b)) && sharp.contains(&edge_key(a, c)) {
            (t, SmallAnglePlace::Corner)
        } else if triangle.iter().all(|v| on_sharp.contains(v)) {
            (t, SmallAnglePlace::BetweenCurves)
        } else {
            (t, SmallAnglePlace::Elsewhere)
        }
    };
    small.into_iter().map(place).collect()
}
