//! Remeshing by local operations on the host: edges are split, collapsed and flipped, and vertices relaxed,
//! until all edges are about as long as asked for and there are exactly as many vertices.
//!
//! Slower than cells on the device and with somewhat less even triangles, but every operation keeps the
//! topology, so that any mesh will do: narrow parts, touching sheets, boundaries, non-manifold edges. After
//! Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004, with curves as in
//! Dunyach et al., "Adaptive remeshing for real-time mesh deformation", Eurographics 2013.

mod ahead;
mod apart;
mod close;
mod collapse;
mod curve_edges;
mod curves;
mod flip;
mod guard;
mod mend;
mod part;
mod relax;
mod split;
mod star_mesh;
mod surface_samples;

use crate::mesh::features::{Curve, CurveKind, Features};
use crate::mesh::polyline::Polyline;
use crate::mesh::sizing::{mapped_area, mean_density};
use crate::mesh::spacing;
use crate::polish::{ConstrainedMesh, Target};
use crate::{ProgressToken, Result, TriMesh};
use collapse::Limits;
use glam::{DMat3, DVec3};
use guard::Guard;
pub use mend::{MendOptions, Mended, mend_angles};
use star_mesh::{Place, StarMesh};
use surface_samples::SurfaceSamples;

/// Edges longer than this are split, in target lengths.
const LONG: f64 = 1.25;
/// Edges shorter than this are collapsed, in target lengths.
const SHORT: f64 = 0.85;
/// Rounds of all operations, in which the target length is adjusted to the number of vertices.
const ROUNDS: u32 = 10;
/// Largest factor by which the target length changes between two rounds.
const MOST_CHANGE: f64 = 1.25;
/// Minimum target length, in spacings.
const LEAST: f64 = 0.85;
/// Needles are crowded if splits have added more than this many times the number of vertices asked for.
const CROWDED: usize = 4;
/// Target length of the first round where needles are crowded, in spacings.
const LONG_AT_FIRST: f64 = 2.0;
/// Edges shorter than this, in target lengths, are collapsed at a greater cost in shape.
const TINY: f64 = 0.4;
/// Flips and relaxations once the number of vertices is right.
const LAST_ROUNDS: u32 = 4;
/// The same in a metric, where no polish follows.
const LAST_ROUNDS_IN_METRIC: u32 = 8;
/// Flips and relaxations at the end if the work is to finish early.
const FEW_LAST_ROUNDS: u32 = 1;
/// Lengths, in target lengths, to which edges are split at first, one after the other.
const COARSE: [f64; 4] = [16.0, 8.0, 4.0, 2.0];
/// Lengths, in target lengths, to which the edges of a much finer surface are collapsed at first, one after
/// the other: short ones can hardly make triangles intersect, and leave fewer for the next.
const FINE: [f64; 3] = [0.1, 0.2, 0.4];
/// A surface is much finer if it has this many times the vertices that edges of such a length require.
const MUCH_FINER: f64 = 1.5;
/// Vertices that splits may reach, over the number asked for.
const MOST_SPLIT: usize = 8;
/// If the work is to finish early, a number of vertices that differs by less than this factor becomes the one
/// wanted at once.
const NEAR: usize = 2;

/// Edge lengths of the finer meshes from which a mesh is made gradually, in spacings, one after the other.
const GRADUAL: [f64; 4] = [0.25, 0.5, 0.7, 0.85];
/// Rounds of all operations for each of them.
const GRADUAL_ROUNDS: u32 = 2;
/// Vertices that the finest of them may have, over the number asked for.
const MOST_GRADUAL: usize = 32;

