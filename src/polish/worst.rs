//! Worst triangles: a direct search for better positions of their vertices.

use glam::DVec3;
use rayon::prelude::*;

use super::Target;
use super::relax::{CHUNK, folds_or_flattens, vertex_normal};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{next, previous};

/// Score below which triangles are improved: the negated cosine of 42 degrees.
const GOAL: f64 = -0.743_144_825_477_394;
/// Factor below which squares show what rounding cannot change.
const CLEARLY: f64 = 1.0 - 1e-9;
/// Directions that are tried from a position.
const DIRECTIONS: usize = 8;
/// Length of the first trial steps over that of the shortest edge; halved between series of trials.
const FIRST_STEP: f64 = 0.16;
/// Series of trials.
const SERIES: u32 = 4;
/// Minimum gain of a move in score: a hundredth of a degree.
const MIN_GAIN: f64 = 1e-4;

/// Moves vertices of bad triangles one by one, in index order, where that raises the lowest score around
/// them, in at most `passes` passes; returns the number of moves.
pub(crate) fn improve(
    half_edges: &HalfEdgeMesh,
    points: &mut [DVec3],
    ranks: &mut [usize],
    fixed: &[bool],
    target: &Target,
    passes: u32,
) -> usize {
    let is_bad = |points: &[DVec3], t: u32| {
        let corners = half_edges.triangles[t as usize].map(|v| points[v as usize]);
        !is_clearly_good(corners) && score(corners) < GOAL
    };
    let mut total = 0;
    let mut bad: Vec<u32> = (0..half_edges.triangles.len() as u32)
        .into_par_iter()
        .with_min_len(CHUNK)
        .filter(|&t| is_bad(points, t))
        .collect();
    for _ in 0..passes {
        let corners = bad.iter().flat_map(|&t| half_edges.triangles[t as usize]);
        let mut touched: Vec<u32> = corners.filter(|&v| !fixed[v as usize]).collect();
        touched.sort_unstable();
        touched.dedup();
        touched.retain(|&v| lift(half_edges, points, &mut ranks[v as usize], target, v));
        if touched.is_empty() {
            break;
        }
        total += touched.len();
        // Others are as good as they were.
        bad.extend(touched.iter().flat_map(|&v| half_edges.ring(v)).map(|h| h / 3));
        bad.sort_unstable();
        bad.dedup();
        bad.retain(|&t| is_bad(points, t));
    }
    total
}

/// Score of a triangle: the negated cosine of its smallest angle, or less if its largest angle exceeds 90
/// degrees. Cosines suffice to compare, so no angle is computed.
pub(crate) fn score([a, b, c]: [DVec3; 3]) -> f64 {
    let (u, v, w) = (b - a, c - b, a - c);
    let [x, y, z] = [u, v, w].map(DVec3::length);
    let cosine = |p: DVec3, q: DVec3, lengths: f64| -p.dot(q) / lengths.max(f64::MIN_POSITIVE);
    let cosines = [cosine(w, u, z * x), cosine(u, v, x * y), cosine(v, w, y * z)];
    let largest = cosines[0].max(cosines[1]).max(cosines[2]);
    let smallest = cosines[0].min(cosines[1]).min(cosines[2]);
    (-largest).min(smallest + GOAL)
}

/// Whether the score of a triangle is not below [`GOAL`], as nearly always, and squares tell so without a
/// root or a quotient.
fn is_clearly_good([a, b, c]: [DVec3; 3]) -> bool {
    let (u, v, w) = (b - a, c - b, a - c);
    let [x, y, z] = [u, v, w].map(DVec3::length_squared);
    let is_good = |p: DVec3, q: DVec3, lengths_sq: f64| {
        let product = -p.dot(q);
        product >= 0.0 && product * product < CLEARLY * GOAL * GOAL * lengths_sq
    };
    is_good(w, u, z * x) && is_good(u, v, x * y) && is_good(v, w, y * z)
}

/// The other two corners of the triangles around `v`.
fn ring_edges<'a>(
    half_edges: &'a HalfEdgeMesh,
    points: &'a [DVec3],
    v: u32,
) -> impl Iterator<Item = [DVec3; 2]> + 'a {
    let of = |h: u32| [next(h), previous(h)].map(|h| points[half_edges.origin(h) as usize]);
    half_edges.ring(v).map(of)
}

