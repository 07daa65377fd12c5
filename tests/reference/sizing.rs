//! The shift of targets towards shorter edges.

use super::pins::Mark;
use glam::{DMat2, DVec2, DVec3};

/// Neighbours that count.
pub const RING: usize = 6;

/// What `sizing/drift` reads of a site.
pub struct Site {
    pub at: DVec3,
    pub normal: DVec3,
    pub mark: Mark,
    pub length: f64,
}

/// The shift of a site's target: the gradient that fits the logarithms of the lengths of its nearest sites
/// `around` best, times what makes the centroid of the density 1 / length⁴ in a hexagon of it, no longer than
/// a quarter of the way to the neighbours; in the frame `u`, `v` of its tangent plane. `None` where it is
/// close whether the neighbours are in one line.
pub fn drift(own: &Site, around: &[&Site], (u, v): (DVec3, DVec3)) -> Option<DVec3> {
    let Site { at, normal, mark, length } = own;
    let (mut moments, mut sum, mut square, mut count) = (DMat2::ZERO, DVec2::ZERO, 0.0, 0.0);
    for other in around.iter().take(RING) {
        let same = other.mark == *mark || other.mark.is_pinned();
        if !same || !(other.mark.counts_anywhere() || normal.dot(other.normal) > 0.0) {
            continue;
        }
        let d = other.at - *at;
        let flat = DVec2::new(d.dot(u), d.dot(v));
        let weight = 1.0 / d.length_squared();
        moments += weight * DMat2::from_cols(flat * flat.x, flat * flat.y);
        sum += weight * (other.length / length).ln() * flat;
        square += d.length_squared();
        count += 1.0;
    }
    if count == 0.0 {
        return Some(DVec3::ZERO);
    }
    if (moments.determinant() - 0.02 * count * count).abs() < 1e-4 * count * count {
        return None;
    }
    if moments.determinant() < 0.02 * count * count {
        return Some(DVec3::ZERO);
    }
    let mean_sq = square / count;
    // The second moment of a unit hexagon over the square of twice its inner radius is 5 / 72, and the
    // density falls by four times what the length grows.
    let shift = -4.0 * 5.0 / 72.0 * mean_sq * (moments.inverse() * sum);
    let shift = shift.clamp_length_max(0.25 * mean_sq.sqrt());
    Some(shift.x * u + shift.y * v)
}
