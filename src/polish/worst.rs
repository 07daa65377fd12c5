//! The worst triangles: a direct search for better places of the vertices around them.

use glam::DVec3;
use rayon::prelude::*;

use super::Target;
use super::relax::{CHUNK, spoils, vertex_normal};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{next, previous};

/// Triangles that score below this are looked after: the cosine of 42 degrees, negated.
const GOAL: f64 = -0.743_144_825_477_394;
/// Directions that are tried from a place.
const DIRECTIONS: u32 = 8;
/// Length of the first trial step over that of the shortest edge, halved as often as `HALVINGS` says.
const FIRST_STEP: f64 = 0.16;
const HALVINGS: u32 = 4;
/// What a move must gain: a hundredth of a degree.
const MIN_GAIN: f64 = 1e-4;

/// Moves vertices of bad triangles one by one, in index order, where that lifts the worst triangle around
/// them, and `passes` times over all; gives the number of moves.
pub(crate) fn improve(
    links: &HalfEdgeMesh,
    points: &mut [DVec3],
    ranks: &mut [usize],
    fixed: &[bool],
    target: &Target,
    passes: u32,
) -> usize {
    let mut total = 0;
    for _ in 0..passes {
        let mut touched: Vec<u32> = (0..links.triangles.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .filter(|&t| score(links.triangles[t].map(|v| points[v as usize])) < GOAL)
            .flat_map_iter(|t| links.triangles[t])
            .filter(|&v| !fixed[v as usize])
            .collect();
        touched.par_sort_unstable();
        touched.dedup();
        let before = total;
        for v in touched {
            total += usize::from(lift(links, points, &mut ranks[v as usize], target, v));
        }
        if total == before {
            break;
        }
    }
    total
}

/// The negated cosine of the smallest angle, or less where the largest is above 90 degrees: no angle is
/// needed, only which is better.
pub(crate) fn score([a, b, c]: [DVec3; 3]) -> f64 {
    let (u, v, w) = (b - a, c - b, a - c);
    let [x, y, z] = [u, v, w].map(DVec3::length);
    let cosine = |p: DVec3, q: DVec3, lengths: f64| -p.dot(q) / lengths.max(f64::MIN_POSITIVE);
    let cosines = [cosine(w, u, z * x), cosine(u, v, x * y), cosine(v, w, y * z)];
    let largest = cosines[0].max(cosines[1]).max(cosines[2]);
    let smallest = cosines[0].min(cosines[1]).min(cosines[2]);
    (-largest).min(smallest + GOAL)
}

/// The lowest score around `v` if it stood at `p`.
fn ring_score(links: &HalfEdgeMesh, points: &[DVec3], v: u32, p: DVec3) -> f64 {
    links
        .ring(v)
        .map(|h| {
            score([p, points[links.origin(next(h)) as usize], points[links.origin(previous(h)) as usize]])
        })
        .fold(f64::INFINITY, f64::min)
}

/// Searches a better place for one vertex in its tangent plane, surface or not.
pub(crate) fn lift_freely(links: &HalfEdgeMesh, points: &mut [DVec3], v: u32) {
    if let Some((place, ..)) = search(links, points, v) {
        points[v as usize] = place;
    }
}

/// Searches a better place for one vertex on the surface; whether it moved.
fn lift(links: &HalfEdgeMesh, points: &mut [DVec3], rank: &mut usize, target: &Target, v: u32) -> bool {
    let here = points[v as usize];
    let Some((place, normal, start)) = search(links, points, v) else { return false };
    let Some(place) = target.closest(place, normal, links.patch_at(v), rank) else { return false };
    let folds = links.ring(v).any(|h| {
        let [q, r] = [next(h), previous(h)].map(|h| points[links.origin(h) as usize]);
        spoils([here, q, r], [place, q, r], normal)
    });
    let better = !folds && ring_score(links, points, v, place) >= start + MIN_GAIN;
    if better {
        points[v as usize] = place;
    }
    better
}

/// A better place for one vertex by trial steps in its tangent plane, its normal, and the score that it had.
fn search(links: &HalfEdgeMesh, points: &[DVec3], v: u32) -> Option<(DVec3, DVec3, f64)> {
    let here = points[v as usize];
    let normal = vertex_normal(links, points, v);
    let across = normal.any_orthonormal_vector();
    let along = normal.cross(across);
    let shortest = links
        .ring(v)
        .map(|h| points[links.origin(next(h)) as usize].distance(here))
        .fold(f64::INFINITY, f64::min);
    let start = ring_score(links, points, v, here);
    if start >= GOAL || !start.is_finite() || normal == DVec3::ZERO {
        return None;
    }
    let (mut place, mut best) = (here, start);
    let mut step = FIRST_STEP * shortest;
    for _ in 0..HALVINGS {
        for k in 0..DIRECTIONS {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(DIRECTIONS);
            let trial = place + (across * angle.cos() + along * angle.sin()) * step;
            let reached = ring_score(links, points, v, trial);
            if reached > best {
                (place, best) = (trial, reached);
            }
        }
        step *= 0.5;
    }
    (best >= start + MIN_GAIN).then_some((place, normal, start))
}
