//! Certified one-sided Hausdorff distances by branch and bound.
//!
//! The distance to a convex set is convex. So no point of a triangle is farther from another surface than the
//! farthest of its corners is from any single triangle there. A piece of the one surface whose bound is too
//! large is cut along the sides of the triangle closest to its middle: the part above that triangle has a
//! tight bound then, however large it is, and the others come under its neighbours. The bounds follow Guthe,
//! Borodin and Klein, "Fast and accurate Hausdorff distance calculation between meshes", 2005.

mod piece;
mod point;
mod polygon;

use std::collections::BinaryHeap;

use glam::DVec3;
use rayon::prelude::*;

use super::bvh::Bvh;
use super::quality::corner_points;
use super::{NONE, TriMesh};
use crate::{ProgressToken, Result};
use piece::Piece;
use point::distance_at_least;

/// Vertices that one thread takes in a row, each starting its search where the last one ended.
const VERTICES: usize = 1024;
/// Pieces in a batch; what is found in one batch is known to the next.
const BATCH: usize = 1 << 13;
/// Parts of a batch, each for one thread.
const CHUNKS: usize = 1 << 7;
/// Steps of a batch, at most; each leaves a few pieces behind.
const BATCH_STEPS: usize = 1 << 17;
/// Once this many pieces wait, of 112 bytes each, they come before further triangles.
const MANY: usize = 1 << 18;
/// Share of the tolerance that the search uses; the rest is for the roundings that the ends leave room for.
const USED: f64 = 0.999;
/// Both ends leave this share of the largest coordinate for rounding. A piece's corners are off by at most
/// 6e-16 of it for each of at most 3 × [`piece::MAX_DEPTH`] cuts, a distance by less than 1e-14 of it.
const ROUNDING: f64 = 1.0 / (1u64 << 40) as f64;

/// A mesh with the hierarchy over its triangles.
#[derive(Debug, Clone, Copy)]
pub struct Indexed<'a> {
    /// The mesh; not without triangles.
    pub mesh: &'a TriMesh,
    /// [`Bvh::new`] of the same mesh.
    pub bvh: &'a Bvh,
}

/// How close the ends of an interval are to be, one of both gaps being enough, and what it may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Gap between the ends over the upper one; above 0, below 1.
    pub relative: f64,
    /// Gap between the ends in the unit of the coordinates; above 0.
    pub absolute: f64,
    /// Most subdivisions.
    pub steps: usize,
}

impl Effort {
    /// Steps that suffice: remeshed models take one to three for each triangle of both.
    pub fn usual_steps(from: &TriMesh, to: &TriMesh) -> usize {
        2_000_000 + 30 * (from.triangles.len() + to.triangles.len())
    }
}

/// An interval that contains a distance, in the unit of the coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Some point is at least this far away.
    pub lower: f64,
    /// No point is farther away.
    pub upper: f64,
    /// A point at a distance of at least [`Interval::lower`].
    pub farthest: DVec3,
    /// Whether the ends are as close as asked for; if not, the steps did not suffice, or rounding is more.
    pub close: bool,
}

/// The one-sided Hausdorff distance: the largest distance of a point of `from` to the closest point of `to`.
///
/// The interval contains it however the roundings add up, for which both ends leave 2^-40 of the largest
/// coordinate. So bring the meshes near the origin first. Coordinates must be as [`Bvh`] asks. The result is
/// the same for every number of threads.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn one_sided(from: Indexed, to: Indexed, effort: Effort, progress: &ProgressToken) -> Result<Interval> {
    let size = corner_points(from.mesh).chain(corner_points(to.mesh));
    let rounding = ROUNDING * size.fold(0.0, |most: f64, v| most.max(v.abs().max_element()));
    let remote = from_boxes(from, to, rounding, effort);
    if remote.close {
        return Ok(remote);
    }
    let target = Target { bvh: to.bvh, effort };
    let (near, found) = farthest_vertex(from, &target, progress)?;
    let mut search = Search { target, found, steps: effort.steps, waiting: Vec::new(), progress };
    let order = from.bvh.leaf_order();
    search.run(order.len(), |k| {
        let t = order[k] as usize;
        Piece::new(from.mesh.corners(t), from.mesh.triangles[t].map(|v| near[v as usize]))
    })?;
    let found = search.found;
    let ends = [distance_at_least(to.bvh, found.farthest), found.upper];
    Ok(Interval::new(ends, found.farthest, rounding, effort))
}

