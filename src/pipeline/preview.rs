//! The plan of a run, made without a device.

use super::RunInput;
use super::coarse_to_fine::levels::{Extent, LevelPlan, enough, levels};
use super::coarse_to_fine::size_field::{Curvatures, SizeRequest, size_field};
use super::face_count::{may_change, with_vertices};
use super::kept::{Kept, in_units};
use super::memory::bytes_needed;
use super::other_count::with_other_count;
use super::plan::Plan;
use super::prepare::repaired_for;
use super::symmetric::halved;
use crate::mesh::features::{FeatureOptions, Features, find_features};
use crate::mesh::repair::{RepairCounts, Repaired};
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Method, Options, Shortage, Sizing};
use crate::sites::surface_curves::SurfaceCurves;
use crate::{Error, ProgressToken, Result, TriMesh};
use serde::Serialize;

/// The plan of a run.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Preview {
    /// What was repaired of the input.
    pub repaired: RepairCounts,
    /// Vertices and triangles of the repaired input.
    pub input: [usize; 2],
    /// Vertices of the result, with those of kept triangles, which nothing else here counts.
    pub vertices: usize,
    /// What is kept as it is of the input, if anything.
    pub kept: Option<PreviewKept>,
    /// Whether the run may find out that another number of vertices leads to the triangles asked for: how
    /// many boundary edges there will be is only estimated here.
    pub vertices_may_change: bool,
    /// Edge length of a perfect layout, in the input's units.
    pub spacing: f64,
    /// From the coarsest to the finest; more than one only with [`Method::CoarseToFine`].
    pub levels: Vec<PreviewLevel>,
    /// Number of curves: chains of sharp edges, boundary edges and others that are kept.
    pub curves: usize,
    /// Number of vertices on each of them, corners not included, largest first; none where edges are
    /// collapsed.
    pub curve_vertices: Vec<usize>,
    /// Number of corners, where curves end, branch or turn sharply; each gets a vertex of the result.
    pub corners: usize,
    /// Estimated number of vertices inside each patch between the curves, largest first.
    pub patches: Vec<usize>,
    /// Whether the curves need so many vertices that the surface will be remeshed by local operations.
    pub collapses: bool,
    /// Estimated device memory, in bytes; not counted is what a device polishes with if it has the memory.
    pub device_bytes: u64,
}

/// Vertices of one level of a [`Preview`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PreviewLevel {
    /// All vertices of the level.
    pub vertices: usize,
    /// Vertices on curves, corners included.
    pub on_curves: usize,
    /// Edge length in the input's units.
    pub spacing: f64,
}

/// What is kept as it is of the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct PreviewKept {
    /// Its triangles.
    pub triangles: usize,
    /// Their vertices.
    pub vertices: usize,
    /// Edges along which the rest joins them.
    pub joining_edges: usize,
}

/// Plans a run of [`crate::remesh`] without making it.
///
/// # Errors
/// [`crate::Error::Usage`] for options out of range and too few vertices for the curves,
/// [`crate::Error::Input`] for a mesh without area or features that fit no edge.
pub fn preview(mesh: &TriMesh, options: &Options) -> Result<Preview> {
    preview_repaired(mesh, None, options)
}

/// Like [`preview`], for a mesh that may be repaired already, like [`crate::remesh_repaired`].
///
/// # Errors
/// See there.
pub fn preview_repaired(mesh: &TriMesh, repaired: Option<Repaired>, options: &Options) -> Result<Preview> {
    options.validate()?;
    let options = &with_vertices(mesh, repaired.as_ref(), options)?;
    if options.coarse_to_fine.sizing.deviation().is_some() {
        let problem = "a maximum deviation has no plan in advance, because its edge lengths follow from \
        several runs";
        return Err(Error::option("sizing", problem, "start the run, or plan with another `sizing`"));
    }
    if options.coarse_to_fine.sizing.aspect().is_some() {
        let problem = "anisotropic sizing has no plan in advance, because it has no levels";
        return Err(Error::option("sizing", problem, "start the run, or plan with another `sizing`"));
    }
    let repaired = repaired_for(mesh, repaired, options, &ProgressToken::default())?;
    if let Some(symmetry) = options.coarse_to_fine.symmetric {
        halved(&repaired.mesh, &topology(&repaired.mesh), symmetry)?;
    }
    let options = &in_units(options, &repaired.mesh)?;
    plan_of(mesh, repaired, options).map_err(|error| with_other_count(error, mesh, options))
}

