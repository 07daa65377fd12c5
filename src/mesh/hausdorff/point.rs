//! The distance of a point, from below.

use glam::DVec3;

use crate::mesh::bvh::{Aabb, Bvh};
use crate::mesh::triangle::{closest_on_triangle, doubled_normal};

/// Shares of a distance that are not worth another try.
const NEGLIGIBLE: f64 = 1e-12;

/// A lower bound of the distance of `p` to the triangles, tight but for slivers; wrong by no more than the
/// rounding of a few additions of coordinates.
pub(super) fn distance_at_least(to: &Bvh, p: DVec3) -> f64 {
    let Some(closest) = to.closest(p) else { return 0.0 };
    let mut least = closest.distance_sq.sqrt();
    // Triangles that stay outside are farther.
    let around = Aabb { min: p - least, max: p + least };
    to.overlapping_corners(&around, |corners| {
        least = least.min(triangle_at_least(p, corners));
    });
    least
}

/// The largest distance of `p` to a plane between it and the triangle, among planes across directions that
/// may be that of the closest point: right however those are rounded.
fn triangle_at_least(p: DVec3, corners: [DVec3; 3]) -> f64 {
    let from = corners.map(|corner| p - corner);
    let along = |direction: DVec3| {
        let direction = direction.normalize_or_zero();
        from.map(|v| v.dot(direction)).into_iter().fold(f64::INFINITY, f64::min)
    };
    let offset = p - closest_on_triangle(p, corners).point;
    let mut best = along(offset).max(0.0);
    if best >= (1.0 - NEGLIGIBLE) * offset.length() {
        return best;
    }
    let normal = doubled_normal(corners);
    let mut directions = vec![normal, -normal];
    for k in 0..3 {
        let edge = (corners[(k + 1) % 3] - corners[k]).normalize_or_zero();
        directions.extend([from[k], from[k] - edge * from[k].dot(edge)]);
    }
    for direction in directions {
        best = best.max(along(direction));
    }
    best
}
