//! Stretched triangles: the whole surface remeshed by local operations, whose target lengths depend on the
//! direction.

use super::coarse_to_fine::size_field::length_range;
use super::coarse_to_fine::surface_model::{ModelRequest, by_surface, feature_options, surface_vertices};
use super::deviation::lengths::LONGEST;
use super::deviation::measured::{Depth, Reference};
use super::fallback::faulty::Fallback;
use super::fallback::remesh::curve_half_edges;
use super::outcome::{Fault, FaultKind, Outcome};
use super::result::{FeatureSummary, MetricQuality};
use super::run_context::RunContext;
use crate::local::{EdgeLengths, LocalOptions, LocalSurface, interpolated, polylines};
use crate::mesh::features::{FeatureOptions, Features, find_features};
use crate::mesh::quality::quality;
use crate::mesh::sizing::{Bend, SizeField, StretchBounds, StretchField, along_curve, bends};
use crate::mesh::spacing;
use crate::mesh::topology::topology;
use crate::options::Sizing;
use crate::polish::{ConstrainedMesh, FitOptions, Target, fit};
use crate::{Error, ProgressToken, Result, TriMesh};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// The longest that edges may become in the metric, where details keep more than their share of the vertices.
const MOST_IN_METRIC: f64 = 1.25;
/// How vertices leave the surface for a closer fit; small angles are meant here.
const FIT: FitOptions = FitOptions { rounds: 3, min_angle: 5.0 };
/// Maximum number of passes in which vertices are inserted where the mesh is too far away.
const PASSES: u32 = 10;
/// If more faces than this, plus one for every [`VERTICES_PER_FACE`] vertices, are too far away, edges are to
/// be shorter instead.
const FEW_FAR: usize = 50;
/// Vertices for each face that may be too far away, in addition to [`FEW_FAR`].
const VERTICES_PER_FACE: usize = 8;
/// Samples must be within this share of the largest deviation, since they may miss the farthest point.
const SAMPLED: f64 = 0.97;
/// The feature angle that turns sharp edges off.
const NO_SHARP_EDGES: f64 = 180.0;
/// Cosine of the angle up to which a curve runs in the direction in which the surface bends most.
const SAME: f64 = 0.7;

/// The surface of a run, remeshed with [`Sizing::Anisotropic`]: with a fault if faces intersect that did not
/// in the input, if the topology differs, or if something is left out. Sharp edges give way if there are too
/// few vertices for them.
///
/// # Errors
/// Those of the features, and [`Error::Cancelled`].
pub(super) fn anisotropic(
    context: &RunContext,
    summary: FeatureSummary,
    progress: &ProgressToken,
) -> Result<Outcome> {
    let surface = context.surface.mesh();
    let on_surface = surface_vertices(context.surface, context.mesh);
    let options = feature_options(context, &ModelRequest::of(context.plan), &on_surface)?;
    let made = |options: &FeatureOptions| -> Result<Outcome> {
        let features = find_features(&surface, options)?;
        progress.poll()?;
        let field = field(context, &surface, &features, &on_surface)?;
        let target = Target::new(&surface).in_patches(features.patches.clone());
        Anisotropic { context, surface: &surface, features, maps: field.maps(), field, target }
            .made(summary, progress)
    };
    let with_edges = made(&options)?;
    let is_enough = |made: &Outcome| made.mesh.vertices.len() <= made.vertices;
    // Runs for a largest deviation have as many vertices as they need.
    let may_give_up = context.may_simplify() && !matches!(context.plan.sizing, Sizing::Given(_));
    if is_enough(&with_edges) || !may_give_up || progress.leave_out() {
        return Ok(with_edges);
    }
    let without = made(&FeatureOptions { feature_angle: NO_SHARP_EDGES, ..options })?;
    if !is_enough(&without) || severity(&without) > severity(&with_edges) {
        return Ok(with_edges);
    }
    let features = without.features.map(FeatureSummary::without_sharp_edges);
    Ok(Outcome { features, ..without })
}

/// What is wrong with an outcome; nothing is least.
fn severity(outcome: &Outcome) -> Option<FaultKind> {
    outcome.fault.as_ref().map(|fault| fault.kind)
}

/// A surface with the lengths of its edges.
struct Anisotropic<'a> {
    context: &'a RunContext<'a>,
    surface: &'a TriMesh,
    features: Features,
    field: StretchField,
    /// Those of the field.
    maps: Vec<DMat3>,
    target: Target,
}

