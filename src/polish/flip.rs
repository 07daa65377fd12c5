//! Edge flips towards Delaunay triangles and six edges per vertex.

use glam::DVec3;
use rayon::prelude::*;

use super::locked::Locked;
use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::mesh::half_edges::{next, previous};
use crate::mesh::triangle::doubled_normal;

/// Least valence of a vertex that may lose an edge.
const MIN_VALENCE: u32 = 4;
/// Minimum cosine between the normal of a new triangle and that of the old pair.
const MIN_AGREEMENT: f64 = 0.5;
/// Minimum cosine between the two new triangles, unless the old ones turned more sharply.
const MIN_DIHEDRAL: f64 = 0.8;
/// Cosine of the largest angle that a flip may create: about 127°.
const MIN_COSINE: f64 = -0.6;
/// Weight of vertices on curves in what valences gain: with two triangles on a straight side, one of them
/// is obtuse.
const WEIGHT_ON_CURVES: f64 = 2.0;
/// Minimum gain of a flip, so that rounding errors cannot flip an edge back and forth.
pub(super) const MIN_GAIN: f64 = 1e-6;

/// Flips edges where that is a gain, in a fixed order and in at most `sweeps` passes over all edges; returns
/// the number of flips. `valence_weight` is the weight of valences (see [`valence_gain`]) against cotangents.
pub(crate) fn flip_edges(
    half_edges: &mut HalfEdgeMesh,
    points: &[DVec3],
    locked: Locked,
    valence_weight: f64,
    sweeps: u32,
) -> usize {
    let mut total = 0;
    // Since the last sweep, gains have changed only around vertices whose edges have.
    let mut changed: Option<Vec<bool>> = None;
    for _ in 0..sweeps {
        let wanted: Vec<u32> = (0..half_edges.half_edge_count())
            .into_par_iter()
            .with_min_len(4096)
            .filter(|&h| is_near(half_edges, h, changed.as_deref()))
            .filter(|&h| pays(half_edges, points, locked, valence_weight, h))
            .collect();
        let mut changed_now = vec![false; points.len()];
        let mut flipped = 0;
        for h in wanted {
            // An earlier flip may have changed the gain of this one.
            if pays(half_edges, points, locked, valence_weight, h)
                && let Some(twin) = half_edges.twin(h)
            {
                let flip = half_edges.flip(h, twin);
                flip.vertices.iter().for_each(|v| changed_now[*v as usize] = true);
                flipped += 1;
            }
        }
        total += flipped;
        if flipped == 0 {
            break;
        }
        changed = Some(changed_now);
    }
    total
}

/// Whether a vertex of the two triangles at `h` has changed; false for the second half-edge of an edge.
fn is_near(half_edges: &HalfEdgeMesh, h: u32, changed: Option<&[bool]>) -> bool {
    let Some(twin) = half_edges.twin(h).filter(|&twin| h < twin) else { return false };
    changed.is_none_or(|changed| half_edges.diamond(h, twin).iter().any(|v| changed[*v as usize]))
}

/// Whether the edge of `h` may and should be flipped; false for the second of its two half-edges.
fn pays(half_edges: &HalfEdgeMesh, points: &[DVec3], locked: Locked, valence_weight: f64, h: u32) -> bool {
    let Some(twin) = half_edges.twin(h).filter(|&twin| h < twin) else { return false };
    let ring @ [a, b, ..] = half_edges.diamond(h, twin);
    let corners = ring.map(|v| points[v as usize]);
    // In strips between two curves, angles say more than numbers.
    let is_chord = locked.fixed[a as usize] && locked.fixed[b as usize];
    let valence = if is_chord { 0.0 } else { valence_gain(half_edges, points, locked, [h, twin]) };
    let valence = valence_weight * valence;
    // These two decide most edges, so they come first. Angles gain nothing where neither is obtuse.
    if valence <= MIN_GAIN && has_acute_angles(corners) || angle_gain(corners) + valence <= MIN_GAIN {
        return false;
    }
    is_allowed(half_edges, locked, [h, twin]) && keeps_shape(corners)
}

/// Whether an edge may be flipped as far as the topology, curves and patches are concerned.
pub(super) fn is_allowed(half_edges: &HalfEdgeMesh, locked: Locked, [h, twin]: [u32; 2]) -> bool {
    let ring @ [a, b, c, d] = half_edges.diamond(h, twin);
    c != d
        && ring.iter().all(|&v| half_edges.kind(v) != VertexKind::Irregular)
        && half_edges.valence(a) >= MIN_VALENCE
        && half_edges.valence(b) >= MIN_VALENCE
        && !locked.holds(a, b)
        && !half_edges.joined(c, d)
        && half_edges.patch(h / 3) == half_edges.patch(twin / 3)
}

/// Negated sum of the cotangents of the two angles opposite the edge: positive if they exceed 180° together.
pub(crate) fn angle_gain([a, b, c, d]: [DVec3; 4]) -> f64 {
    -(cotangent(c, a, b) + cotangent(d, b, a))
}

/// Whether neither of the two angles opposite the edge exceeds 90 degrees.
fn has_acute_angles([a, b, c, d]: [DVec3; 4]) -> bool {
    (a - c).dot(b - c) >= 0.0 && (a - d).dot(b - d) >= 0.0
}