impl Interval {
    fn new([lower, upper]: [f64; 2], farthest: DVec3, rounding: f64, effort: Effort) -> Self {
        let (lower, upper) = ((lower - rounding).max(0.0), upper + rounding);
        let close = upper - lower <= (effort.relative * upper).max(effort.absolute);
        Self { lower, upper, farthest, close }
    }
}

/// What the bounding boxes tell, which is all that matters if the surfaces are far apart. All triangles are
/// equally close then, which no search tells apart.
fn from_boxes(from: Indexed, to: Indexed, rounding: f64, effort: Effort) -> Interval {
    let bounds = to.bvh.bounds();
    let (centre, radius) = (0.5 * (bounds.min + bounds.max), 0.5 * bounds.min.distance(bounds.max));
    let (mut lower, mut upper, mut farthest) = (-1.0, 0.0f64, DVec3::ZERO);
    for p in corner_points(from.mesh) {
        let distance = bounds.distance_sq(p).sqrt();
        if distance > lower {
            (lower, farthest) = (distance, p);
        }
        upper = upper.max(p.distance(centre) + radius);
    }
    Interval::new([lower, upper], farthest, rounding, effort)
}

/// The rank of the triangle closest to each vertex in use, and which vertex is farthest.
fn farthest_vertex(from: Indexed, target: &Target, progress: &ProgressToken) -> Result<(Vec<u32>, Found)> {
    let mut near = vec![NONE; from.mesh.vertices.len()];
    let mut used = Vec::with_capacity(from.mesh.vertices.len());
    for &t in from.bvh.leaf_order() {
        for v in from.mesh.triangles[t as usize] {
            if near[v as usize] == NONE {
                near[v as usize] = 0;
                used.push(v);
            }
        }
    }
    let chunks: Vec<(Vec<u32>, Found)> = (used.par_chunks(VERTICES))
        .map(|chunk| {
            progress.poll()?;
            let (mut rank, mut found) = (0, Found::default());
            let nearest = |&v: &u32| {
                rank = target.measure(from.mesh.vertices[v as usize], rank, &mut found).0;
                rank
            };
            Ok((chunk.iter().map(nearest).collect(), found))
        })
        .collect::<Result<_>>()?;
    let mut farthest = Found::default();
    for (vertices, (ranks, found)) in used.chunks(VERTICES).zip(&chunks) {
        vertices.iter().zip(ranks).for_each(|(&v, &rank)| near[v as usize] = rank);
        farthest.join(found);
    }
    Ok((near, farthest))
}

/// The surface that distances are measured to.
struct Target<'a> {
    bvh: &'a Bvh,
    effort: Effort,
}

impl Target<'_> {
    /// The rank of the triangle closest to a point, and the distance to it. The search begins with the
    /// triangle at `rank`.
    fn measure(&self, p: DVec3, rank: u32, found: &mut Found) -> (u32, f64) {
        let mut rank = rank as usize;
        let Some(closest) = self.bvh.closest_from(p, &mut rank) else { return (0, f64::INFINITY) };
        let distance = closest.distance_sq.sqrt();
        if distance > found.distance {
            let enough = distance / (1.0 - USED * self.effort.relative);
            let enough = enough.max(distance + USED * self.effort.absolute);
            *found = Found { distance, farthest: p, enough, ..*found };
        }
        (rank as u32, distance)
    }

    /// The distance to the one triangle at `rank`.
    fn to_triangle(&self, rank: u32, p: DVec3) -> f64 {
        let closest = self.bvh.closest_at(rank as usize, p);
        // Should the distance be no number, it bounds nothing.
        closest.map(|closest| closest.distance_sq.sqrt()).filter(|d| !d.is_nan()).unwrap_or(f64::INFINITY)
    }
}