impl Anisotropic<'_> {
    /// The mesh, fitted unless that leads to a fault; guarded against intersections if need be.
    fn made(&self, summary: FeatureSummary, progress: &ProgressToken) -> Result<Outcome> {
        let Self { context, surface, features, field, maps, target } = self;
        let wanted = EdgeLengths { lengths: &field.short, maps };
        let vertices = context.plan.vertices;
        let local = LocalSurface::new((surface, target), features, (wanted, vertices), progress)?;
        let mut best: Option<Outcome> = None;
        for guarded in [false, true] {
            let made = local
                .remeshed(&LocalOptions { longest: MOST_IN_METRIC, guarded, gradual: false }, progress)?;
            let fits = context.options.coarse_to_fine.fit || context.deviation.is_some();
            if fits && !progress.leave_out() {
                let fitted = self.fitted(made.clone(), &local, progress)?;
                let outcome = self.checked(fitted, summary, progress)?;
                if outcome.fault.is_none() {
                    return Ok(outcome);
                }
            }
            let outcome = self.checked(made, summary, progress)?;
            if best.as_ref().is_none_or(|best| severity(&outcome) < severity(best)) {
                best = Some(outcome);
            }
            if best.as_ref().is_some_and(|best| best.fault.is_none()) || progress.leave_out() {
                break;
            }
        }
        best.ok_or_else(|| Error::Internal("nothing was remeshed".to_owned()))
    }

    /// The mesh moved closer to the surface if it may be, with vertices inserted if a largest deviation is
    /// given.
    fn fitted(
        &self,
        mut mesh: ConstrainedMesh,
        local: &LocalSurface,
        progress: &ProgressToken,
    ) -> Result<ConstrainedMesh> {
        let fits = self.context.options.coarse_to_fine.fit;
        if fits {
            fit(&mut mesh, &self.target, &FIT, progress)?;
        }
        let Some(most) = self.context.deviation else { return Ok(mesh) };
        let reference = Reference { surface: self.surface, bvh: self.target.bvh(), most };
        let insertion =
            Insertion { local, target: &self.target, reference, lengths: &self.field.short, fits };
        insertion.inserted(mesh, progress)
    }

    fn checked(
        &self,
        made: ConstrainedMesh,
        summary: FeatureSummary,
        progress: &ProgressToken,
    ) -> Result<Outcome> {
        let curve_sites = made.fixed.iter().filter(|fixed| **fixed).count();
        let wanted = self.context.plan.vertices;
        let outcome = Outcome {
            features: Some(FeatureSummary { curve_sites, ..summary }),
            edge_lengths: Some(self.field.range()),
            metric: self.metric_quality(&made.mesh),
            vertices: if self.context.deviation.is_some() { made.mesh.vertices.len() } else { wanted },
            attempts: 1,
            ..Outcome::default()
        };
        let other_topology = Fault::topology(&made.mesh, &topology(self.surface), None);
        let fallback = Fallback { context: *self.context, sizes: &SizeField::default() };
        let outcome = fallback.checked_place(made.mesh, outcome, progress)?;
        Ok(Outcome { fault: other_topology.or(outcome.fault), ..outcome })
    }

    /// The triangles in the metric; `None` without triangles.
    fn metric_quality(&self, mesh: &TriMesh) -> Option<MetricQuality> {
        let Self { surface, field, maps, target, .. } = self;
        let at = |p: &DVec3| {
            let Some((corners, weights)) = target.corners_near(*p, surface) else {
                return (DMat3::IDENTITY, 1.0);
            };
            let map = interpolated(maps, corners, weights);
            let quotient = |v: u32| field.long[v as usize] / field.short[v as usize];
            (map, (0..3).map(|k| weights[k] * quotient(corners[k])).sum())
        };
        let at_vertices: Vec<(DMat3, f64)> = mesh.vertices.par_iter().map(at).collect();
        let corners = |t: &[u32; 3]| t.map(|v| at_vertices[v as usize]);
        let even = |t: &[u32; 3]| {
            let map = corners(t).iter().fold(DMat3::ZERO, |sum, (map, _)| sum + *map) * (1.0 / 3.0);
            t.map(|v| map * mesh.vertices[v as usize])
        };
        let soup = TriMesh {
            vertices: mesh.triangles.iter().flat_map(even).collect(),
            triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        };
        let quality = quality(&soup)?;
        let aspects = mesh.triangles.iter().flat_map(corners).map(|(_, aspect)| aspect);
        Some(MetricQuality {
            mean_quality: quality.mean_quality,
            min_angle: quality.min_angle,
            mean_aspect: aspects.sum::<f64>() / soup.vertices.len() as f64,
        })
    }
}

/// Vertices inserted where a mesh is too far from the surface.
struct Insertion<'a> {
    local: &'a LocalSurface<'a>,
    target: &'a Target,
    reference: Reference<'a>,
    /// Edge lengths at the surface's vertices.
    lengths: &'a [f64],
    /// Whether vertices may leave the surface.
    fits: bool,
}

