//! Fit: vertices move so that the faces, not the vertices, lie close to the surface.
//!
//! Distances of sample points on the faces to their closest points on the surface, and of the surface's vertices to their
//! closest points on the faces, are made small in the least-squares sense, weighted by area. Moves across the surface cost
//! nothing but what neighbours would move differently: so vertices slide to where the surface bends, and whole
//! neighbourhoods go along.

mod samples;
mod solve;

use glam::DVec3;
use rayon::prelude::*;

use super::relax::{CHUNK, spoils, vertex_normal};
use super::{Target, is_fixed};
use crate::TriMesh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::quality::TriangleQuality;
use crate::mesh::triangle::doubled_normal;
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
    /// Angles below this many degrees, or below the smallest that there is, may lose half a degree in a round at most,
    /// and nothing below that smallest.
    pub min_angle: f64,
    /// Vertices that stay where they are, besides those on a boundary; vertices beyond the end of the list are free.
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

/// Moves the vertices of `mesh` so that its faces fit `target`; vertices on a boundary and irregular ones stay.
///
/// No triangle folds over or gets a smaller angle than the options allow. The result does not depend on the number of
/// threads. Panics if an index is out of range.
pub fn fit(mesh: &mut TriMesh, target: &Target, options: &FitOptions) -> FitCounts {
    fit_while(mesh, target, options, &mut |_| true)
}

/// As [`fit`], as long as `go_on` agrees: it is asked several times a round, with the share of the work that is done. Rounds
/// that were done whole stay.
pub fn fit_while(
    mesh: &mut TriMesh,
    target: &Target,
    options: &FitOptions,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> FitCounts {
    let mut counts = FitCounts::default();
    let links = HalfEdgeMesh::new(std::mem::take(&mut mesh.triangles), mesh.vertices.len(), &options.patches);
    let fixed: Vec<bool> = (0..mesh.vertices.len()).map(|v| is_fixed(&links, &options.fixed, v)).collect();
    let mut ranks = Ranks::new(links.triangles.len(), fixed.len(), target);
    for round in 0..options.rounds {
        let mut go_on = |done: f64| go_on((f64::from(round) + done) / f64::from(options.rounds));
        if !go_on(0.0) {
            break;
        }
        let normals: Vec<DVec3> = (0..mesh.vertices.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| if fixed[v as usize] { DVec3::ZERO } else { vertex_normal(&links, &mesh.vertices, v) })
            .collect();
        let sheet = Sheet { links: &links, points: &mesh.vertices, normals: &normals };
        let areas = sheet.areas();
        let thirds = sheet.thirds(&areas);
        let Some(samples) = sheet.measure(&thirds, target, &mut ranks, &mut go_on) else { break };
        let stiffness: Vec<f64> = thirds.iter().map(|third| STIFFNESS * third).collect();
        let coupling: Vec<f64> = areas.iter().map(|area| COUPLING * area).collect();
        let system = System {
            links: &links,
            samples: &samples,
            stiffness: &stiffness,
            coupling: &coupling,
            fixed: &fixed,
        };
        if !go_on(MEASURED) {
            break;
        }
        let mut moves = system.solve(SOLVER_STEPS);
        if !go_on(SOLVED) {
            break;
        }
        counts.held += sheet.limit(&thirds, options.min_angle, &mut moves);
        for (p, step) in mesh.vertices.iter_mut().zip(&moves) {
            *p += *step;
        }
    }
    mesh.triangles = links.triangles;
    counts
}

impl Sheet<'_> {
    /// Makes moves smaller where they are out of proportion or a triangle would suffer; gives the number of the
    /// latter.
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
