//! The restricted power face: the tangent plane clipped by the bisectors with all weighted points.

use super::face::Face;
use glam::{DVec2, DVec3};

/// The face of `sites[site]` in a square of half side `box_half`; `u` and `v` are the frame of its tangent
/// plane, and every site has a shadow site at `offset` along its normal.
pub fn power_face(
    (sites, normals): (&[DVec3], &[DVec3]),
    site: usize,
    (u, v): (DVec3, DVec3),
    offset: f64,
    box_half: f64,
) -> Face {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| DVec2::new(x, y) * box_half).to_vec();
    let mut face = Face { corners, behind: vec![None; 4] };
    for j in (0..sites.len()).filter(|j| *j != site) {
        let shadow = sites[j] + offset * normals[j];
        for (point, weight) in [(sites[j], 0.0), (shadow, shadow.distance_squared(sites[j]))] {
            // Points x of the plane with |x - site|² <= |x - point|² - weight.
            let d = point - sites[site];
            face.clip(DVec2::new(d.dot(u), d.dot(v)), 0.5 * (d.length_squared() - weight), Some(j as u32));
        }
    }
    face
}
