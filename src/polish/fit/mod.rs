//! Fit: vertices move so that the faces, not the vertices, lie close to the surface.
//!
//! Distances of sample points on the faces to their closest points on the surface, and of the surface's
//! vertices to their closest points on the faces, are made small in the least-squares sense, weighted by
//! area. Moves across the surface cost nothing but what neighbours would move differently: so vertices slide
//! to where the surface bends, and whole neighbourhoods go along.

mod samples;
mod solve;

use glam::DVec3;
use rayon::prelude::*;

use super::relax::{CHUNK, spoils, vertex_normal};
use super::{Target, is_fixed};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::quality::TriangleQuality;
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result, TriMesh};
use samples::{Ranks, Sheet};
use solve::System;

/// What a move costs, over what a distance does.
const STIFFNESS: f64 = 1e-2;
/// What the difference of two neighbours' moves costs, in each of their triangles, over what a distance does.
const COUPLING: f64 = 0.07;
/// Steps of the solver.
const SOLVER_STEPS: u32 = 12;
/// Largest move over the size of the faces around (the square root of a third of their area).
const MAX_MOVE: f64 = 0.5;
/// Times that moves at suffering triangles are halved before they become 0.
const HALVINGS: u32 = 4;
/// Times that this may spread before all moves become 0.
const STOPS: u32 = 20;
/// Degrees that an angle may lose below the bound, or gain above 90, in a round.
const LOSS: f64 = 0.5;

/// Share of a round that measuring takes,
const MEASURED: f64 = 0.7;
/// and solving with it.
const SOLVED: f64 = 0.85;

/// Settings of [`fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// Times that distances are measured and vertices moved.
    pub rounds: u32,
    /// Angles below this many degrees, or below the smallest that there is, may lose half a degree in a round
    /// at most, and nothing below that smallest.
    pub min_angle: f64,
    /// Vertices that stay where they are, besides those on a boundary; vertices beyond the end of the list
    /// are free.
    pub fixed: Vec<bool>,
    /// The patch of each triangle, in which it stays; nothing if there is but one.
    pub patches: Vec<u32>,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { rounds: 2, min_angle: 38.0, fixed: Vec::new(), patches: Vec::new() }
    }
}

/// What [`fit`] met.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FitCounts {
    /// Vertices, counted in each round, that did not go all the way because a triangle would have suffered.
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
    mesh: &mut TriMesh,
    target: &Target,
    options: &FitOptions,
    progress: &ProgressToken,
) -> Result<FitCounts> {
    let links = HalfEdgeMesh::new(std::mem::take(&mut mesh.triangles), mesh.vertices.len(), &options.patches);
    let counts = fit_points(&links, &mut mesh.vertices, target, options, progress);
    mesh.triangles = links.triangles;
    counts
}

fn fit_points(
    links: &HalfEdgeMesh,
    points: &mut [DVec3],
    target: &Target,
    options: &FitOptions,
    progress: &ProgressToken,
) -> Result<FitCounts> {
    let mut counts = FitCounts::default();
    let fixed: Vec<bool> = (0..points.len()).map(|v| is_fixed(links, &options.fixed, v)).collect();
    let mut ranks = Ranks::new(links.triangles.len(), fixed.len(), target);
    for round in 0..options.rounds {
        let [begin, end] = [round, round + 1].map(|k| f64::from(k) / f64::from(options.rounds));
        let progress = progress.part(begin, end);
        progress.done(0.0)?;
        let normals: Vec<DVec3> = (0..points.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| if fixed[v as usize] { DVec3::ZERO } else { vertex_normal(links, points, v) })
            .collect();
        let sheet = Sheet { links, points, normals: &normals };
        let areas = sheet.areas();
        let thirds = sheet.thirds(&areas);
        let samples = sheet.measure(&thirds, target, &mut ranks, &progress.part(0.0, MEASURED))?;
        let stiffness: Vec<f64> = thirds.iter().map(|third| STIFFNESS * third).collect();
        let coupling: Vec<f64> = areas.iter().map(|area| COUPLING * area).collect();
        let system =
            System { links, samples: &samples, stiffness: &stiffness, coupling: &coupling, fixed: &fixed };
        let mut moves = system.solve(SOLVER_STEPS);
        progress.done(SOLVED)?;
        counts.held += sheet.limit(&thirds, options.min_angle, &mut moves);
        for (p, step) in points.iter_mut().zip(&moves) {
            *p += *step;
        }
    }
    Ok(counts)
}

impl Sheet<'_> {
    /// Makes moves smaller where they are out of proportion or a triangle would suffer; gives the number of
    /// the latter.
    fn limit(&self, thirds: &[f64], min_angle: f64, moves: &mut [DVec3]) -> usize {
        for (step, area) in moves.iter_mut().zip(thirds) {
            *step = step.clamp_length_max(MAX_MOVE * area.sqrt());
        }
        let angles = self.links.triangles.par_iter().with_min_len(CHUNK);
        let (smallest, largest) = angles
            .map(|t| TriangleQuality::new(self.corners(*t)))
            .map(|shape| (shape.min_angle(), shape.max_angle()))
            .reduce(|| (f64::INFINITY, 90.0), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let bounds = Bounds { smallest, floor: smallest.max(min_angle), largest };
        let mut held = vec![false; self.points.len()];
        // Only what a change of moves can have changed is looked at again.
        let mut changed = vec![true; self.points.len()];
        for round in 0..=HALVINGS + STOPS {
            let suffering: Vec<[u32; 3]> = self
                .links
                .triangles
                .par_iter()
                .with_min_len(CHUNK)
                .filter(|triangle| triangle.iter().any(|v| changed[*v as usize]))
                .filter(|triangle| self.suffers(**triangle, moves, &bounds))
                .copied()
                .collect();
            if suffering.is_empty() {
                break;
            }
            if round == HALVINGS + STOPS {
                moves.fill(DVec3::ZERO);
            }
            changed.fill(false);
            let mut vertices: Vec<u32> = suffering.into_iter().flatten().collect();
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

    /// Whether the moves fold a triangle or make its angles worse than the bounds allow.
    fn suffers(&self, triangle: [u32; 3], moves: &[DVec3], bounds: &Bounds) -> bool {
        let old = self.corners(triangle);
        let new = triangle.map(|v| v as usize).map(|v| self.points[v] + moves[v]);
        if new == old {
            return false;
        }
        let (before, after) = (TriangleQuality::new(old), TriangleQuality::new(new));
        let ((small, large), (was_small, was_large)) =
            ((after.min_angle(), after.max_angle()), (before.min_angle(), before.max_angle()));
        let flatter = small < bounds.floor && small < bounds.smallest.max(was_small - LOSS).min(was_small);
        let wider = large > 90.0 && large > bounds.largest.min(was_large + LOSS).max(was_large);
        flatter || wider || spoils(old, new, doubled_normal(old))
    }
}

/// What the angles of a mesh may become, in degrees.
struct Bounds {
    /// The smallest angle that there is, or was before the moves.
    smallest: f64,
    /// An angle below this may lose little.
    floor: f64,
    /// The largest angle that there is, or 90.
    largest: f64,
}
