//! Flips that judge how far edges are from the surface as well as angles.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::triangle::doubled_normal;
use crate::polish::Target;
use crate::polish::flip::{MIN_GAIN, angle_gain, has_no_wide_angle, is_allowed, keeps_shape};
use crate::polish::locked::Locked;

/// Weight of the squared distance of an edge's midpoint from the surface, over the mean squared length of the
/// edges around, against cotangents. An edge that cuts off a right angle between equilateral triangles is
/// 0.43 edges away.
const DISTANCE_WEIGHT: f64 = 20.0;
/// Minimum cosine between two triangles that are flat, before and after the flip, so that angles decide
/// alone.
const FLAT: f64 = 0.95;
/// Minimum cosine between the normal of a new triangle and that of the old pair.
const MIN_AGREEMENT: f64 = 0.1;

/// Flips edges where that is a gain, in a fixed order.
pub(super) fn flip_edges(half_edges: &mut HalfEdgeMesh, points: &[DVec3], locked: Locked, target: &Target) {
    let wanted: Vec<u32> = (0..half_edges.half_edge_count())
        .into_par_iter()
        .with_min_len(1024)
        .filter(|&h| pays(half_edges, points, locked, target, h))
        .collect();
    for h in wanted {
        // An earlier flip may have changed the gain of this one.
        if pays(half_edges, points, locked, target, h)
            && let Some(twin) = half_edges.twin(h)
        {
            half_edges.flip(h, twin);
        }
    }
}

/// Whether the edge of `h` may and should be flipped; false for the second of its two half-edges.
fn pays(half_edges: &HalfEdgeMesh, points: &[DVec3], locked: Locked, target: &Target, h: u32) -> bool {
    let Some(twin) = half_edges.twin(h).filter(|&twin| h < twin) else { return false };
    if !is_allowed(half_edges, locked, [h, twin]) {
        return false;
    }
    let corners = half_edges.diamond(h, twin).map(|v| points[v as usize]);
    let gain = angle_gain(corners);
    let [a, b, c, d] = corners;
    let normals = [[a, b, c], [b, a, d], [d, c, a], [c, d, b]].map(doubled_normal);
    let cosine = |k: usize, l: usize| normals[k].normalize_or_zero().dot(normals[l].normalize_or_zero());
    if cosine(0, 1) > FLAT && cosine(2, 3) > FLAT {
        return gain > MIN_GAIN && keeps_shape(corners);
    }
    let up = (normals[0] + normals[1]).normalize_or_zero();
    let agrees = |normal: DVec3| normal.normalize_or_zero().dot(up) >= MIN_AGREEMENT;
    if !agrees(normals[2]) || !agrees(normals[3]) || !has_no_wide_angle(corners) {
        return false;
    }
    let (patch, mut rank) = (half_edges.patch(h / 3), 0);
    let mut off = |p: DVec3| target.closest(p, up, patch, &mut rank).map(|on| on.distance_squared(p));
    let [Some(old), Some(new)] = [a + b, c + d].map(|sum| off(0.5 * sum)) else { return false };
    let sides = [(a, c), (c, b), (b, d), (d, a)].map(|(p, q)| p.distance_squared(q));
    gain + DISTANCE_WEIGHT * (old - new) / (0.25 * sides.iter().sum::<f64>()) > MIN_GAIN
}
