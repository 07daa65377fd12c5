//! The one-sided Hausdorff distance by plain halving and search through all triangles.

use glam::DVec3;
use rtfmesh::TriMesh;

use super::closest::onto_triangle;

/// The distance of `p` to the mesh.
pub fn distance(p: DVec3, to: &TriMesh) -> f64 {
    (0..to.triangles.len())
        .map(|t| {
            let corners = to.corners(t);
            let [a, b, c] = corners;
            // Triangles without an area have no inside, and may have no sides.
            let sides = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                let edge = to - from;
                let share = (p - from).dot(edge) / edge.length_squared();
                p.distance(from + edge * if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) })
            });
            let side = sides[0].min(sides[1]).min(sides[2]);
            let flat =
                (b - a).cross(c - a).length() <= 1e-9 * (b - a).length_squared().max(f64::MIN_POSITIVE);
            if flat { side } else { side.min(p.distance(onto_triangle(p, corners))) }
        })
        .fold(f64::INFINITY, f64::min)
}

/// Both ends of an interval that contains the largest distance of a point of `from` to `to`; they are apart
/// by at most `gap`. A triangle is at most as far away as its middle and its farthest corner from there.
pub fn hausdorff(from: &TriMesh, to: &TriMesh, gap: f64) -> [f64; 2] {
    let mut pieces: Vec<[DVec3; 3]> = (0..from.triangles.len()).map(|t| from.corners(t)).collect();
    let corners = pieces.iter().flatten().map(|p| distance(*p, to));
    let mut lower = corners.fold(0.0, f64::max);
    let mut upper = lower;
    while let Some([a, b, c]) = pieces.pop() {
        let middle = (a + b + c) / 3.0;
        let far = distance(middle, to);
        lower = lower.max(far);
        let bound = far + middle.distance(a).max(middle.distance(b)).max(middle.distance(c));
        if bound <= lower + gap {
            upper = upper.max(bound);
        } else {
            let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
            pieces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
    [lower, upper]
}
