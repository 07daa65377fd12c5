//! Improvement of a connected mesh: better triangles ([`polish`]), a closer fit to the surface ([`fit`]),
//! then the places where mesh and surface are still far apart, one by one ([`reduce_outliers`]).
//!
//! All of them work on a [`ConstrainedMesh`], keep the number of vertices and the topology, take the surface
//! as a [`Target`], and give the same bytes for any number of threads.

mod cache;
mod constrained_mesh;
mod fit;
mod flip;
mod improve;
mod locked;
mod outliers;
mod quadric;
mod relax;
mod slide;
mod smooth;
mod star;
mod target;
mod worst;

pub use cache::MeshCache;
pub use constrained_mesh::{ConstrainedMesh, CurveEdge};
pub(crate) use fit::{FEW_FIT_ROUNDS, SOLVER_STEPS};
pub use fit::{FitCounts, FitOptions, fit};
pub(crate) use improve::{Pass, PassOptions, improve};
pub use outliers::{Outlier, OutlierOptions, ReducedOutliers, reduce_outliers};
pub use slide::SlidingCurve;
pub(crate) use target::SurfaceVertex;
pub use target::Target;

use glam::DVec3;

use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result};
use flip::flip_edges;
pub(crate) use flip::{angle_gain, has_no_wide_angle, keeps_direction};
use locked::Locked;
pub(crate) use quadric::{PulledSite, add_ridges, line_up, pull_sites};
pub(crate) use relax::folds_or_flattens;
use slide::{Aim, SlidingCurves};
pub(crate) use smooth::{is_to_be_smoothed, smooth};

/// Rounds of [`polish`] that are left when a run finishes early.
pub(crate) const FEW_ROUNDS: u32 = 4;
/// Sweeps over all edges before each relaxation.
const SWEEPS: u32 = 2;
/// Last rounds, in which flips serve the angles alone.
pub(crate) const ANGLE_ROUNDS: u32 = 3;
/// Minimum cosine between two triangles whose edge between held vertices may be flipped.
const FLAT: f64 = 0.9;
/// Passes over the worst triangles.
const WORST_PASSES: u32 = 6;

/// Settings of [`polish`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolishOptions {
    /// Rounds of flips and relaxation.
    pub rounds: u32,
    /// Weight of valence energy against the cotangents of the angles opposite an edge; with 0, flips serve
    /// Delaunay triangles only.
    pub valence_weight: f64,
    /// Whether no edge between two fixed vertices is flipped, as if no curves were known.
    pub keeps_chords: bool,
    /// Whether vertices on curves slide along them.
    pub slides: bool,
}

impl Default for PolishOptions {
    fn default() -> Self {
        Self { rounds: 10, valence_weight: 1.0, keeps_chords: false, slides: true }
    }
}

/// What [`polish`] did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Polished {
    /// Edges flipped.
    pub flips: usize,
    /// Moves of the relaxation, in all rounds, that were undone because a triangle would have folded or
    /// become flat.
    pub taken_back: usize,
    /// Moves that improved the worst triangles.
    pub lifted: usize,
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
    constrained: &mut ConstrainedMesh,
    target: &Target,
    options: &PolishOptions,
    progress: &ProgressToken,
) -> Result<Polished> {
    polish_beside(constrained, &[], target, options, progress)
}

/// Like [`polish`], but vertices that are `held` stay, with the edges between them at which the mesh turns.
pub(crate) fn polish_beside(
    constrained: &mut ConstrainedMesh,
    held: &[bool],
    target: &Target,
    options: &PolishOptions,
    progress: &ProgressToken,
) -> Result<Polished> {
    let mut half_edges = constrained.take_half_edges();
    let polished = polish_half_edges(&mut half_edges, (constrained, held), target, options, progress);
    constrained.keep_half_edges(half_edges);
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
    (constrained, held): (&mut ConstrainedMesh, &[bool]),
    target: &Target,
    options: &PolishOptions,
    progress: &ProgressToken,
) -> Result<Polished> {
    let mut polished = Polished::default();
    let mut curve_edges = constrained.kept_edges(options.keeps_chords);
    curve_edges.extend(held_edges(half_edges, &constrained.mesh.vertices, held));
    let sliding = if options.slides { constrained.sliding_curves.clone() } else { Vec::new() };
    let ConstrainedMesh { mesh, fixed, lengths, cache, .. } = &mut *constrained;
    let points = &mut mesh.vertices;
    let ranks = &mut cache.ranks.take(points.len());
    let is_held = |v: usize| held.get(v).copied().unwrap_or(false);
    let fixed: Vec<bool> = (0..points.len()).map(|v| is_fixed(half_edges, fixed, v) || is_held(v)).collect();
    let locked = Locked { fixed: &fixed, curve_edges: &curve_edges };
    let mut sliding_curves = SlidingCurves::new(sliding, points.len());
    let rounds = progress.at_most(FEW_ROUNDS, options.rounds);
    for round in 0..rounds {
        progress.done(f64::from(round) / f64::from(rounds))?;
        if round >= FEW_ROUNDS && progress.leave_out() {
            break;
        }
        let late = round + ANGLE_ROUNDS >= rounds;
        let valence_weight = if late { 0.0 } else { options.valence_weight };
        polished.flips += flip_edges(half_edges, points, locked, valence_weight, SWEEPS);
        polished.taken_back += relax::relax(half_edges, points, ranks, (&fixed, lengths), target);
        sliding_curves.slide(&half_edges.triangles, points, lengths, Aim::Even);
    }
    if rounds > 0 {
        sliding_curves.slide(&half_edges.triangles, points, lengths, Aim::Worst);
        if !curve_edges.is_empty() {
            polished.flips += flip_edges(half_edges, points, locked, 0.0, SWEEPS);
        }
        progress.done(1.0)?;
        polished.lifted = worst::improve(half_edges, points, ranks, &fixed, target, WORST_PASSES);
    }
    cache.ranks.keep(std::mem::take(ranks));
    if !sliding_curves.curves.is_empty() {
        constrained.slide_to(sliding_curves.curves);
    }
    Ok(polished)
}

/// Whether vertex `v` may not move: it is in `fixed`, on a boundary, or irregular.
pub(crate) fn is_fixed(half_edges: &HalfEdgeMesh, fixed: &[bool], v: usize) -> bool {
    half_edges.kind(v as u32) != VertexKind::Inner || fixed.get(v).copied().unwrap_or(false)
}

/// The cosine of the angle by which the mesh turns at the edge of `h`; `None` at a boundary.
fn turn_cosine(half_edges: &HalfEdgeMesh, points: &[DVec3], h: u32) -> Option<f64> {
    let normal = |h: u32| {
        doubled_normal(half_edges.triangles[h as usize / 3].map(|v| points[v as usize])).normalize_or_zero()
    };
    half_edges.twin(h).map(|twin| normal(h).dot(normal(twin)))
}

/// The edges between held vertices at which the mesh turns.
fn held_edges(half_edges: &HalfEdgeMesh, points: &[DVec3], held: &[bool]) -> Vec<(u32, u32)> {
    if held.is_empty() {
        return Vec::new();
    }
    (0..half_edges.half_edge_count())
        .map(|h| (h, half_edges.origin(h), half_edges.origin(next(h))))
        .filter(|(_, a, b)| held[*a as usize] && held[*b as usize])
        .filter(|(h, ..)| turn_cosine(half_edges, points, *h).is_some_and(|cosine| cosine < FLAT))
        .map(|(_, a, b)| edge_key(a, b))
        .collect()
}
