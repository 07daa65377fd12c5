//! Edge flips: towards Delaunay triangles and six edges a vertex.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::mesh::triangle::doubled_normal;

/// Fewest edges of a vertex that may lose one.
const MIN_VALENCE: u32 = 4;
/// Least cosine between the normal of a new triangle and that of the old pair.
const MIN_AGREEMENT: f64 = 0.5;
/// Least cosine between the two new triangles, unless the old ones turned more sharply.
const MIN_DIHEDRAL: f64 = 0.8;
/// Cosine of the largest angle that a flip may make: about 127°.
const MIN_COSINE: f64 = -0.6;
/// What a flip must gain, so that rounding cannot turn an edge to and fro.
const MIN_GAIN: f64 = 1e-6;

/// What a flip is good for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    /// What one unit of valence energy (see [`valence_gain`]) is worth, in cotangents.
    pub(crate) valence_weight: f64,
}

/// Flips edges of `links` while that pays, in a fixed order and at most `sweeps` times over all; gives the
/// number.
pub(crate) fn flip_edges(
    links: &mut HalfEdgeMesh,
    points: &[DVec3],
    fixed: &[bool],
    rule: &Rule,
    sweeps: u32,
) -> usize {
    let mut total = 0;
    for _ in 0..sweeps {
        let wanted: Vec<u32> = (0..links.half_edges())
            .into_par_iter()
            .with_min_len(4096)
            .filter(|&h| pays(links, points, fixed, rule, h))
            .collect();
        let mut flipped = 0;
        for h in wanted {
            // An earlier flip may have changed what this one was worth.
            if pays(links, points, fixed, rule, h)
                && let Some(twin) = links.twin(h)
            {
                links.flip(h, twin);
                flipped += 1;
            }
        }
        total += flipped;
        if flipped == 0 {
            break;
        }
    }
    total
}

/// Whether the edge of `h` may be flipped and should be. False for one of its two half-edges.
fn pays(links: &HalfEdgeMesh, points: &[DVec3], fixed: &[bool], rule: &Rule, h: u32) -> bool {
    let Some(twin) = links.twin(h).filter(|&twin| h < twin) else { return false };
    let ring @ [a, b, c, d] = links.diamond(h, twin);
    let corners = ring.map(|v| points[v as usize]);
    let delaunay = angle_gain(corners);
    let valence = valence_gain(links, ring);
    // Neither gains anything: most edges end here.
    if delaunay + rule.valence_weight * valence <= MIN_GAIN {
        return false;
    }
    c != d
        && ring.iter().all(|&v| links.kind(v) != VertexKind::Irregular)
        && links.valence(a) >= MIN_VALENCE
        && links.valence(b) >= MIN_VALENCE
        && !(fixed[a as usize] && fixed[b as usize])
        && !links.joined(c, d)
        && links.patch(h / 3) == links.patch(twin / 3)
        && keeps_shape(corners)
}

/// The cotangent sum of the two angles opposite the edge, negated: positive if they exceed a half-turn
/// together.
fn angle_gain([a, b, c, d]: [DVec3; 4]) -> f64 {
    -(cotangent(c, a, b) + cotangent(d, b, a))
}

fn cotangent(at: DVec3, p: DVec3, q: DVec3) -> f64 {
    let (u, v) = (p - at, q - at);
    u.dot(v) / u.cross(v).length().max(f64::MIN_POSITIVE)
}

/// By how much the sum of squared differences to the ideal valences falls, halved and with the neutral flip
/// at 0.
fn valence_gain(links: &HalfEdgeMesh, [a, b, c, d]: [u32; 4]) -> f64 {
    let excess = |v: u32| {
        let ideal = if links.kind(v) == VertexKind::Boundary { 4.0 } else { 6.0 };
        f64::from(links.valence(v)) - ideal
    };
    excess(a) + excess(b) - excess(c) - excess(d) - 2.0
}

/// Whether the triangles after the flip face as those before, do not form a sharper edge, and are not too
/// flat.
fn keeps_shape([a, b, c, d]: [DVec3; 4]) -> bool {
    let (old, other) = (doubled_normal([a, b, c]), doubled_normal([b, a, d]));
    let (new, next) = (doubled_normal([d, c, a]), doubled_normal([c, d, b]));
    let pair = old + other;
    let [old_len, other_len, new_len, next_len, pair_len] = [old, other, new, next, pair].map(DVec3::length);
    if new_len.min(next_len) <= 0.0 {
        return false;
    }
    let dihedral = new.dot(next) / (new_len * next_len);
    let before = old.dot(other) / (old_len * other_len).max(f64::MIN_POSITIVE);
    new.dot(pair) > MIN_AGREEMENT * new_len * pair_len
        && next.dot(pair) > MIN_AGREEMENT * next_len * pair_len
        && dihedral >= MIN_DIHEDRAL.min(before)
        && [[a, d, c], [b, c, d], [d, a, c], [c, b, d], [c, d, a], [d, c, b]]
            .iter()
            .all(|&[at, p, q]| (p - at).dot(q - at) >= MIN_COSINE * (p - at).length() * (q - at).length())
}