/// What [`LocalSurface::remeshed`] is to make.
#[derive(Debug, Clone, Copy)]
pub struct LocalOptions {
    /// The longest that target lengths may become, in spacings, where details keep more than their share of
    /// the vertices; above 1.
    pub longest: f64,
    /// Whether operations are undone where they make triangles run into others that are near, but not around
    /// the same vertices, as at thin walls. Costs time.
    pub guarded: bool,
    /// Whether much finer meshes come first, each coarsened to the next. Where edges are as long as the
    /// surface is thick, this makes far better triangles from long needles; it takes several times as long.
    pub gradual: bool,
}

/// Target edge lengths at the vertices of a surface.
#[derive(Debug, Clone, Copy, Default)]
pub struct EdgeLengths<'a> {
    /// Relative lengths; empty if they are all equal.
    pub lengths: &'a [f64],
    /// Maps in whose image such edges are 1 long, if that depends on the direction: then `lengths` are the
    /// least ones at each vertex. Empty otherwise.
    pub maps: &'a [DMat3],
}

/// The map of a place on a triangle with these corners.
pub fn interpolated(maps: &[DMat3], corners: [u32; 3], weights: [f64; 3]) -> DMat3 {
    corners.iter().zip(weights).fold(DMat3::ZERO, |sum, (v, weight)| sum + maps[*v as usize] * weight)
}

/// A surface that is remeshed by local operations, perhaps several times: long needles are flipped away, long
/// edges split, and edges much shorter than what is wanted collapsed.
pub struct LocalSurface<'a> {
    surface: &'a TriMesh,
    /// The same in the patches of its features.
    target: &'a Target,
    wanted: EdgeLengths<'a>,
    polylines: Vec<Polyline>,
    mesh: StarMesh,
    /// The number of vertices that are wanted, and the edge length for it.
    count: usize,
    spacing: f64,
    /// Whether far more vertices would be needed to split long needles into edges of that length.
    is_crowded: bool,
}

impl<'a> LocalSurface<'a> {
    /// Of a surface with these features, for a number of vertices. `target` is the same surface in the
    /// patches of the features. Panics if an index is out of range.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn new(
        (surface, target): (&'a TriMesh, &'a Target),
        features: &Features,
        (wanted, count): (EdgeLengths<'a>, usize),
        progress: &ProgressToken,
    ) -> Result<Self> {
        Self::start((surface, target), features, (wanted, count), None, progress)
    }