/// What is known of the distance.
#[derive(Debug, Clone, Copy)]
struct Found {
    /// The distance of the farthest point so far.
    distance: f64,
    farthest: DVec3,
    /// Bounds up to this are small enough, since the distance is no smaller than that of the farthest point.
    enough: f64,
    /// Largest bound of what is settled.
    upper: f64,
}

impl Default for Found {
    fn default() -> Self {
        Self { distance: -1.0, farthest: DVec3::ZERO, enough: 0.0, upper: 0.0 }
    }
}

impl Found {
    /// Whether a piece with this bound needs no further work.
    fn settles(&mut self, upper: f64) -> bool {
        let small = upper <= self.enough;
        if small {
            self.upper = self.upper.max(upper);
        }
        small
    }

    /// Of points that are equally far, the first one stays.
    fn join(&mut self, other: &Self) {
        let upper = self.upper.max(other.upper);
        if other.distance > self.distance {
            *self = *other;
        }
        self.upper = upper;
    }
}

struct Search<'a> {
    target: Target<'a>,
    found: Found,
    /// Steps that are left.
    steps: usize,
    /// Pieces that need further steps.
    waiting: Vec<Piece>,
    progress: &'a ProgressToken,
}

impl Search<'_> {
    /// Works until nothing is left or the steps run out: on `count` pieces and on what is left of them, which
    /// comes first where it becomes too much.
    fn run(&mut self, count: usize, piece: impl Fn(usize) -> Piece) -> Result<()> {
        for start in (0..count).step_by(BATCH) {
            self.batch(&(start..count.min(start + BATCH)).map(&piece).collect::<Vec<_>>())?;
            while self.waiting.len() >= MANY {
                self.last()?;
            }
        }
        // Should the steps run out, then at the smallest bounds.
        self.waiting.par_sort();
        while !self.waiting.is_empty() {
            self.last()?;
        }
        Ok(())
    }

    /// Works on the pieces that wait last.
    fn last(&mut self) -> Result<()> {
        let pieces = self.waiting.split_off(self.waiting.len().saturating_sub(BATCH));
        self.batch(&pieces)
    }

    /// Works on pieces in parallel, so that neither which of them see each other's findings nor the order of
    /// these depends on the number of threads.
    fn batch(&mut self, pieces: &[Piece]) -> Result<()> {
        // Without a step for each, they are only bounded.
        let steps = if self.progress.leave_out() { 0 } else { self.steps.min(BATCH_STEPS) / pieces.len() };
        let done: Vec<Chunk> = (pieces.par_chunks(pieces.len().div_ceil(CHUNKS)))
            .map(|pieces| {
                let mut chunk = Chunk { found: self.found, waiting: Vec::new(), steps: 0 };
                for piece in pieces {
                    self.progress.poll()?;
                    chunk.work(*piece, steps, &self.target);
                }
                Ok(chunk)
            })
            .collect::<Result<_>>()?;
        for chunk in done {
            self.found.join(&chunk.found);
            self.waiting.extend(chunk.waiting);
            self.steps -= chunk.steps;
        }
        Ok(())
    }
}

/// What one thread found.
struct Chunk {
    found: Found,
    waiting: Vec<Piece>,
    steps: usize,
}

impl Chunk {
    /// Takes at most this many steps on a piece and on what is left of it, the largest bounds first.
    fn work(&mut self, piece: Piece, steps: usize, target: &Target) {
        if steps == 0 {
            self.found.upper = self.found.upper.max(piece.bound(target));
            return;
        }
        let mut heap = BinaryHeap::from([piece]);
        for _ in 0..steps {
            let Some(piece) = heap.pop() else { return };
            self.steps += 1;
            piece.step(target, &mut self.found, &mut |part| heap.push(part));
        }
        self.waiting.extend(heap);
    }
}
