//! Tangential relaxation: every vertex towards the mean of its ring, all at once.

use glam::DVec3;
use rayon::prelude::*;

use super::Target;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{next, previous};
use crate::mesh::triangle::doubled_normal;

/// Share of the way to the ring's mean that a vertex goes. Above 1, since the vertices around go the same
/// way; on a regular mesh 4/3 would be the limit of stability.
const STRIDE: f64 = 1.1;
/// Least cosine between a triangle's normal and those of its vertices.
const MIN_AGREEMENT: f64 = 0.5;
/// Squared ratio of doubled area to squared longest edge below which a triangle may not shrink: heights of a
/// fifth.
const FLAT_SQ: f64 = 0.04;
/// Times that moves are taken back triangle by triangle before all are.
const REPAIRS: u32 = 8;
/// Vertices and triangles that a thread takes at the least.
pub(crate) const CHUNK: usize = 512;

/// One step of all vertices that are not fixed, with the edge `lengths` wanted at all, or nothing if they are
/// equal; gives how many did not move because a triangle would have suffered.
pub(crate) fn relax(
    links: &HalfEdgeMesh,
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
            let (mean, normal) = ring(links, old, lengths, v as u32);
            if fixed[v] {
                return (here, normal);
            }
            let step = mean - here;
            let goal = here + (step - normal * step.dot(normal)) * STRIDE;
            (target.closest(goal, normal, links.patch_at(v as u32), rank).unwrap_or(here), normal)
        })
        .unzip();
    let undone = take_back(links, points, &normals, &mut moved);
    *points = moved;
    undone
}

/// The mean of the neighbours of a vertex, and its unit normal; the vertex and 0 if it is irregular.
///
/// Where lengths differ, neighbours count the less the longer the edge to them is to be: a vertex whose edges
/// are as long as wanted is then at rest.
fn ring(links: &HalfEdgeMesh, points: &[DVec3], lengths: &[f64], v: u32) -> (DVec3, DVec3) {
    let here = points[v as usize];
    let (mut sum, mut count, mut normal) = (DVec3::ZERO, 0.0, DVec3::ZERO);
    for h in links.ring(v) {
        let p = points[links.origin(next(h)) as usize] - here;
        let q = points[links.origin(previous(h)) as usize] - here;
        normal += p.cross(q);
        let weight = lengths
            .get(v as usize)
            .map_or(1.0, |here| 2.0 * here / (here + lengths[links.origin(next(h)) as usize]));
        sum += weight * p;
        count += weight;
    }
    let mean = if count > 0.0 { here + sum / count } else { here };
    (mean, normal.normalize_or_zero())
}

/// The unit normal of a vertex, 0 if it is irregular.
pub(crate) fn vertex_normal(links: &HalfEdgeMesh, points: &[DVec3], v: u32) -> DVec3 {
    ring(links, points, &[], v).1
}

/// Puts the vertices of triangles that `moved` folds or flattens back to `points`, until there is none; gives
/// how many vertices were put back. `normals` are those of the vertices.
fn take_back(links: &HalfEdgeMesh, points: &[DVec3], normals: &[DVec3], moved: &mut [DVec3]) -> usize {
    let mut undone = 0;
    for _ in 0..REPAIRS {
        let bad: Vec<[u32; 3]> = links
            .triangles
            .par_iter()
            .with_min_len(CHUNK)
            .filter(|triangle| {
                let at = |points: &[DVec3]| triangle.map(|v| points[v as usize]);
                let up = triangle.map(|v| normals[v as usize]).iter().sum();
                spoils(at(points), at(moved), up)
            })
            .copied()
            .collect();
        if bad.is_empty() {
            return undone;
        }
        for v in bad.into_iter().flatten().map(|v| v as usize) {
            undone += usize::from(moved[v] != points[v]);
            moved[v] = points[v];
        }
    }
    moved.copy_from_slice(points);
    points.len()
}

/// Whether a triangle turns away from `up`, the direction of its vertices' normals, or becomes flat. One that
/// was so before may stay so.
pub(crate) fn spoils(old: [DVec3; 3], new: [DVec3; 3], up: DVec3) -> bool {
    if old == new {
        return false;
    }
    let (before, after) = (doubled_normal(old), doubled_normal(new));
    let agreement = |n: DVec3| n.dot(up) / (n.length() * up.length()).max(f64::MIN_POSITIVE);
    let facing = agreement(after);
    if facing < MIN_AGREEMENT && facing <= agreement(before) {
        return true;
    }
    let flatness = |n: DVec3, [a, b, c]: [DVec3; 3]| {
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        n.length_squared() / (longest * longest).max(f64::MIN_POSITIVE)
    };
    let shape = flatness(after, new);
    shape < FLAT_SQ && shape <= flatness(before, old)
}
