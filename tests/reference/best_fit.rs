//! Projection onto the planes that best fit the nearest points.

use super::plane_fit::plane_fit;
use glam::DVec3;

/// Where a site is pulled to.
pub struct Projected {
    pub to: DVec3,
    /// The normal of its plane.
    pub normal: DVec3,
    /// Whether the plane fits its points, which face the same way as the nearest one.
    pub fits: bool,
}

/// A site at `at` pulled to the plane of its nearest `points`, the nearest first, which have these `outward`
/// normals, but no farther from the nearest one along the plane than `reach`. `None` where rounding decides.
pub fn best_fit(at: DVec3, points: &[DVec3], outward: &[DVec3], reach: f64) -> Option<Projected> {
    let side = outward[0];
    // A point that is seen from the edge is on the one sheet or the other.
    if outward.iter().any(|n| n.dot(side).abs() < 1e-5) {
        return None;
    }
    let facing = points.iter().zip(outward).filter(|(_, n)| n.dot(side) > 0.0);
    let points: Vec<DVec3> = facing.map(|(p, _)| *p).collect();
    let fit = plane_fit(&points);
    let [low, middle, high] = fit.eigenvalues;
    let agreement = fit.normal.dot(side).abs();
    if middle - low < 0.05 * high || (agreement - 0.8).abs() < 0.02 {
        return None;
    }
    let fits = agreement > 0.8;
    let mean = points.iter().sum::<DVec3>() / points.len() as f64;
    let (normal, from) = if fits { (fit.normal, mean) } else { (side, points[0]) };
    let normal = if normal.dot(side) < 0.0 { -normal } else { normal };
    let onto = |p: DVec3| p - normal * (p - from).dot(normal);
    let nearest = onto(points[0]);
    Some(Projected { to: nearest + (onto(at) - nearest).clamp_length_max(reach), normal, fits })
}
