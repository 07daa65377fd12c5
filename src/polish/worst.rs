//! Worst triangles: a direct search for better positions of their vertices.

use glam::DVec3;
use rayon::prelude::*;

use super::Target;
use super::relax::{CHUNK, folds_or_flattens, vertex_normal};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{next, previous};

/// Score below which triangles are improved: the negated cosine of 42 degrees.
const GOAL: f64 = -0.743_144_825_477_394;
/// Directions that are tried from a position.
const DIRECTIONS: u32 = 8;
/// Length of the first trial steps over that of the shortest edge; halved between series of trials.
const FIRST_STEP: f64 = 0.16;
/// Series of trials.
const SERIES: u32 = 4;
/// Least gain of a move in score: a hundredth of a degree.
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
    let mut total = 0;
    for _ in 0..passes {
        let mut touched: Vec<u32> = (0..half_edges.triangles.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .filter(|&t| score(half_edges.triangles[t].map(|v| points[v as usize])) < GOAL)
            .flat_map_iter(|t| half_edges.triangles[t])
            .filter(|&v| !fixed[v as usize])
            .collect();
        touched.par_sort_unstable();
        touched.dedup();
        let before = total;
        for v in touched {
            total += usize::from(lift(half_edges, points, &mut ranks[v as usize], target, v));
        }
        if total == before {
            break;
        }
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

/// The lowest score of the triangles around `v` if it were at `p`.
fn ring_score(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32, p: DVec3) -> f64 {
    half_edges
        .ring(v)
        .map(|h| {
            score([
                p,
                points[half_edges.origin(next(h)) as usize],
                points[half_edges.origin(previous(h)) as usize],
            ])
        })
        .fold(f64::INFINITY, f64::min)
}

/// Moves one vertex to a better position in its tangent plane, if there is one, wherever the surface is.
pub(crate) fn lift_freely(half_edges: &HalfEdgeMesh, points: &mut [DVec3], v: u32) {
    if let Some((position, ..)) = search(half_edges, points, v) {
        points[v as usize] = position;
    }
}

/// Moves one vertex to a better position on the surface, if there is one; returns whether it moved.
fn lift(half_edges: &HalfEdgeMesh, points: &mut [DVec3], rank: &mut usize, target: &Target, v: u32) -> bool {
    let here = points[v as usize];
    let Some((position, normal, start)) = search(half_edges, points, v) else { return false };
    let Some(position) = target.closest(position, normal, half_edges.patch_at(v), rank) else { return false };
    let folds = half_edges.ring(v).any(|h| {
        let [q, r] = [next(h), previous(h)].map(|h| points[half_edges.origin(h) as usize]);
        folds_or_flattens([here, q, r], [position, q, r], normal)
    });
    let better = !folds && ring_score(half_edges, points, v, position) >= start + MIN_GAIN;
    if better {
        points[v as usize] = position;
    }
    better
}

/// A better position for one vertex, found by trial steps in its tangent plane, with its normal and its
/// former score.
fn search(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> Option<(DVec3, DVec3, f64)> {
    let here = points[v as usize];
    let normal = vertex_normal(half_edges, points, v);
    let across = normal.any_orthonormal_vector();
    let along = normal.cross(across);
    let shortest = half_edges
        .ring(v)
        .map(|h| points[half_edges.origin(next(h)) as usize].distance(here))
        .fold(f64::INFINITY, f64::min);
    let start = ring_score(half_edges, points, v, here);
    if start >= GOAL || !start.is_finite() || normal == DVec3::ZERO {
        return None;
    }
    let (mut position, mut best) = (here, start);
    let mut step = FIRST_STEP * shortest;
    for _ in 0..SERIES {
        for k in 0..DIRECTIONS {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(DIRECTIONS);
            let trial = position + (across * angle.cos() + along * angle.sin()) * step;
            let reached = ring_score(half_edges, points, v, trial);
            if reached > best {
                (position, best) = (trial, reached);
            }
        }
        step *= 0.5;
    }
    (best >= start + MIN_GAIN).then_some((position, normal, start))
}
