//! Closest points on a surface and its normals there, by visiting every triangle.

use glam::DVec3;

/// The closest point of one triangle: the foot of the perpendicular if it is inside, else the closest point
/// of a side.
pub fn onto_triangle(at: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let sides = [(a, b), (b, c), (c, a)];
    let n = (b - a).cross(c - a).normalize_or_zero();
    let foot = at - n * (at - a).dot(n);
    if n != DVec3::ZERO && sides.iter().all(|(p, q)| (*q - *p).cross(foot - *p).dot(n) >= 0.0) {
        return foot;
    }
    let on_side = |(p, q): (DVec3, DVec3)| {
        let e = q - p;
        p + e * ((at - p).dot(e) / e.length_squared()).clamp(0.0, 1.0)
    };
    sides.map(on_side).into_iter().min_by(|x, y| x.distance(at).total_cmp(&y.distance(at))).unwrap()
}

/// The distance to the closest of the triangles whose normal has at least the cosine `least` with `side`;
/// infinite if there are none.
pub fn distance_facing(at: DVec3, corners: &[[DVec3; 3]], normals: &[DVec3], side: DVec3, least: f64) -> f64 {
    let facing = corners.iter().zip(normals).filter(|(_, n)| n.dot(side) >= least);
    facing.map(|(t, _)| onto_triangle(at, *t).distance(at)).fold(f64::INFINITY, f64::min)
}

/// The normal of the surface at a point of triangle `t`: the corners' normals weighted by the areas opposite
/// to them, those of the corners weighted by angle. A corner that points 84 degrees or more off the
/// triangle's own normal counts with that instead.
pub fn normal_at(point: DVec3, t: usize, corners: &[[DVec3; 3]]) -> DVec3 {
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize();
    let at_corner = |p: DVec3| {
        let around = corners.iter().filter_map(|t| Some((t, t.iter().position(|q| *q == p)?)));
        let sum: DVec3 =
            around.map(|(t, k)| normal(*t) * (t[(k + 1) % 3] - p).angle_between(t[(k + 2) % 3] - p)).sum();
        let own = normal(corners[t]);
        let mean = sum.normalize_or_zero();
        if mean.dot(own) > 0.1 { mean } else { own }
    };
    let [a, b, c] = corners[t];
    let area = |p: DVec3, q: DVec3| (p - point).cross(q - point).length();
    (at_corner(a) * area(b, c) + at_corner(b) * area(c, a) + at_corner(c) * area(a, b)).normalize()
}