/// The plan for a mesh that was `repaired`.
pub(super) fn plan_of(mesh: &TriMesh, mut repaired: Repaired, options: &Options) -> Result<Preview> {
    let kept = Kept::cut_off(&mut repaired, options, mesh)?;
    let other_vertices = kept.as_ref().map_or(0, Kept::own_vertices);
    let input = RunInput::new(mesh, None, options);
    let plan = Plan::new(&input, &mut repaired, kept.as_ref(), &ProgressToken::default())?;
    let surface = PreviewedSurface::new(&repaired.mesh, options, &plan)?;
    let (unit, diagonal) = (&surface.unit, surface.diagonal);
    let areas: Vec<f64> = (0..unit.triangles.len()).map(|t| unit.triangle_area(t)).collect();
    let PreviewedCount { vertices, levels, features, curves, field } = surface.with_enough_vertices()?;
    let weighted: Vec<f64> = areas.iter().enumerate().map(|(t, area)| area * field.density(t)).collect();
    let interior = levels.last().map_or(0, |last| last.interior);
    let curve_vertices = match (&curves, levels.last()) {
        (Some(curves), Some(last)) => largest_first(curves.counts_by_curve(last.spacing)),
        _ => Vec::new(),
    };
    let level = |plan: &LevelPlan| PreviewLevel {
        vertices: plan.sites,
        on_curves: plan.sites - plan.interior,
        spacing: plan.spacing * diagonal,
    };
    Ok(Preview {
        repaired: repaired.counts,
        input: kept
            .as_ref()
            .map(|kept| &kept.topology)
            .or(plan.refined.undivided.as_ref())
            .map_or([repaired.mesh.vertices.len(), repaired.mesh.triangles.len()], |input| {
                [input.vertices, input.faces]
            }),
        vertices: vertices + other_vertices,
        kept: kept.as_ref().map(|kept| PreviewKept {
            triangles: kept.triangles(),
            vertices: kept.own_vertices() + kept.shared.len(),
            joining_edges: kept.cut.len(),
        }),
        vertices_may_change: may_change(options, &repaired.mesh),
        spacing: spacing(surface.area, vertices) * diagonal,
        collapses: levels.is_empty(),
        levels: levels.iter().map(level).collect(),
        curves: features.curves.len(),
        curve_vertices,
        corners: features.corners.len(),
        patches: by_patch(&features, &weighted, interior),
        device_bytes: bytes_needed(&repaired.mesh, options, vertices, curves.is_some())?,
    })
}

/// The sum of 2 - s over the edges of a result with s triangles, as far as the curves tell: its boundary
/// edges, less what junctions have beyond two triangles.
///
/// # Errors
/// As [`preview`].
pub(super) fn single_sides(
    mesh: &TriMesh,
    repaired: &Repaired,
    kept: Option<&Kept>,
    options: &Options,
) -> Result<i64> {
    let mut repaired = repaired.clone();
    let input = RunInput::new(mesh, None, options);
    let plan = Plan::new(&input, &mut repaired, kept, &ProgressToken::default())?;
    let surface = PreviewedSurface::new(&repaired.mesh, options, &plan)?;
    let PreviewedCount { levels, curves, .. } = surface.with_enough_vertices()?;
    let (Some(curves), Some(last)) = (&curves, levels.last()) else { return Ok(0) };
    let counts = curves.count(last.spacing);
    Ok(2 * counts.segments as i64 - counts.sides as i64)
}

/// The surface of a run that is not made.
struct PreviewedSurface<'a> {
    /// The repaired input, in its units.
    input: &'a TriMesh,
    /// The same in the unit-diagonal frame, with its topology and area.
    unit: TriMesh,
    topology: Topology,
    area: f64,
    /// Of the input's bounding box.
    diagonal: f64,
    options: &'a Options,
    plan: &'a Plan,
}

/// What a number of vertices leads to.
struct PreviewedCount {
    vertices: usize,
    /// None for a surface that is remeshed by local operations.
    levels: Vec<LevelPlan>,
    features: Features,
    curves: Option<SurfaceCurves>,
    field: SizeField,
}