    /// Like [`LocalSurface::new`]; with a tolerance in spacings, samples keep the mesh close to the surface.
    fn start(
        (surface, target): (&'a TriMesh, &'a Target),
        features: &Features,
        (wanted, count): (EdgeLengths<'a>, usize),
        tolerance: Option<f64>,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let EdgeLengths { lengths, maps } = wanted;
        let area = match maps {
            [] => (0..surface.triangles.len()).map(|t| weighted_area(surface, t, lengths)).sum(),
            maps => mapped_area(surface, maps),
        };
        let polylines = polylines(surface, features);
        let mut mesh = StarMesh::new(surface, features, &polylines, lengths);
        mesh.maps = maps.to_vec();
        let (spacing, mut is_crowded) = (spacing(area, count), false);
        if spacing > 0.0 && spacing.is_finite() {
            mesh.samples = tolerance.map(|tolerance| {
                let mut samples = SurfaceSamples::new(surface, count, spacing);
                samples.tolerance = tolerance * spacing;
                samples
            });
            // Long needles, as in CAD models, are flipped away where the surface is flat, then cut up.
            mesh.flip(progress)?;
            let before = mesh.used();
            for factor in COARSE {
                is_crowded = tolerance.is_none() && mesh.used() > before + CROWDED * count;
                if is_crowded {
                    break;
                }
                let used = mesh.used();
                mesh.split_long(factor * spacing, (MOST_SPLIT * count).max(mesh.used()), &polylines);
                mesh.flip(progress)?;
                if mesh.used() > used {
                    mesh.refresh_sizes(surface, target, wanted);
                }
            }
            let guard = Guard { looks: true, progress };
            for factor in FINE.into_iter().take_while(|_| !progress.leave_out()) {
                let edge = factor * spacing;
                if mesh.used() as f64 * factor * factor >= MUCH_FINER * count as f64 {
                    let limits = Limits::regular(edge);
                    guard.run(&mut mesh, |mesh| mesh.collapse_short(edge, &limits, &polylines, progress))?;
                }
            }
        }
        Ok(Self { surface, target, wanted, polylines, mesh, count, spacing, is_crowded })
    }

    /// Makes corners of the vertices nearest to these points.
    pub fn fix(&mut self, points: impl IntoIterator<Item = DVec3>) {
        for point in points {
            let distance = |v: &u32| self.mesh.points[*v as usize].distance_squared(point);
            let used = (0..self.mesh.points.len() as u32).filter(|v| self.mesh.is_used(*v));
            if let Some(v) = used.min_by(|a, b| distance(a).total_cmp(&distance(b))) {
                self.mesh.places[v as usize] = Place::Corner;
            }
        }
    }

    /// Remeshed to exactly as many vertices as wanted; to more if the topology and the features need more, to
    /// fewer if the surface has no area, and to any number if the work is to finish early before the number
    /// is near. The result has the topology of the surface.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn remeshed(&self, options: &LocalOptions, progress: &ProgressToken) -> Result<ConstrainedMesh> {
        let Self { surface, target, wanted, ref polylines, count, spacing, .. } = *self;
        let mut mesh = self.mesh.clone();
        // Needles lose vertices around them only where edges are longer, and do not get them back.
        let is_long = self.is_crowded && !options.gradual;
        let mut length = if is_long { LONG_AT_FIRST * spacing } else { spacing };
        if !(length > 0.0 && length.is_finite()) {
            return Ok(mesh.into_constrained(polylines));
        }
        let guard = Guard { looks: options.guarded, progress };
        if options.gradual {
            let most = (MOST_GRADUAL * count).max(mesh.used());
            for factor in GRADUAL {
                for _ in 0..progress.at_most(0, GRADUAL_ROUNDS) {
                    let length = factor * spacing;
                    self.round(&mut mesh, (length, length, most), guard)?;
                }
            }
        }
        let mut before = None;
        for _ in 0..ROUNDS {
            if progress.leave_out() {
                let is_near = mesh.used() <= NEAR * count && count <= NEAR * mesh.used();
                if is_near {
                    break;
                }
                return Ok(mesh.into_constrained(polylines));
            }
            // Small parts soon have as many vertices as they keep.
            let state = Some((mesh.used(), length.to_bits()));
            if state == before {
                break;
            }
            before = state;
            let most = (MOST_SPLIT * count).max(mesh.used());
            self.round(&mut mesh, (length, spacing, most), guard)?;
            mesh.refresh_sizes(surface, target, wanted);
            let ratio = (mesh.used() as f64 / count as f64).sqrt();
            length *= ratio.clamp(1.0 / MOST_CHANGE, MOST_CHANGE);
            length = length.clamp(LEAST * spacing, options.longest * spacing);
        }
        mesh.collapse_to(count, spacing, polylines, guard)?;
        self.finished(mesh, guard)
    }

    /// The map of the place of the surface nearest to a point; `None` without maps.
    pub fn map_near(&self, p: DVec3) -> Option<DMat3> {
        let (corners, weights) = self.target.corners_near(p, self.surface)?;
        (!self.wanted.maps.is_empty()).then(|| interpolated(self.wanted.maps, corners, weights))
    }

