//! Algorithm 3 of the paper for one point: the nearest of its projections onto given triangles.

use glam::DVec3;

/// Projects `at` onto the triangle: inside (case a), else the nearest foot on an edge (case b), else
/// `vertex`.
pub fn onto_triangle(at: DVec3, triangle: [DVec3; 3], vertex: DVec3) -> DVec3 {
    let [a, b, c] = triangle;
    let n = (b - a).cross(c - a);
    if n.length_squared() > 0.0 {
        let n = n.normalize();
        let foot = at - n * (at - a).dot(n);
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(foot - *p).dot(n) >= 0.0);
        if inside {
            return foot;
        }
    }
    let feet = [(a, b), (b, c), (c, a)].into_iter().filter_map(|(p, q)| {
        let e = q - p;
        let t = (at - p).dot(e) / e.length_squared();
        (0.0..=1.0).contains(&t).then(|| p + e * t)
    });
    feet.min_by(|x, y| x.distance(at).total_cmp(&y.distance(at))).unwrap_or(vertex)
}

/// The distance of `at` to its projection onto all triangles around the vertices in `near`.
pub fn distance(at: DVec3, near: &[u32], vertices: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let around = |p: u32| triangles.iter().filter(move |t| t.contains(&p));
    near.iter()
        .flat_map(|p| {
            around(*p).map(|t| onto_triangle(at, t.map(|v| vertices[v as usize]), vertices[*p as usize]))
        })
        .map(|x| x.distance(at))
        .fold(f64::INFINITY, f64::min)
}