fn cotangent(at: DVec3, p: DVec3, q: DVec3) -> f64 {
    let (u, v) = (p - at, q - at);
    u.dot(v) / u.cross(v).length().max(f64::MIN_POSITIVE)
}

/// Half the decrease of the weighted sum of squared differences to the ideal valences by a flip of this edge.
fn valence_gain(half_edges: &HalfEdgeMesh, points: &[DVec3], locked: Locked, [h, twin]: [u32; 2]) -> f64 {
    let [a, b, c, d] = half_edges.diamond(h, twin);
    if ![a, b, c, d].iter().any(|v| locked.fixed[*v as usize]) {
        let valence = |v: u32| half_edges.valence(v) as i32;
        return f64::from(valence(a) + valence(b) - valence(c) - valence(d) - 2);
    }
    let gain = |h: u32, by: f64| {
        let v = half_edges.origin(h);
        let (excess, weight) = if locked.fixed[v as usize] {
            (side_excess(half_edges, points, locked, h), WEIGHT_ON_CURVES)
        } else {
            (f64::from(half_edges.valence(v)) - 6.0, 1.0)
        };
        weight * (by * excess - 0.5)
    };
    gain(h, 1.0) + gain(twin, 1.0) + gain(previous(h), -1.0) + gain(previous(twin), -1.0)
}

/// The triangles that the origin of a half-edge on a curve has on that side of it, beyond those that make
/// angles of 60 degrees.
fn side_excess(half_edges: &HalfEdgeMesh, points: &[DVec3], locked: Locked, start: u32) -> f64 {
    let v = half_edges.origin(start);
    let at = points[v as usize];
    let end = |h: u32| half_edges.origin(next(h));
    let (mut triangles, mut angle) = (0.0, 0.0);
    let mut add = |h: u32| {
        let [p, q] = [end(h), half_edges.origin(previous(h))].map(|w| points[w as usize] - at);
        triangles += 1.0;
        angle += p.angle_between(q);
    };
    add(start);
    // Towards one end of the side, then towards the other.
    let mut h = start;
    while !locked.holds(v, half_edges.origin(previous(h)))
        && let Some(beside) = half_edges.twin(previous(h))
        && beside != start
    {
        h = beside;
        add(h);
    }
    let mut h = start;
    while !locked.holds(v, end(h))
        && let Some(beside) = half_edges.twin(h)
        && next(beside) != start
    {
        h = next(beside);
        add(h);
    }
    triangles - angle / std::f64::consts::FRAC_PI_3
}

/// Whether the triangles after the flip face the same way as those before, do not form a sharper edge, and
/// are not too flat.
pub(crate) fn keeps_shape(ring: [DVec3; 4]) -> bool {
    keeps_direction(ring) && has_no_wide_angle(ring)
}

/// Whether the triangles after the flip face the same way as those before, and do not form a sharper edge.
pub(crate) fn keeps_direction([a, b, c, d]: [DVec3; 4]) -> bool {
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
}

/// Whether no angle of the triangles after the flip is too wide.
pub(crate) fn has_no_wide_angle([a, b, c, d]: [DVec3; 4]) -> bool {
    [[a, d, c], [b, c, d], [d, a, c], [c, b, d], [c, d, a], [d, c, b]]
        .iter()
        .all(|&[at, p, q]| (p - at).dot(q - at) >= MIN_COSINE * (p - at).length() * (q - at).length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::half_edges::{EdgeSet, edge_key};

    /// What the first vertex, at the origin, has on each side of its curve: it is the first corner of all
    /// triangles, which have the others around it.
    fn excesses(around: &[[f64; 2]], triangles: &[[u32; 2]], on_curve: &[u32]) -> Vec<f64> {
        let others = around.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0));
        let points: Vec<DVec3> = std::iter::once(DVec3::ZERO).chain(others).collect();
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|[a, b]| [0, *a, *b]).collect();
        let half_edges = HalfEdgeMesh::new(triangles.clone(), points.len(), &[]);
        let curve_edges: EdgeSet = on_curve.iter().map(|v| edge_key(0, *v)).collect();
        let locked = Locked { fixed: &vec![true; points.len()], curve_edges: &curve_edges };
        let of = |t: usize| side_excess(&half_edges, &points, locked, 3 * t as u32);
        (0..triangles.len()).map(of).collect()
    }

    fn are(found: &[f64], expected: &[f64]) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near && found.len() == expected.len(), "{found:?} instead of {expected:?}");
    }

    #[test]
    fn each_side_of_a_curve_counts_for_itself() {
        let h = 0.75f64.sqrt();
        let around = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [-0.5, -h], [0.5, -h]];
        // Two triangles on one side of a straight curve, three on the other.
        let ring = [[1, 2], [2, 3], [3, 4], [4, 5], [5, 1]];
        are(&excesses(&around, &ring, &[1, 3]), &[-1.0, -1.0, 0.0, 0.0, 0.0]);
        // A boundary ends a side as well.
        are(&excesses(&around, &ring[2..], &[1]), &[0.0, 0.0, 0.0]);
        // Where the curve ends, there is one side; where it has a corner, the angle counts.
        are(&excesses(&around, &ring, &[1]), &[-1.0; 5]);
        are(&excesses(&around, &ring, &[1, 2]), &[-0.5, -0.5, -0.5, -0.5, -0.5]);
    }
}