    /// A mesh with a vertex on the surface near the middle of each of these edges, and edges flipped.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn refined(
        &self,
        mesh: &ConstrainedMesh,
        edges: &[[u32; 2]],
        progress: &ProgressToken,
    ) -> Result<ConstrainedMesh> {
        let mut star = StarMesh::from_constrained(mesh);
        if !self.wanted.maps.is_empty() {
            star.maps = vec![DMat3::IDENTITY; star.points.len()];
        }
        star.refresh_sizes(self.surface, self.target, self.wanted);
        let first = star.points.len() as u32;
        for [a, b] in edges {
            star.split_edge(*a, *b, &self.polylines);
        }
        star.flip(progress)?;
        let new = first..star.points.len() as u32;
        for v in new {
            if star.places[v as usize] == Place::Inside {
                star.relax_inside(v, self.target);
            }
        }
        Ok(star.into_constrained(&self.polylines))
    }

    /// The mesh with as many vertices as wanted, if it has fewer, and with a last relaxation.
    fn finished(&self, mut mesh: StarMesh, guard: Guard) -> Result<ConstrainedMesh> {
        let (target, polylines, progress) = (self.target, &self.polylines, guard.progress);
        mesh.split_to(self.count, polylines);
        guard.run(&mut mesh, |mesh| {
            // No polish follows in a metric.
            let last = if mesh.maps.is_empty() { LAST_ROUNDS } else { LAST_ROUNDS_IN_METRIC };
            for _ in 0..progress.at_most(FEW_LAST_ROUNDS, last) {
                mesh.flip(progress)?;
                mesh.relax(target, polylines, progress)?;
            }
            Ok(())
        })?;
        mesh.refresh_sizes(self.surface, target, self.wanted);
        Ok(mesh.into_constrained(polylines))
    }

    /// All operations once, for edges of this length, with the spacing along curves, up to `most` vertices.
    fn round(
        &self,
        mesh: &mut StarMesh,
        (length, on_curves, most): (f64, f64, usize),
        guard: Guard,
    ) -> Result<()> {
        let (target, polylines, progress) = (self.target, &self.polylines, guard.progress);
        progress.poll()?;
        mesh.split_long(LONG * length, most, polylines);
        guard.run(mesh, |mesh| {
            mesh.space_curves(on_curves, most, polylines);
            mesh.collapse_short(SHORT * length, &Limits::regular(length), polylines, progress)?;
            mesh.collapse_short(TINY * length, &Limits::of_details(length), polylines, progress)?;
            mesh.flip(progress)?;
            mesh.relax(target, polylines, progress)
        })
    }
}

/// A mesh on a surface with its edges flipped and its vertices relaxed, as far as no more triangles
/// intersect. Vertices that are `fixed` stay; so do boundaries and edges of three triangles or more.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn relaxed(
    mesh: TriMesh,
    fixed: Vec<bool>,
    target: &Target,
    progress: &ProgressToken,
) -> Result<TriMesh> {
    let mut star = StarMesh::from_constrained(&ConstrainedMesh { mesh, fixed, ..Default::default() });
    let guard = Guard { looks: true, progress };
    for round in 0..LAST_ROUNDS {
        if round >= FEW_LAST_ROUNDS && progress.leave_out() {
            break;
        }
        guard.run(&mut star, |mesh| {
            mesh.flip(progress)?;
            mesh.relax(target, &[], progress)
        })?;
    }
    Ok(star.into_constrained(&[]).mesh)
}

/// The area of a triangle times the mean of 1 / length² on it, with relative target lengths: proportional to
/// the number of vertices that it gets.
fn weighted_area(surface: &TriMesh, t: usize, lengths: &[f64]) -> f64 {
    let area = surface.triangle_area(t);
    if lengths.is_empty() {
        return area;
    }
    area * mean_density(surface.triangles[t].map(|v| lengths[v as usize]))
}

/// The curves of the surface as points; a closed one ends with its first.
pub(crate) fn polylines(surface: &TriMesh, features: &Features) -> Vec<Polyline> {
    let line = |curve: &Curve| {
        let again = curve.vertices.first().filter(|_| curve.closed);
        let points = curve.vertices.iter().chain(again).map(|v| surface.vertices[*v as usize]);
        Polyline::new(points.collect(), curve.closed).drawn(curve.kind == CurveKind::User)
    };
    features.curves.iter().map(line).collect()
}
