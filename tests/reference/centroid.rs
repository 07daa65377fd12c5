//! Two middles of a polygon.

use glam::DVec2;

/// The mean of the corners but those closer to the one before than a fifth of the farthest corner's distance.
pub fn vertex_mean(corners: &[DVec2]) -> DVec2 {
    let radius = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
    let before = |m: usize| corners[(m + corners.len() - 1) % corners.len()];
    let apart = |(m, c): &(usize, &DVec2)| c.distance(before(*m)) > 0.2 * radius;
    let counted: Vec<DVec2> = corners.iter().enumerate().filter(apart).map(|(_, c)| *c).collect();
    counted.iter().sum::<DVec2>() / counted.len() as f64
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
