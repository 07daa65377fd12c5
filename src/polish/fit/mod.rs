//! Fit: moves vertices so that the faces, not the vertices, lie close to the surface.
//!
//! Distances from sample points on the faces to the surface, and from the surface's vertices to the faces,
//! are minimized in the least-squares sense, weighted by area. Motion along the surface costs only as far as
//! neighbours move differently, so vertices slide to where the surface bends, and their neighbourhoods
//! follow.

mod samples;
mod solve;

use glam::DVec3;
use rayon::prelude::*;

use super::relax::{CHUNK, folds_or_flattens, vertex_normal};
use super::{ConstrainedMesh, Target, is_fixed};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::quality::{are_clearly_acute, cosine_clear_of, extreme_angles, extreme_cosines_of};
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result};
use samples::{FitMesh, Searches};
use solve::System;

/// Weight of squared moves against squared distances.
const STIFFNESS: f64 = 1e-2;
/// Weight of squared differences between neighbours' moves, in each of their triangles.
const COUPLING: f64 = 0.07;
/// Steps of the solver; with more, no distance gets smaller (docs/experiments.md).
pub(crate) const SOLVER_STEPS: u32 = 8;
/// Rounds of a fit that is to finish early.
pub(crate) const FEW_FIT_ROUNDS: u32 = 1;
/// Largest move over the size of the faces around (the square root of a third of their area).
const MAX_MOVE: f64 = 0.5;
/// Times that moves at spoiled triangles are halved before they are set to 0.
const HALVINGS: u32 = 4;
/// Times that setting moves to 0 may spread before all moves are.
const STOPS: u32 = 20;
/// Degrees that an angle below the bound may lose, or one above 90 gain, in a round.
const LOSS: f64 = 0.5;

/// Share of a round that is done after measuring.
const MEASURED: f64 = 0.7;
/// Share of a round that is done after solving.
const SOLVED: f64 = 0.85;

/// Settings of [`fit`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Number of rounds, each of which measures distances and moves vertices.
    pub rounds: u32,
    /// In degrees: angles below this, or below the mesh's smallest angle, lose at most half a degree in a
    /// round, and never fall below that smallest angle.
    pub min_angle: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { rounds: 2, min_angle: 38.0 }
    }
}

/// What [`fit`] did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FitCounts {
    /// Moves, in all rounds, that were shortened because a triangle would have been spoiled.
    pub held: usize,
}

/// Moves the vertices of `mesh` so that its faces fit `target`; vertices on a boundary and irregular ones
/// stay.
///
/// No triangle folds over or gets a smaller angle than the options allow. The result does not depend on the
/// number of threads. Panics if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`]; the rounds that were completed until then stay.
pub fn fit(
    constrained: &mut ConstrainedMesh,
    target: &Target,
    options: &FitOptions,
    progress: &ProgressToken,
) -> Result<FitCounts> {
    let half_edges = constrained.take_half_edges();
    let counts = fit_points(&half_edges, constrained, target, options, progress);
    constrained.keep_half_edges(half_edges);
    counts
}

fn fit_points(
    half_edges: &HalfEdgeMesh,
    constrained: &mut ConstrainedMesh,
    target: &Target,
    options: &FitOptions,
    progress: &ProgressToken,
) -> Result<FitCounts> {
    let mut counts = FitCounts::default();
    let ConstrainedMesh { mesh, fixed, cache, .. } = constrained;
    let points = &mut mesh.vertices;
    let fixed: Vec<bool> = (0..points.len()).map(|v| is_fixed(half_edges, fixed, v)).collect();
    let corners = cache.ranks.take(fixed.len());
    let inward = cache.below.take(target.vertices.len());
    let mut searches = Searches::new(half_edges.triangles.len(), corners, inward);
    for round in 0..options.rounds {
        let [begin, end] = [round, round + 1].map(|k| f64::from(k) / f64::from(options.rounds));
        let progress = progress.part(begin, end);
        progress.done(0.0)?;
        if round >= FEW_FIT_ROUNDS && progress.leave_out() {
            break;
        }
        let normals: Vec<DVec3> = (0..points.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| if fixed[v as usize] { DVec3::ZERO } else { vertex_normal(half_edges, points, v) })
            .collect();
        let state = FitMesh { half_edges, points, normals: &normals };
        let areas = state.areas();
        let thirds = state.thirds(&areas);
        let samples =
            state.measure(&thirds, target, (&mut searches, cache), &progress.part(0.0, MEASURED))?;
        let stiffness: Vec<f64> = thirds.iter().map(|third| STIFFNESS * third).collect();
        let coupling: Vec<f64> = areas.iter().map(|area| COUPLING * area).collect();
        let system = System {
            half_edges,
            samples: &samples,
            stiffness: &stiffness,
            coupling: &coupling,
            fixed: &fixed,
        };
        let mut moves = system.solve(SOLVER_STEPS);
        progress.done(SOLVED)?;
        counts.held += state.limit(&thirds, options.min_angle, &mut moves);
        for (p, step) in points.iter_mut().zip(&moves) {
            *p += *step;
        }
    }
    cache.ranks.keep(searches.corners);
    cache.below.keep(searches.inward);
    Ok(counts)
}

