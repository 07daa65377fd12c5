//! Centroids of a polygon: two means of its corners, and that of its area.

use glam::DVec2;

/// The mean of the corners.
pub fn corner_mean(corners: &[DVec2]) -> DVec2 {
    corners.iter().sum::<DVec2>() / corners.len() as f64
}

/// The weighted mean of the corners. One that is nearer to a neighbour than 0.3 of the farthest corner's
/// distance counts for as much less as it is nearer, half for each neighbour.
pub fn weighted_corner_mean(corners: &[DVec2]) -> DVec2 {
    let (n, radius) = (corners.len(), corners.iter().map(|c| c.length()).fold(0.0, f64::max));
    let share =
        |m: usize, other: usize| 0.5 * (corners[m].distance(corners[other]) / (0.3 * radius)).min(1.0);
    let weights: Vec<f64> = (0..n).map(|m| share(m, (m + 1) % n) + share(m, (m + n - 1) % n)).collect();
    let sum: DVec2 = corners.iter().zip(&weights).map(|(c, w)| *c * *w).sum();
    sum / weights.iter().sum::<f64>()
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
