//! How tests of the face kernels compare polygons.

use crate::reference::face::Face;
use glam::{DVec2, DVec3};
use rtfmesh::mesh::NONE;

/// The frame of `glsl/common/tangent.glsl` for the f32 normal.
pub fn frame(n: DVec3) -> (DVec3, DVec3) {
    let s = if n.z < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = (-1.0 / (s + n.z), -n.x * n.y / (s + n.z));
    (DVec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), DVec3::new(b, s + n.y * n.y * a, -n.y))
}

/// Both polygons hold the same points, up to 1e-5 of their size, and long edges have the same site behind
/// them.
pub fn assert_same_polygon(site: usize, corners: &[DVec2], fan: &[u32], want: &Face) {
    let got = Face { corners: corners.to_vec(), behind: fan.iter().map(|j| Some(*j)).collect() };
    let tolerance = 1e-5 * want.radius();
    for c in corners {
        assert!(want.outside(*c) <= tolerance, "site {site}: corner {c} is {} outside", want.outside(*c));
    }
    for c in &want.corners {
        assert!(got.outside(*c) <= tolerance, "site {site}: corner {c} is missing by {}", got.outside(*c));
    }
    let n = want.corners.len();
    for m in 0..n {
        let long = want.corners[m].distance(want.corners[(m + n - 1) % n]) > 1e-3 * want.radius();
        let id = want.behind[m].unwrap_or(NONE);
        assert!(!long || fan.contains(&id), "site {site}: no edge towards {id} in {fan:?}");
    }
}

/// Area of a polygon whose corners are counter-clockwise.
pub fn area(corners: &[DVec2]) -> f64 {
    0.5 * (0..corners.len()).map(|m| corners[m].perp_dot(corners[(m + 1) % corners.len()])).sum::<f64>()
}
