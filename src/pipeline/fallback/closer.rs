//! A component that melts where its edges are to be even, made again by operations that keep it close to its
//! surface.

use super::remesh::{Before, ComponentTarget, left_out, polish_component};
use crate::local::LocalSurface;
use crate::mesh::distance::rms_distance;
use crate::mesh::features::{Curve, Features};
use crate::mesh::half_edges::{EdgeTable, HalfEdge};
use crate::mesh::quality::quality;
use crate::mesh::spacing;
use crate::mesh::triangle::{angle_at_first, doubled_normal};
use crate::pipeline::outcome::SLIVER;
use crate::polish::{ConstrainedMesh, Target};
use crate::{ProgressToken, Result, TriMesh};
use std::f64::consts::TAU;

/// A mesh has melted if its root mean square distance from the surface is larger, in edge lengths.
pub(crate) const MELTED: f64 = 0.04;
/// And larger than this many times what the curvature of the surface alone accounts for.
const BEYOND_CURVATURE: f64 = 1.2;
/// That of a closer one is at most this many times as large.
pub(crate) const CLOSER: f64 = 0.6;
/// Meshes of more vertices are not made, nor of surfaces with more than [`FINER`] times as many.
const MOST_VERTICES: usize = 10_000;
/// See [`MOST_VERTICES`].
const FINER: usize = 8;
/// Vertices stay in the polish where an edge turns by more than this many degrees: what is no curve would be
/// rounded.
const BENT: f64 = 40.0;

/// What a component is made again from.
pub(super) struct Closer<'a> {
    pub before: &'a Before<'a>,
    pub features: &'a Features,
    /// Relative target edge lengths at the vertices; empty if they are all equal.
    pub lengths: &'a [f64],
    /// The surface in the patches of its features.
    pub on: &'a Target,
    pub target: &'a ComponentTarget<'a>,
}

impl Closer<'_> {
    /// A mesh that is much closer to the surface than one that has melted, and has no more faults;
    /// `None` if there is none, the mesh is close enough, or edges are not to be equally long.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn than(
        &self,
        mesh: &TriMesh,
        guarded: bool,
        progress: &ProgressToken,
    ) -> Result<Option<ConstrainedMesh>> {
        let (surface, vertices) = (self.before.surface, self.target.vertices);
        let may_be = may_come_closer(surface, vertices)
            && self.lengths.is_empty()
            && self.target.feature_angle < 180.0;
        if !may_be || progress.leave_out() {
            return Ok(None);
        }
        let melted = rms_distance(mesh, surface, progress)?;
        let edge = spacing(surface.area(), vertices);
        let forced = BEYOND_CURVATURE * chord_distance(surface, self.features, edge);
        if melted <= forced.max(MELTED * edge) {
            return Ok(None);
        }
        let Some(made) = self.made(guarded, progress)? else { return Ok(None) };
        let farthest = |mesh: &TriMesh| -> Result<f64> {
            let left_out = left_out(surface, mesh, self.lengths, self.target.spacing, progress)?;
            Ok(left_out.first().map_or(0.0, |(distance, _)| *distance))
        };
        let smallest = |mesh: &TriMesh| quality(mesh).map_or(0.0, |quality| quality.min_angle);
        let is_better = rms_distance(&made.mesh, surface, progress)? <= CLOSER * melted
            && farthest(&made.mesh)? <= farthest(mesh)?
            && smallest(&made.mesh) >= smallest(mesh).min(SLIVER);
        Ok(is_better.then_some(made))
    }

    /// A polished mesh that is close to the surface; `None` if there is none. If `guarded`, the first try is
    /// guarded, too; otherwise only a second one, after new intersections.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn made(&self, guarded: bool, progress: &ProgressToken) -> Result<Option<ConstrainedMesh>> {
        let Self { before, features, lengths, on, target } = *self;
        let (surface, wanted) = ((before.surface, on), (lengths, target.vertices));
        let start = LocalSurface::new_close(surface, features, wanted, progress)?;
        for guarded in [guarded, true] {
            let mut local = start.remeshed_closely(guarded, progress)?;
            // Other than those if the work is to finish early.
            if local.mesh.vertices.len() != target.vertices {
                break;
            }
            let fixed = local.fixed.clone();
            fix_bent(&mut local);
            if let Some(polished) = polish_component(local, before, on, target, progress)? {
                return Ok(Some(ConstrainedMesh { fixed, ..polished }));
            }
            if guarded || progress.leave_out() {
                break;
            }
        }
        Ok(None)
    }
}

/// Whether a closer mesh of so many vertices may be tried for a surface of so many: not where that would take
/// long. A much finer surface is a scan, whose details are no edges.
pub(crate) fn may_come_closer(surface: &TriMesh, vertices: usize) -> bool {
    vertices <= MOST_VERTICES && surface.vertices.len() <= FINER * vertices
}

/// The mean distance between triangles of this edge length and a surface that is curved both ways off its
/// features, as balls are: no mesh of as many vertices is much closer. A triangle with its corners on the
/// surface is off by `sqrt(K) edge² / 8` in the mean, K being the Gaussian curvature, which sums to the
/// vertices' angle defects. Surfaces curved one way are left out: long triangles may be closer to them.
fn chord_distance(surface: &TriMesh, features: &Features, edge: f64) -> f64 {
    let mut defects = vec![TAU; surface.vertices.len()];
    let mut areas = vec![0.0; surface.vertices.len()];
    for (t, triangle) in surface.triangles.iter().enumerate() {
        let [a, b, c] = surface.corners(t);
        let around = [[a, b, c], [b, c, a], [c, a, b]].map(angle_at_first);
        for (v, angle) in triangle.iter().zip(around) {
            defects[*v as usize] -= angle;
            areas[*v as usize] += surface.triangle_area(t) / 3.0;
        }
    }
    let on_curves = features.curves.iter().flat_map(Curve::edge_ends).flatten();
    on_curves.chain(features.corners.iter().copied()).for_each(|v| defects[v as usize] = 0.0);
    let bent: f64 = defects.iter().zip(&areas).map(|(defect, area)| (defect.abs() * area).sqrt()).sum();
    bent / surface.area() * edge * edge / 8.0
}

/// Fixes the vertices of edges that turn by much.
fn fix_bent(local: &mut ConstrainedMesh) {
    let mesh = &local.mesh;
    let normal = |edge: &HalfEdge| doubled_normal(mesh.corners(edge.triangle())).normalize_or_zero();
    let least = BENT.to_radians().cos();
    for edge in EdgeTable::new(&mesh.triangles).edges() {
        if let [one, two] = edge
            && normal(one).dot(normal(two)) < least
        {
            <[u32; 2]>::from(one.ends()).iter().for_each(|v| local.fixed[*v as usize] = true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::features::{FeatureOptions, find_features};
    use crate::mesh::samples::sample;

    #[test]
    fn curvature_both_ways_keeps_triangles_off_a_ball_and_not_off_a_box() {
        let of = |mesh: &TriMesh| {
            let features = find_features(mesh, &FeatureOptions::new(0.1)).unwrap();
            chord_distance(mesh, &features, 0.4)
        };
        // The unit sphere's Gaussian curvature is 1, and its 5,120 triangles' area .12 % less than 4 pi.
        assert!((of(&sample("sphere").unwrap()) / 0.02 - 1.0).abs() < 2e-3);
        assert!(of(&sample("box").unwrap()) < 1e-9);
    }
}