impl FitMesh<'_> {
    /// Shortens moves that are too long or would spoil a triangle; returns the number of the latter.
    fn limit(&self, thirds: &[f64], min_angle: f64, moves: &mut [DVec3]) -> usize {
        for (step, area) in moves.iter_mut().zip(thirds) {
            *step = step.clamp_length_max(MAX_MOVE * area.sqrt());
        }
        let triangles = self.half_edges.triangles.par_iter().with_min_len(CHUNK);
        // The larger a cosine, the smaller the angle.
        let cosines = triangles
            .map(|t| extreme_cosines_of(self.corners(*t)))
            .reduce(|| [-1.0, 1.0], |a, b| [a[0].max(b[0]), a[1].min(b[1])]);
        let [smallest, largest] = cosines.map(|cosine| cosine.acos().to_degrees());
        let floor = smallest.max(min_angle);
        let bounds =
            Bounds { smallest, floor, clear_of_floor: cosine_clear_of(floor), largest: largest.max(90.0) };
        let mut held = vec![false; self.points.len()];
        // Only triangles with changed moves are checked again.
        let mut changed = vec![true; self.points.len()];
        for round in 0..=HALVINGS + STOPS {
            let spoiled: Vec<[u32; 3]> = self
                .half_edges
                .triangles
                .par_iter()
                .with_min_len(CHUNK)
                .filter(|triangle| triangle.iter().any(|v| changed[*v as usize]))
                .filter(|triangle| self.is_spoiled(**triangle, moves, &bounds))
                .copied()
                .collect();
            if spoiled.is_empty() {
                break;
            }
            if round == HALVINGS + STOPS {
                moves.fill(DVec3::ZERO);
            }
            changed.fill(false);
            let mut vertices: Vec<u32> = spoiled.into_iter().flatten().collect();
            vertices.sort_unstable();
            vertices.dedup();
            for v in vertices {
                moves[v as usize] *= if round < HALVINGS { 0.5 } else { 0.0 };
                held[v as usize] = true;
                changed[v as usize] = true;
            }
        }
        held.iter().filter(|held| **held).count()
    }

    /// Whether the moves fold or flatten a triangle, or make its angles worse than the bounds allow.
    fn is_spoiled(&self, triangle: [u32; 3], moves: &[DVec3], bounds: &Bounds) -> bool {
        let old = self.corners(triangle);
        let new = triangle.map(|v| v as usize).map(|v| self.points[v] + moves[v]);
        if new == old {
            return false;
        }
        let is_worse = || {
            let ([was_small, was_large], [small, large]) = (extreme_angles(old), extreme_angles(new));
            let flatter =
                small < bounds.floor && small < bounds.smallest.max(was_small - LOSS).min(was_small);
            flatter || (large > 90.0 && large > bounds.largest.min(was_large + LOSS).max(was_large))
        };
        (!are_clearly_acute(new, bounds.clear_of_floor) && is_worse())
            || folds_or_flattens(old, new, doubled_normal(old))
    }
}

/// Bounds of the angles of a mesh, in degrees.
struct Bounds {
    /// The smallest angle before the moves.
    smallest: f64,
    /// Angles below this may lose little.
    floor: f64,
    /// Angles whose cosine is below this are clearly above `floor`.
    clear_of_floor: f64,
    /// The largest angle before the moves, at least 90.
    largest: f64,
}