/// The lowest score of the triangles between a vertex at `p` and the edges around it.
fn ring_score(edges: impl IntoIterator<Item = [DVec3; 2]>, p: DVec3) -> f64 {
    edges.into_iter().map(|[q, r]| score([p, q, r])).fold(f64::INFINITY, f64::min)
}

/// The [`ring_score`] if it is above `least`. Otherwise the edge of a triangle that is not above it is moved
/// to the front, since the next position mostly fails by the same one.
fn ring_score_above(edges: &mut [[DVec3; 2]], p: DVec3, least: f64) -> Option<f64> {
    let mut lowest = f64::INFINITY;
    for k in 0..edges.len() {
        let [q, r] = edges[k];
        lowest = score([p, q, r]).min(lowest);
        if lowest <= least {
            edges.swap(0, k);
            return None;
        }
    }
    Some(lowest)
}

/// Moves one vertex to a better position in its tangent plane, if there is one, wherever the surface is;
/// returns whether it moved.
pub(crate) fn lift_freely(half_edges: &HalfEdgeMesh, points: &mut [DVec3], v: u32) -> bool {
    let found = better_position(half_edges, points, v);
    found.inspect(|position| points[v as usize] = *position).is_some()
}

/// Where [`lift_freely`] moves a vertex, which depends on the triangles around it alone.
pub(crate) fn better_position(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> Option<DVec3> {
    search(half_edges, points, v).map(|(position, ..)| position)
}

/// Moves one vertex to a better position on the surface, if there is one; returns whether it moved.
fn lift(half_edges: &HalfEdgeMesh, points: &mut [DVec3], rank: &mut usize, target: &Target, v: u32) -> bool {
    let here = points[v as usize];
    let Some((position, normal, start)) = search(half_edges, points, v) else { return false };
    let Some(position) = target.closest(position, normal, half_edges.patch_at(v), rank) else { return false };
    let folds = ring_edges(half_edges, points, v)
        .any(|[q, r]| folds_or_flattens([here, q, r], [position, q, r], normal));
    let reached = || ring_score(ring_edges(half_edges, points, v), position);
    let better = !folds && reached() >= start + MIN_GAIN;
    if better {
        points[v as usize] = position;
    }
    better
}

/// A better position for one vertex, found by trial steps in its tangent plane, with its normal and its
/// former score.
fn search(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> Option<(DVec3, DVec3, f64)> {
    let here = points[v as usize];
    let start = ring_score(ring_edges(half_edges, points, v), here);
    if start >= GOAL || !start.is_finite() {
        return None;
    }
    let normal = vertex_normal(half_edges, points, v);
    if normal == DVec3::ZERO {
        return None;
    }
    let across = normal.any_orthonormal_vector();
    let along = normal.cross(across);
    let directions: [DVec3; DIRECTIONS] = std::array::from_fn(|k| {
        let angle = k as f64 * std::f64::consts::TAU / DIRECTIONS as f64;
        across * angle.cos() + along * angle.sin()
    });
    let mut edges: Vec<[DVec3; 2]> = ring_edges(half_edges, points, v).collect();
    let shortest = edges.iter().map(|[q, _]| q.distance(here)).fold(f64::INFINITY, f64::min);
    let (mut position, mut best) = (here, start);
    let mut step = FIRST_STEP * shortest;
    for _ in 0..SERIES {
        for direction in directions {
            let trial = position + direction * step;
            if let Some(reached) = ring_score_above(&mut edges, trial, best) {
                (position, best) = (trial, reached);
            }
        }
        step *= 0.5;
    }
    (best >= start + MIN_GAIN).then_some((position, normal, start))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn what_is_clearly_good_is_good() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        let (mut good, mut missed) = (0, 0);
        for _ in 0..20_000 {
            let corners: [DVec3; 3] = std::array::from_fn(|k| {
                let angle = k as f64 * std::f64::consts::TAU / 3.0;
                let at = |_| random.random_range(-0.5..0.5);
                DVec3::new(angle.cos(), angle.sin(), 0.0) + DVec3::from_array(std::array::from_fn(at))
            });
            let is_good = score(corners) >= GOAL;
            assert!(is_good || !is_clearly_good(corners), "{corners:?}");
            good += usize::from(is_good);
            missed += usize::from(is_good && !is_clearly_good(corners));
        }
        assert!(good > 2000 && missed < good / 100, "{missed} of {good}");
    }
}
