//! Triangles by their corners: doubled normal, area, closest point.

use glam::DVec3;

/// Squared ratio of area to edge length below which the usual region test loses too many digits: a height of
/// 1e-5 of the longest edge leaves about six good digits of the barycentric coordinates.
const SLIVER_SQ: f64 = 1e-10;

/// A point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrianglePoint {
    /// Its position.
    pub point: DVec3,
    /// Its weights for the three corners, each 0..=1, summing to 1.
    pub barycentric: [f64; 3],
}

/// The corners of a triangle, whose vertices are `at` these places. Where this is done most, it takes less
/// time than `map`, which compilers do not always inline.
#[inline]
pub(crate) fn corners_at([a, b, c]: [u32; 3], at: impl Fn(u32) -> DVec3) -> [DVec3; 3] {
    [at(a), at(b), at(c)]
}

/// The normal of a triangle, twice as long as its area; zero without area.
#[inline]
pub fn doubled_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The angle at the first corner, in radians from 0 to pi; 0 for a triangle of three equal points.
pub(crate) fn angle_at_first([a, b, c]: [DVec3; 3]) -> f64 {
    doubled_normal([a, b, c]).length().atan2((b - a).dot(c - a))
}

/// The area of a triangle, in the unit of its coordinates squared.
#[inline]
pub fn area(corners: [DVec3; 3]) -> f64 {
    0.5 * doubled_normal(corners).length()
}

/// The square of a triangle's shortest height.
pub(super) fn shortest_height_sq([a, b, c]: [DVec3; 3]) -> f64 {
    let longest_sq = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    doubled_normal([a, b, c]).length_squared() / longest_sq.max(f64::MIN_POSITIVE)
}

/// The point of triangle `corners` closest to `p`; right for triangles without area as well.
///
/// Region test: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
#[inline]
pub fn closest_on_triangle(p: DVec3, corners: [DVec3; 3]) -> TrianglePoint {
    if is_sliver(corners) { closest_on_sliver(p, corners) } else { closest_on_regular(p, corners) }
}

/// Whether a triangle is so thin that [`closest_on_regular`] would be wrong.
#[inline]
pub(super) fn is_sliver([a, b, c]: [DVec3; 3]) -> bool {
    let (ab, ac) = (b - a, c - a);
    let longest_sq = ab.length_squared().max(ac.length_squared()).max((c - b).length_squared());
    ab.cross(ac).length_squared() <= SLIVER_SQ * longest_sq * longest_sq
}

/// The point closest to `p` of a triangle that is not a sliver.
#[inline]
pub(super) fn closest_on_regular(p: DVec3, corners: [DVec3; 3]) -> TrianglePoint {
    let [a, b, c] = corners;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return at(corners, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return at(corners, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return at(corners, [1.0 - v, v, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return at(corners, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return at(corners, [1.0 - w, 0.0, w]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return at(corners, [0.0, 1.0 - w, w]);
    }
    let sum = va + vb + vc;
    at(corners, [va / sum, vb / sum, vc / sum])
}

/// Tries the three edges and the foot of the perpendicular. Whichever is nearest lies on the triangle, so
/// that a rounded foot can only cost what the triangle's height is worth.
pub(super) fn closest_on_sliver(p: DVec3, corners: [DVec3; 3]) -> TrianglePoint {
    let [a, b, c] = corners;
    let normal = doubled_normal(corners);
    let weight = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(normal) / normal.length_squared();
    let foot = [weight(b, c), weight(c, a), weight(a, b)];
    let mut best = on_edge(p, corners, 0);
    let inside = foot.iter().all(|w| (0.0..=1.0).contains(w));
    let others = [
        Some(on_edge(p, corners, 1)),
        Some(on_edge(p, corners, 2)),
        inside.then(|| at(corners, foot.map(|w| w / (foot[0] + foot[1] + foot[2])))),
    ];
    for candidate in others.into_iter().flatten() {
        if candidate.point.distance_squared(p) < best.point.distance_squared(p) {
            best = candidate;
        }
    }
    best
}

/// The closest point of the edge from corner `k` to the next.
fn on_edge(p: DVec3, corners: [DVec3; 3], k: usize) -> TrianglePoint {
    let next = (k + 1) % 3;
    let edge = corners[next] - corners[k];
    let length_sq = edge.length_squared();
    let t = if length_sq > 0.0 { (edge.dot(p - corners[k]) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    let mut weights = [0.0; 3];
    weights[k] = 1.0 - t;
    weights[next] = t;
    at(corners, weights)
}

#[inline]
fn at(corners: [DVec3; 3], barycentric: [f64; 3]) -> TrianglePoint {
    let [a, b, c] = corners;
    let [_, v, w] = barycentric;
    // From one corner rather than as a weighted sum, so that far from the origin the point stays on the
    // triangle.
    TrianglePoint { point: a + (b - a) * v + (c - a) * w, barycentric }
}
