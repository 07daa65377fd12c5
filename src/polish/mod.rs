//! The last touch on a connected mesh: better triangles ([`polish`]), a closer fit ([`fit`]), then the places
//! that are still far off, one by one ([`reduce_outliers`]).
//!
//! All keep the number of vertices and the topology, work on one surface, the [`Target`], and give the same
//! bytes for any number of threads.

mod fit;
mod flip;
mod outliers;
mod relax;
mod slide;
mod worst;

pub use fit::{FitCounts, FitOptions, fit};
pub use outliers::{OutlierOptions, reduce_outliers};
pub use slide::SlidingCurve;

use std::sync::Arc;

use glam::DVec3;

use crate::mesh::bvh::Bvh;
use crate::mesh::correspondence::Search;
use crate::mesh::half_edge_mesh::{HalfEdgeMesh, VertexKind};
use crate::mesh::triangle::doubled_normal;
use crate::{ProgressToken, Result, TriMesh};
use flip::{Rule, flip_edges};
use slide::SlidingCurves;

/// Rounds of [`polish`] that are done even to finish early.
pub(crate) const FEW_ROUNDS: u32 = 4;
/// Sweeps over all edges before each relaxation.
const SWEEPS: u32 = 2;
/// Last rounds whose flips look at angles only.
const ANGLE_ROUNDS: u32 = 3;
/// Passes over the worst triangles.
const WORST_PASSES: u32 = 6;
/// Height over a triangle below which the closest point is taken to be on it, over the distance to its edges.
const LOW: f64 = 0.1;

/// The surface that a mesh is kept on.
#[derive(Debug, Clone)]
pub struct Target {
    bvh: Arc<Bvh>,
    /// Normals of the triangles, with the doubled area as length.
    normals: Arc<Vec<DVec3>>,
    /// Squared shortest height of each triangle.
    heights_sq: Vec<f64>,
    /// Its vertices.
    points: Vec<Point>,
    /// The patch of each triangle; empty if there is but one.
    patches: Vec<u32>,
}

/// A vertex of the surface.
#[derive(Debug, Clone, Copy)]
struct Point {
    at: DVec3,
    /// Sum of the doubled areas of its triangles along their normals.
    normal: DVec3,
    /// A third of the area of its triangles.
    area: f64,
}

impl Target {
    /// Prepares the surface, which must be in the frame of the meshes to come. Panics if an index is out of
    /// range.
    pub fn new(surface: &TriMesh) -> Self {
        let corners = |t| surface.corners(t);
        let normals: Vec<DVec3> = (0..surface.triangles.len()).map(|t| doubled_normal(corners(t))).collect();
        let heights_sq = normals
            .iter()
            .enumerate()
            .map(|(t, n)| {
                let [a, b, c] = corners(t);
                let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
                n.length_squared() / longest.max(f64::MIN_POSITIVE)
            })
            .collect();
        let point = |at: &DVec3| Point { at: *at, normal: DVec3::ZERO, area: 0.0 };
        let mut points: Vec<Point> = surface.vertices.iter().map(point).collect();
        for (triangle, normal) in surface.triangles.iter().zip(&normals) {
            for v in triangle {
                points[*v as usize].normal += *normal;
                points[*v as usize].area += normal.length() / 6.0;
            }
        }
        Self {
            bvh: Arc::new(Bvh::new(surface)),
            normals: Arc::new(normals),
            heights_sq,
            points,
            patches: Vec::new(),
        }
    }

    /// With the patch of each triangle: what is in a patch stays there.
    #[must_use]
    pub fn in_patches(self, patches: Vec<u32>) -> Self {
        Self { patches, ..self }
    }

    /// The triangles, to be searched for something else.
    pub(crate) fn searched(&self) -> Search {
        Search { bvh: Arc::clone(&self.bvh), normals: Arc::clone(&self.normals) }
    }

    /// The closest point of all, with its triangle; `None` for a point that is not finite.
    pub fn nearest(&self, p: DVec3) -> Option<(DVec3, u32)> {
        self.bvh.closest(p).map(|closest| (closest.point, closest.triangle))
    }

    /// The closest point of those of a patch's triangles that face as `normal` does.
    fn closest(&self, p: DVec3, normal: DVec3, patch: u32, rank: &mut usize) -> Option<DVec3> {
        self.closest_with_normal(p, normal, patch, rank).map(|(point, _)| point)
    }

