//! The restricted tangent face: the tangent plane inside a cube, clipped by every bisector.

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
            let t = if e.length_squared() > 0.0 {
                ((p - a).dot(e) / e.length_squared()).clamp(0.0, 1.0)
            } else {
                0.0
            };
            nearest = nearest.min(p.distance(a + e * t));
        }
        if inside { 0.0 } else { nearest }
    }
}

/// The face of `sites[site]` inside the cube of half edge `box_half` around it; `u` and `v` are the frame of
/// its tangent plane.
pub fn face(sites: &[DVec3], site: usize, u: DVec3, v: DVec3, box_half: f64) -> Face {
    let at = sites[site];
    let far = 10.0;
    let corners =
        [(-1, -1), (1, -1), (1, 1), (-1, 1)].map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)) * far);
    let mut face = Face { corners: corners.to_vec(), behind: vec![None; 4] };
    for axis in DVec3::AXES {
        for way in [axis, -axis] {
            face.clip(DVec2::new(way.dot(u), way.dot(v)), box_half, None);
        }
    }
    for (j, other) in sites.iter().enumerate().filter(|(j, _)| *j != site) {
        // Points x of the plane nearer to `at` than to `other`: d · x <= |other - at|² / 2.
        let d = *other - at;
        face.clip(DVec2::new(d.dot(u), d.dot(v)), 0.5 * d.length_squared(), Some(j as u32));
    }
    face
}

/// Like [`face`], of a power diagram: a site with edge length h, relative to `spacing`, weighs `share` times
/// the square of h. A bisector is at least a twentieth of the distance between its sites away from either.
pub fn weighted_face(
    (sites, lengths): (&[DVec3], &[f64]),
    site: usize,
    (u, v): (DVec3, DVec3),
    (share, spacing, box_half): (f64, f64, f64),
) -> Face {
    let at = sites[site];
    let mut face = face(&[at], 0, u, v, box_half * spacing * lengths[site]);
    let weight = |j: usize| share * (spacing * lengths[j]).powi(2);
    for j in (0..sites.len()).filter(|j| *j != site) {
        let d = sites[j] - at;
        let middle = 0.5 * (d.length_squared() + weight(site) - weight(j)) / d.length_squared();
        let limit = middle.clamp(0.05, 0.95) * d.length_squared();
        face.clip(DVec2::new(d.dot(u), d.dot(v)), limit, Some(j as u32));
    }
    face
}

impl Face {
    /// Keeps the part where `d · x <= limit`; the new edge has `label` behind it.
    pub fn clip(&mut self, d: DVec2, limit: f64, label: Option<u32>) {
        let side = |p: DVec2| d.dot(p) - limit;
        if self.corners.iter().all(|p| side(*p) <= 0.0) {
            return;
        }
        let n = self.corners.len();
        let (mut kept, mut labels) = (Vec::new(), Vec::new());
        for m in 0..n {
            let (a, b) = (self.corners[(m + n - 1) % n], self.corners[m]);
            let (sa, sb) = (side(a), side(b));
            let crossing = a + (b - a) * (sa / (sa - sb));
            match (sa <= 0.0, sb <= 0.0) {
                (true, true) => {
                    kept.push(b);
                    labels.push(self.behind[m]);
                }
                (true, false) => {
                    kept.push(crossing);
                    labels.push(self.behind[m]);
                }
                (false, true) => {
                    kept.extend([crossing, b]);
                    labels.extend([label, self.behind[m]]);
                }
                (false, false) => {}
            }
        }
        (self.corners, self.behind) = (kept, labels);
    }
}
