//! Improvement of a connected mesh: better triangles ([`polish`]), a closer fit to the surface ([`fit`]),
//! then the places where mesh and surface are still far apart, one by one ([`reduce_outliers`]).
//!
//! All of them keep the number of vertices and the topology, take the surface as a [`Target`], and give the
//! same bytes for any number of threads.

mod cache;
mod constrained_mesh;
mod fit;
mod flip;
mod locked;
mod outliers;
mod relax;
mod slide;
mod target;
mod worst;

pub use cache::MeshCache;
pub use constrained_mesh::{ConstrainedMesh, CurveEdge};
pub(crate) use fit::{FEW_FIT_ROUNDS, SOLVER_STEPS};
pub use fit::{FitCounts, FitOptions, fit};
pub use outliers::{Outlier, OutlierOptions, ReducedOutliers, reduce_outliers};
pub use slide::SlidingCurve;
pub(crate) use target::SurfaceVertex;
pub use target::Target;

use glam::DVec3;
use std::collections::HashSet;

use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::{ProgressToken, Result, TriMesh};
use flip::flip_edges;
pub(crate) use flip::{angle_gain, keeps_shape};
use locked::Locked;
pub(crate) use relax::folds_or_flattens;
use slide::SlidingCurves;

/// Rounds of [`polish`] that are left when a run finishes early.
pub(crate) const FEW_ROUNDS: u32 = 4;
/// Sweeps over all edges before each relaxation.
const SWEEPS: u32 = 2;
/// Last rounds, in which flips serve the angles alone.
pub(crate) const ANGLE_ROUNDS: u32 = 3;
/// Passes over the worst triangles.
const WORST_PASSES: u32 = 6;

/// Settings of [`polish`].
#[derive(Debug, Clone, PartialEq)]
pub struct PolishOptions {
    /// Rounds of flips and relaxation.
    pub rounds: u32,
    /// Weight of valence energy against the cotangents of the angles opposite an edge; with 0, flips serve
    /// Delaunay triangles only.
    pub valence_weight: f64,
    /// Whether each vertex stays where it is, as boundary vertices do; vertices beyond the end of the list do
    /// not.
    pub fixed: Vec<bool>,
    /// Edges on curves, the smaller vertex first, which are not flipped. If there are none, no edge between
    /// two fixed vertices is.
    pub curve_edges: HashSet<(u32, u32)>,
    /// The patch of each triangle, in which it stays; empty if there is only one.
    pub patches: Vec<u32>,
    /// Curves along which fixed vertices may slide.
    pub sliding_curves: Vec<SlidingCurve>,
    /// The relative target edge length at each vertex; empty if they are all equal.
    pub lengths: Vec<f64>,
}

impl Default for PolishOptions {
    fn default() -> Self {
        Self {
            rounds: 10,
            valence_weight: 1.0,
            fixed: Vec::new(),
            curve_edges: HashSet::new(),
            patches: Vec::new(),
            sliding_curves: Vec::new(),
            lengths: Vec::new(),
        }
    }
}

/// What [`polish`] did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polished {
    /// Edges flipped.
    pub flips: usize,
    /// Moves of the relaxation, in all rounds, that were undone because a triangle would have folded or
    /// become flat.
    pub taken_back: usize,
    /// Moves that improved the worst triangles.
    pub lifted: usize,
    /// [`PolishOptions::sliding_curves`] with the vertices where they are now.
    pub sliding_curves: Vec<SlidingCurve>,
}

/// Improves the triangles of `mesh` by edge flips and by moving vertices over `target`.
///
/// Vertices on a boundary and irregular ones (several fans, no triangles) stay, and boundary edges are not
/// flipped. No flip repeats an edge; no triangle is turned over or flattened. To finish early, only the first
/// four rounds are done. Panics if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`]; what was done until then stays.
pub fn polish(
    mesh: &mut TriMesh,
    target: &Target,
    options: &PolishOptions,
    cache: &mut MeshCache,
    progress: &ProgressToken,
) -> Result<Polished> {
    let triangles = std::mem::take(&mut mesh.triangles);
    let mut half_edges = cache.take(triangles, mesh.vertices.len(), &options.patches);
    let mut ranks = cache.ranks.take(mesh.vertices.len());
    let on = (&mut mesh.vertices, ranks.as_mut_slice());
    let polished = polish_half_edges(&mut half_edges, on, target, options, progress);
    cache.ranks.keep(ranks);
    mesh.triangles = cache.keep(half_edges);
    polished
}

/// Moves vertices of the worst triangles of a mesh that was polished elsewhere, and returns how many. All
/// that are on a boundary or irregular must be `fixed`.
pub(crate) fn improve_worst(
    half_edges: &HalfEdgeMesh,
    points: &mut [DVec3],
    fixed: &[bool],
    target: &Target,
) -> usize {
    worst::improve(half_edges, points, &mut vec![0; points.len()], fixed, target, WORST_PASSES)
}

fn polish_half_edges(
    half_edges: &mut HalfEdgeMesh,
    (points, ranks): (&mut Vec<DVec3>, &mut [usize]),
    target: &Target,
    options: &PolishOptions,
    progress: &ProgressToken,
) -> Result<Polished> {
    let mut polished = Polished::default();
    let fixed: Vec<bool> = (0..points.len()).map(|v| is_fixed(half_edges, &options.fixed, v)).collect();
    let locked = Locked { fixed: &fixed, curve_edges: &options.curve_edges };
    let mut sliding_curves = SlidingCurves::new(&options.sliding_curves, points.len());
    let rounds = progress.at_most(FEW_ROUNDS, options.rounds);
    for round in 0..rounds {
        progress.done(f64::from(round) / f64::from(rounds))?;
        if round >= FEW_ROUNDS && progress.leave_out() {
            break;
        }
        let late = round + ANGLE_ROUNDS >= rounds;
        let valence_weight = if late { 0.0 } else { options.valence_weight };
        polished.flips += flip_edges(half_edges, points, locked, valence_weight, SWEEPS);
        polished.taken_back += relax::relax(half_edges, points, ranks, (&fixed, &options.lengths), target);
        sliding_curves.slide(&half_edges.triangles, points, &options.lengths, false);
    }
    if rounds > 0 {
        sliding_curves.slide(&half_edges.triangles, points, &options.lengths, true);
        if !options.curve_edges.is_empty() {
            polished.flips += flip_edges(half_edges, points, locked, 0.0, SWEEPS);
        }
        progress.done(1.0)?;
        polished.lifted = worst::improve(half_edges, points, ranks, &fixed, target, WORST_PASSES);
    }
    polished.sliding_curves = sliding_curves.curves;
    Ok(polished)
}

/// Whether vertex `v` may not move: it is in `fixed`, on a boundary, or irregular.
pub(crate) fn is_fixed(half_edges: &HalfEdgeMesh, fixed: &[bool], v: usize) -> bool {
    half_edges.kind(v as u32) != VertexKind::Inner || fixed.get(v).copied().unwrap_or(false)
}
