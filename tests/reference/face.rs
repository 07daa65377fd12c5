//! The restricted tangent face as what is left of a large square in the tangent plane after every bisector.

use glam::{DVec2, DVec3};

/// A convex polygon, counter-clockwise; `behind[m]` is the site behind the edge that ends in `corners[m]`.
pub struct Face {
    pub corners: Vec<DVec2>,
    pub behind: Vec<Option<u32>>,
}

impl Face {
    /// Distance of the farthest corner from the site.
    pub fn radius(&self) -> f64 {
        self.corners.iter().map(|c| c.length()).fold(0.0, f64::max)
    }

    /// How far `p` is outside the polygon; 0 inside.
    pub fn outside(&self, p: DVec2) -> f64 {
        let n = self.corners.len();
        let mut inside = true;
        let mut nearest = f64::INFINITY;
        for m in 0..n {
            let (a, b) = (self.corners[(m + n - 1) % n], self.corners[m]);
            let e = b - a;
            inside &= e.perp_dot(p - a) >= 0.0;
            let t = if e.length_squared() > 0.0 { ((p - a).dot(e) / e.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
            nearest = nearest.min(p.distance(a + e * t));
        }
        if inside { 0.0 } else { nearest }
    }
}

/// The face of `sites[site]` with unit normal `n` and the frame `u`, `v` of its tangent plane.
pub fn face(sites: &[DVec3], site: usize, u: DVec3, v: DVec3) -> Face {
    let at = sites[site];
    let far = 4.0;
    let mut corners: Vec<DVec2> = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        .map(|(x, y)| DVec2::new(far * f64::from(x), far * f64::from(y)))
        .to_vec();
    let mut behind = vec![None; 4];
    for (j, other) in sites.iter().enumerate().filter(|(j, _)| *j != site) {
        // Points x of the plane nearer to `at` than to `other`: d · x <= |other - at|² / 2.
        let d3 = *other - at;
        let (d, limit) = (DVec2::new(d3.dot(u), d3.dot(v)), 0.5 * d3.length_squared());
        let side = |p: DVec2| d.dot(p) - limit;
        let n = corners.len();
        let (mut kept, mut labels) = (Vec::new(), Vec::new());
        for m in 0..n {
            let (a, b) = (corners[(m + n - 1) % n], corners[m]);
            let (sa, sb) = (side(a), side(b));
            let crossing = a + (b - a) * (sa / (sa - sb));
            match (sa <= 0.0, sb <= 0.0) {
                (true, true) => {
                    kept.push(b);
                    labels.push(behind[m]);
                }
                (true, false) => {
                    kept.push(crossing);
                    labels.push(behind[m]);
                }
                (false, true) => {
                    kept.extend([crossing, b]);
                    labels.extend([Some(j as u32), behind[m]]);
                }
                (false, false) => {}
            }
        }
        (corners, behind) = (kept, labels);
    }
    Face { corners, behind }
}