impl<'a> PreviewedSurface<'a> {
    fn new(input: &'a TriMesh, options: &'a Options, plan: &'a Plan) -> Result<Self> {
        let frame = UnitFrame::of(input)?;
        let unit = TriMesh {
            vertices: input.vertices.iter().map(|vertex| frame.to_unit(*vertex)).collect(),
            triangles: input.triangles.clone(),
        };
        let (topology, area) = (topology(&unit), unit.area());
        Ok(Self { input, topology, area, unit, diagonal: frame.scale, options, plan })
    }

    /// The number of vertices that was asked for, or a larger one as a run would take it.
    fn with_enough_vertices(&self) -> Result<PreviewedCount> {
        let mut vertices = self.plan.vertices;
        loop {
            if self.options.method != Method::CoarseToFine {
                let spacing = spacing(self.area, vertices);
                let levels = vec![LevelPlan {
                    sites: vertices,
                    interior: vertices,
                    is_finest: true,
                    points: 0,
                    spacing,
                }];
                let (features, curves, field) = (Features::default(), None, SizeField::default());
                return Ok(PreviewedCount { vertices, levels, features, curves, field });
            }
            let (features, curves, field) = self.features(vertices)?;
            let extent = Extent { area: self.area, euler: self.topology.euler, curves: curves.as_ref() };
            let levels = match (levels(&extent, vertices, self.plan.coarsest), &curves) {
                (Err(Error::Usage { .. }), Some(curves))
                    if self.options.shortage == Shortage::AddVertices =>
                {
                    vertices = enough(curves, self.area, vertices);
                    continue;
                }
                (Err(Error::Usage { .. }), Some(curves))
                    if self.plan.pinned.is_empty() && self.may_be_made_locally(curves, vertices) =>
                {
                    Vec::new()
                }
                (levels, _) => levels.map_err(|error| self.plan.curves.name_borders(error))?,
            };
            return Ok(PreviewedCount { vertices, levels, features, curves, field });
        }
    }

    /// Whether local operations may keep these curves, or give them up.
    fn may_be_made_locally(&self, curves: &SurfaceCurves, vertices: usize) -> bool {
        let is_enough = curves.corners.len() <= vertices && !self.topology.is_much_for(vertices);
        self.plan.curves.is_empty() || is_enough
    }

    /// The features, curves and sizes for a number of vertices.
    fn features(&self, vertices: usize) -> Result<(Features, Option<SurfaceCurves>, SizeField)> {
        let Self { unit, options, plan, diagonal, .. } = self;
        let feature_options = FeatureOptions {
            feature_angle: options.coarse_to_fine.feature_angle,
            user_edges: plan.edges(self.input)?,
            user_corners: plan.pinned.vertices.clone(),
            whole_edges: plan.pinned.whole.clone(),
            ..FeatureOptions::new(spacing(self.area, vertices))
        };
        let features = find_features(unit, &feature_options)?;
        let curves = SurfaceCurves::new(&unit.vertices, &unit.triangles, &features);
        let given = if let Sizing::Given(values) = &plan.sizing { values.as_slice() } else { &[] };
        let (sizing, min_edge, diagonal) = (&plan.sizing, plan.min_edge, *diagonal);
        let (fixed, floors) = (plan.refined.lengths.as_slice(), plan.refined.least.as_slice());
        let has_bends = plan.bends.is_some();
        let request =
            SizeRequest { options, min_edge, vertices, sizing, has_bends, given, fixed, floors, diagonal };
        let field = size_field(unit, (curves.as_ref(), &Curvatures::default()), &request)?;
        Ok((features, curves.map(|curves| curves.with_sizes(&field)), field))
    }
}

/// The `interior` vertices of each patch by its weighted area, largest first.
fn by_patch(features: &Features, areas: &[f64], interior: usize) -> Vec<usize> {
    let mut patches = vec![0.0; features.patch_count];
    for (patch, area) in features.patches.iter().zip(areas) {
        if let Some(sum) = patches.get_mut(*patch as usize) {
            *sum += area;
        }
    }
    let whole: f64 = areas.iter().sum();
    largest_first(patches.iter().map(|area| (interior as f64 * area / whole).round() as usize).collect())
}

fn largest_first(mut counts: Vec<usize>) -> Vec<usize> {
    counts.sort_unstable_by(|a, b| b.cmp(a));
    counts
}
