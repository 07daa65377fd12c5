//! Tangential relaxation: all vertices move at once towards the mean of their neighbours.

use glam::DVec3;
use rayon::prelude::*;

use super::Target;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{next, previous};
use crate::mesh::triangle::doubled_normal;

/// Step towards the mean of the neighbours, as a share of the distance. Above 1, since neighbours move in
/// similar directions; on a regular mesh the limit of stability is 4/3.
const STRIDE: f64 = 1.1;
/// Minimum cosine between a triangle's normal and those of its vertices.
const MIN_AGREEMENT: f64 = 0.5;
/// Squared ratio of doubled area to squared longest edge below which a triangle may not shrink: heights of a
/// fifth.
const FLAT_SQ: f64 = 0.04;
/// If one square is this many times another, rounding cannot change which is larger.
const CLEARLY: f64 = 1.0 + 1e-9;
/// Products above this have squares that do not underflow.
const TINY: f64 = 1e-140;
/// Times that the moves of single triangles are undone before all moves are.
const REPAIRS: u32 = 8;
/// Minimum number of vertices or triangles for a thread.
pub(crate) const CHUNK: usize = 512;

/// Moves all vertices that are not fixed by one step, and returns how many of these moves were undone because
/// a triangle would have folded or become flat. `lengths` are the target edge lengths at the vertices, empty
/// if they are all equal.
pub(crate) fn relax(
    half_edges: &HalfEdgeMesh,
    points: &mut Vec<DVec3>,
    ranks: &mut [usize],
    (fixed, lengths): (&[bool], &[f64]),
    target: &Target,
) -> usize {
    let old: &[DVec3] = points;
    let (mut moved, normals): (Vec<DVec3>, Vec<DVec3>) = ranks
        .par_iter_mut()
        .enumerate()
        .with_min_len(CHUNK)
        .map(|(v, rank)| {
            let here = old[v];
            let (mean, normal) = ring(half_edges, old, lengths, v as u32);
            if fixed[v] {
                return (here, normal);
            }
            let step = mean - here;
            let goal = here + (step - normal * step.dot(normal)) * STRIDE;
            (target.closest(goal, normal, half_edges.patch_at(v as u32), rank).unwrap_or(here), normal)
        })
        .unzip();
    let undone = undo_bad_moves(half_edges, points, &normals, &mut moved);
    *points = moved;
    undone
}

/// The mean of a vertex's neighbours, and its unit normal; its own position and 0 if it is irregular.
///
/// Where target lengths differ, a neighbour has less weight if the edge to it is to be longer, so that a
/// vertex whose edges have their target lengths is at rest.
fn ring(half_edges: &HalfEdgeMesh, points: &[DVec3], lengths: &[f64], v: u32) -> (DVec3, DVec3) {
    let here = points[v as usize];
    let (mut sum, mut count, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO);
    let mut ahead = None;
    for h in half_edges.ring(v) {
        // Each triangle ends at the neighbour where the next one begins.
        let (w, p) = ahead.unwrap_or_else(|| {
            let w = half_edges.origin(next(h)) as usize;
            (w, points[w] - here)
        });
        let x = half_edges.origin(previous(h)) as usize;
        let q = points[x] - here;
        ahead = Some((x, q));
        normal += p.cross(q);
        let weight = lengths.get(v as usize).map_or(1.0, |here| 2.0 * here / (here + lengths[w]));
        sum += weight * p;
        count += weight;
    }
    let mean = if count > 0.0 { here + sum / count } else { here };
    (mean, normal.normalize_or_zero())
}

/// The unit normal of a vertex; 0 if it is irregular.
pub(crate) fn vertex_normal(half_edges: &HalfEdgeMesh, points: &[DVec3], v: u32) -> DVec3 {
    ring(half_edges, points, &[], v).1
}

/// Moves vertices from `moved` back to `points` until no triangle folds or becomes flat; returns how many.
/// `normals` are those of the vertices.
pub(super) fn undo_bad_moves(
    half_edges: &HalfEdgeMesh,
    points: &[DVec3],
    normals: &[DVec3],
    moved: &mut [DVec3],
) -> usize {
    let mut undone = 0;
    // Only triangles with changed moves are looked at again.
    let mut changed: Option<Vec<bool>> = None;
    for _ in 0..REPAIRS {
        let bad: Vec<[u32; 3]> = half_edges
            .triangles
            .par_iter()
            .with_min_len(CHUNK)
            .filter(|triangle| {
                changed.as_ref().is_none_or(|changed| triangle.iter().any(|v| changed[*v as usize]))
            })
            .filter(|triangle| {
                let at = |points: &[DVec3]| triangle.map(|v| points[v as usize]);
                let up = triangle.map(|v| normals[v as usize]).iter().sum();
                folds_or_flattens(at(points), at(moved), up)
            })
            .copied()
            .collect();
        if bad.is_empty() {
            return undone;
        }
        let mut changed_now = vec![false; points.len()];
        for v in bad.into_iter().flatten().map(|v| v as usize) {
            undone += usize::from(moved[v] != points[v]);
            moved[v] = points[v];
            changed_now[v] = true;
        }
        changed = Some(changed_now);
    }
    moved.copy_from_slice(points);
    points.len()
}

/// Whether a triangle turns away from `up`, the direction of its vertices' normals, or becomes flat by a
/// move. A triangle that was turned or flat before may stay like that.
pub(crate) fn folds_or_flattens(old: [DVec3; 3], new: [DVec3; 3], up: DVec3) -> bool {
    if old == new {
        return false;
    }
    let after = doubled_normal(new);
    // Mostly neither is near, which these tell without a root or a quotient.
    let (along, length_sq) = (after.dot(up), after.length_squared());
    let is_facing =
        along > TINY && along * along > CLEARLY * MIN_AGREEMENT.powi(2) * length_sq * up.length_squared();
    let longest_sq =
        |[a, b, c]: [DVec3; 3]| a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let longest_after = longest_sq(new);
    if is_facing && length_sq > CLEARLY * FLAT_SQ * longest_after * longest_after {
        return false;
    }
    let before = doubled_normal(old);
    let agreement = |n: DVec3| n.dot(up) / (n.length() * up.length()).max(f64::MIN_POSITIVE);
    let facing = agreement(after);
    if facing < MIN_AGREEMENT && facing <= agreement(before) {
        return true;
    }
    let flatness = |n: DVec3, longest: f64| n.length_squared() / (longest * longest).max(f64::MIN_POSITIVE);
    let shape = flatness(after, longest_after);
    shape < FLAT_SQ && shape <= flatness(before, longest_sq(old))
}