    /// As [`Target::closest`], with the unit normal of the triangle it lies on.
    ///
    /// A point close above the inside of the triangle at `rank` is taken to have its closest point there,
    /// which saves the search; only sheets closer to each other than that could tell otherwise.
    fn closest_with_normal(
        &self,
        p: DVec3,
        normal: DVec3,
        patch: u32,
        rank: &mut usize,
    ) -> Option<(DVec3, DVec3)> {
        if normal == DVec3::ZERO {
            return None;
        }
        let accept = |t: u32| {
            self.normals[t as usize].dot(normal) > 0.0
                && self.patches.get(t as usize).is_none_or(|of_triangle| *of_triangle == patch)
        };
        let near = self.bvh.closest_at(*rank, p).filter(|near| {
            let inside = near.barycentric.iter().fold(1.0, |a: f64, b| a.min(*b));
            accept(near.triangle)
                && near.distance_sq <= LOW * LOW * inside * inside * self.heights_sq[near.triangle as usize]
        });
        let found = near.or_else(|| self.bvh.closest_accepted(p, rank, accept))?;
        Some((found.point, self.normals[found.triangle as usize].normalize_or_zero()))
    }
}

/// Settings of [`polish`].
#[derive(Debug, Clone, PartialEq)]
pub struct PolishOptions {
    /// Rounds of flips and relaxation.
    pub rounds: u32,
    /// What one unit of valence energy is worth against the cotangents of the angles opposite an edge; 0
    /// flips for Delaunay triangles only.
    pub valence_weight: f64,
    /// Vertices that stay where they are, besides those on a boundary; vertices beyond the end of the list
    /// are free. An edge between two that stay is not flipped.
    pub fixed: Vec<bool>,
    /// The patch of each triangle, in which it stays; nothing if there is but one.
    pub patches: Vec<u32>,
    /// Curves along which fixed vertices may slide.
    pub sliding_curves: Vec<SlidingCurve>,
    /// The edge length wanted at each vertex, relative to others; nothing if they are equal.
    pub lengths: Vec<f64>,
}

impl Default for PolishOptions {
    fn default() -> Self {
        Self {
            rounds: 10,
            valence_weight: 1.0,
            fixed: Vec::new(),
            patches: Vec::new(),
            sliding_curves: Vec::new(),
            lengths: Vec::new(),
        }
    }
}

/// What [`polish`] did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PolishCounts {
    /// Edges flipped.
    pub flips: usize,
    /// Moves of the relaxation, over all rounds, that were taken back because a triangle would have suffered.
    pub taken_back: usize,
    /// Moves for the sake of the worst triangles.
    pub lifted: usize,
}

/// Improves the triangles of `mesh` by edge flips and by moving vertices over `target`.
///
/// Vertices on a boundary and irregular ones (several fans, no triangles) stay, and boundary edges are not
/// flipped. No flip repeats an edge; no triangle is turned over or flattened. To finish early, it does
/// [`FEW_ROUNDS`] rounds. Panics if an index is out of range.
///
/// # Errors
/// [`crate::Error::Cancelled`]; what was done until then stays.
pub fn polish(
    mesh: &mut TriMesh,
    target: &Target,
    options: &PolishOptions,
    progress: &ProgressToken,
) -> Result<PolishCounts> {
    let mut links =
        HalfEdgeMesh::new(std::mem::take(&mut mesh.triangles), mesh.vertices.len(), &options.patches);
    let counts = polish_links(&mut links, &mut mesh.vertices, target, options, progress);
    mesh.triangles = links.triangles;
    counts
}

fn polish_links(
    links: &mut HalfEdgeMesh,
    points: &mut Vec<DVec3>,
    target: &Target,
    options: &PolishOptions,
    progress: &ProgressToken,
) -> Result<PolishCounts> {
    let mut counts = PolishCounts::default();
    let fixed: Vec<bool> = (0..points.len()).map(|v| is_fixed(links, &options.fixed, v)).collect();
    let mut ranks = vec![0; points.len()];
    let mut sliding_curves = SlidingCurves::new(&options.sliding_curves, points.len());
    let rounds = progress.at_most(FEW_ROUNDS, options.rounds);
    for round in 0..rounds {
        progress.done(f64::from(round) / f64::from(rounds))?;
        if round >= FEW_ROUNDS && progress.leave_out() {
            break;
        }
        let late = round + ANGLE_ROUNDS >= rounds;
        let rule = Rule { valence_weight: if late { 0.0 } else { options.valence_weight } };
        counts.flips += flip_edges(links, points, &fixed, &rule, SWEEPS);
        counts.taken_back += relax::relax(links, points, &mut ranks, (&fixed, &options.lengths), target);
        sliding_curves.slide(&links.triangles, points, &options.lengths, false);
    }
    if rounds > 0 {
        sliding_curves.slide(&links.triangles, points, &options.lengths, true);
        progress.done(1.0)?;
        counts.lifted = worst::improve(links, points, &mut ranks, &fixed, target, WORST_PASSES);
    }
    Ok(counts)
}

/// Whether vertex `v` may not move: asked for, on a boundary, or without one closed fan.
fn is_fixed(links: &HalfEdgeMesh, fixed: &[bool], v: usize) -> bool {
    links.kind(v as u32) != VertexKind::Inner || fixed.get(v).copied().unwrap_or(false)
}