impl Insertion<'_> {
    /// The mesh with an edge split at each place that is too far away, fitted again, several times; as it is
    /// if there are so many such places that edges are to be shorter instead.
    fn inserted(&self, mut mesh: ConstrainedMesh, progress: &ProgressToken) -> Result<ConstrainedMesh> {
        let most_far = FEW_FAR + mesh.mesh.vertices.len() / VERTICES_PER_FACE;
        for _ in 0..PASSES {
            let far = self.far_faces(&mesh.mesh, progress)?;
            if far.is_empty() || far.len() > most_far || progress.leave_out() {
                break;
            }
            let mut is_split = vec![false; mesh.mesh.vertices.len()];
            let edges: Vec<[u32; 2]> = (far.iter())
                .filter_map(|t| self.longest_edge(&mesh.mesh, *t))
                .filter(|edge| {
                    !edge.map(|v| std::mem::replace(&mut is_split[v as usize], true)).contains(&true)
                })
                .collect();
            mesh = self.local.refined(&mesh, &edges, progress)?;
            if self.fits {
                fit(&mut mesh, self.target, &FIT, progress)?;
            }
        }
        Ok(mesh)
    }

    /// The faces that are too far away, the farthest first.
    fn far_faces(&self, mesh: &TriMesh, progress: &ProgressToken) -> Result<Vec<u32>> {
        let found = self.reference.measured(mesh, self.lengths, Depth::Coarse, progress)?;
        let distance = |t: u32| found.of_face[t as usize].distance;
        let is_far = |t: &u32| distance(*t) > SAMPLED * self.reference.most;
        let mut far: Vec<u32> = (0..mesh.triangles.len() as u32).filter(is_far).collect();
        far.sort_by(|p, q| distance(*q).total_cmp(&distance(*p)).then(p.cmp(q)));
        if far.is_empty() {
            let largest = self.reference.largest(mesh, progress)?;
            far.extend((largest.upper > self.reference.most).then_some(largest.face));
        }
        Ok(far)
    }

    /// The edge of a face that is longest in the metric.
    fn longest_edge(&self, mesh: &TriMesh, t: u32) -> Option<[u32; 2]> {
        let [a, b, c] = mesh.triangles[t as usize];
        let [p, q, r] = mesh.corners(t as usize);
        let map = self.local.map_near((p + q + r) / 3.0)?;
        let edges = [([a, b], q - p), ([b, c], r - q), ([c, a], p - r)];
        let length = |edge: &([u32; 2], DVec3)| (map * edge.1).length();
        edges.into_iter().max_by(|e, f| length(e).total_cmp(&length(f))).map(|(edge, _)| edge)
    }
}

/// The lengths over the surface.
fn field(
    context: &RunContext,
    surface: &TriMesh,
    features: &Features,
    on_surface: &[u32],
) -> Result<StretchField> {
    let (method, plan, diagonal) = (&context.options.coarse_to_fine, context.plan, context.frame.scale);
    let spacing = spacing(surface.area(), plan.vertices);
    let aspect = method.sizing.aspect().unwrap_or(1.0);
    let bounds = |[least, largest]: [f64; 2]| StretchBounds { least, largest, aspect, growth: method.growth };
    let bends = bends_with_curves(surface, features, spacing);
    if let Sizing::Given(short) = &plan.sizing {
        let short = by_surface(on_surface, short);
        let least = short.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = method.max_edge.map_or(LONGEST, |length| length.share_of(diagonal)).max(least);
        return Ok(StretchField::with_short(surface, &bends, short, &bounds([least, largest])));
    }
    let range = length_range([plan.min_edge, method.max_edge], spacing, diagonal)?;
    Ok(StretchField::for_vertices(surface, &bends, &bounds(range), plan.vertices as f64))
}

/// How the surface bends at each vertex, or a curve on it if that bends more.
fn bends_with_curves(surface: &TriMesh, features: &Features, spacing: f64) -> Vec<Bend> {
    let mut bends = bends(surface, &curve_half_edges(surface, features), spacing);
    for (curve, line) in features.curves.iter().zip(polylines(surface, features)) {
        for (k, v) in curve.vertices.iter().enumerate() {
            let (bend, arc_length) = (&mut bends[*v as usize], line.arc_length_at(k));
            let (_, along) = line.at(arc_length);
            let of_curve = along_curve(&line, arc_length, spacing);
            if bend.across.dot(along.normalize_or_zero()).abs() > SAME {
                bend.most = bend.most.max(of_curve);
            } else if of_curve <= bend.most {
                bend.least = bend.least.max(of_curve);
            } else {
                *bend = Bend { across: along.normalize_or_zero(), most: of_curve, least: bend.most };
            }
        }
    }
    bends
}
