//! Two middles of a polygon.

use glam::DVec2;

/// The mean of the corners.
pub fn vertex_mean(corners: &[DVec2]) -> DVec2 {
    corners.iter().sum::<DVec2>() / corners.len() as f64
}

/// The centroid of the area, by triangles from the first corner.
pub fn area_centroid(corners: &[DVec2]) -> DVec2 {
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for pair in corners[1..].windows(2) {
        let a = 0.5 * (pair[0] - corners[0]).perp_dot(pair[1] - corners[0]);
        area += a;
        moment += (corners[0] + pair[0] + pair[1]) / 3.0 * a;
    }
    moment / area
}
