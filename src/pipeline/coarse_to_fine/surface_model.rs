//! The surface in the forms that the default pipeline needs, with its features and its size field.

use super::level::DeviceSurface;
use super::near_points::{GROWTH, shorter_at_points};
use super::size_field::{SizeRequest, size_field};
use crate::gpu::Device;
use crate::mesh::features::{FeatureOptions, Features, find_features};
use crate::mesh::half_edges::{edge_key, twins};
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::options::Sizing;
use crate::pipeline::plan::Plan;
use crate::pipeline::result::FeatureSummary;
use crate::pipeline::run_context::RunContext;
use crate::polish::Target;
use crate::sites::surface::Surface;
use crate::sites::surface_curves::SurfaceCurves;
use crate::stages::records::TriangleRecords;
use crate::stages::sizing::DeviceSizes;
use crate::{ProgressToken, Result, TriMesh};

/// What a [`SurfaceModel`] is made for.
#[derive(Clone, Copy)]
pub(crate) struct ModelRequest<'a> {
    pub vertices: usize,
    /// Values are at the vertices of the run's mesh.
    pub sizing: &'a Sizing,
    /// Lengths that hold in parts of it, likewise.
    pub refined: &'a [f64],
    /// Same as [`FeatureOptions::round_facets`].
    pub round_facets: bool,
    /// The features are those of edges this many times as long as the vertices give; 1 or more.
    pub coarseness: f64,
}

impl<'a> ModelRequest<'a> {
    /// As planned.
    pub fn of(plan: &'a Plan) -> Self {
        Self {
            vertices: plan.vertices,
            sizing: &plan.sizing,
            refined: &plan.refined.lengths,
            round_facets: false,
            coarseness: 1.0,
        }
    }
}

/// The surface for a number of vertices, on which its features and sizes depend.
pub(crate) struct SurfaceModel {
    records: TriangleRecords,
    /// For projections on the host.
    pub target: Target,
    /// `None` without features.
    pub curves: Option<SurfaceCurves>,
    pub sizes: SizeField,
    /// Vertices of the surface that stay where they are, rising.
    pub pinned: Vec<u32>,
    device_sizes: Option<DeviceSizes>,
    /// Counts of the features, without sites, and lengths in the units of the input.
    pub features: FeatureSummary,
}

impl SurfaceModel {
    /// With the features and sizes of the run and the request.
    ///
    /// # Errors
    /// As [`SurfaceModel::with`], and those of the user's curves.
    pub fn new(context: &RunContext, request: &ModelRequest, progress: &ProgressToken) -> Result<Self> {
        let RunContext { device, mesh, frame, surface, options, plan, .. } = *context;
        let ModelRequest { vertices, sizing, refined, .. } = *request;
        let on_surface = surface_vertices(surface, mesh);
        let features = feature_options(context, request, &on_surface)?;
        let by_surface = |values: &[f64]| by_surface(&on_surface, values);
        let given = if let Sizing::Given(values) = sizing { by_surface(values) } else { Vec::new() };
        let [fixed, floors] = [refined, &plan.refined.least].map(by_surface);
        let sizes = |curves: Option<&SurfaceCurves>| {
            let (min_edge, given, diagonal) = (plan.min_edge, given.as_slice(), frame.scale);
            let (fixed, floors, has_bends) = (fixed.as_slice(), floors.as_slice(), plan.bends.is_some());
            let request = SizeRequest {
                options,
                min_edge,
                vertices,
                sizing,
                has_bends,
                given,
                fixed,
                floors,
                diagonal,
            };
            let (mesh, spacing) = (surface.mesh(), spacing(surface.area(), vertices));
            let field = size_field(&mesh, curves, &request)?;
            let at_points = curves.map_or_else(Vec::new, |curves| shorter_at_points(curves, spacing));
            Ok(field.shortened(&mesh, &at_points, GROWTH, spacing))
        };
        let mut model = Self::with(device, surface, &features, sizes, progress)?;
        model.features.in_units(frame.scale);
        Ok(model)
    }

    /// With the features found by `options`, in the unit-diagonal frame, and the size field that `sizes`
    /// makes for them.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if the surface does not fit on the device, [`crate::Error::Cancelled`],
    /// and those of [`find_features`] and `sizes`.
    pub fn with(
        device: &Device,
        surface: &Surface,
        options: &FeatureOptions,
        sizes: impl Fn(Option<&SurfaceCurves>) -> Result<SizeField> + Sync,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let mesh = surface.mesh();
        let twins = twins(&mesh.triangles);
        let parts = || -> Result<_> {
            let features = find_features(&mesh, options)?;
            progress.poll()?;
            let of = |features: &Features| SurfaceCurves::new(&mesh.vertices, &mesh.triangles, features);
            let coarse = match options.whole_edges.is_empty() {
                true => None,
                false => {
                    let (user_corners, whole_edges) = Default::default();
                    let coarse = FeatureOptions { user_corners, whole_edges, ..options.clone() };
                    of(&find_features(&mesh, &coarse)?)
                }
            };
            let curves = of(&features).map(|curves| curves.with_coarse(coarse));
            let sizes = sizes(curves.as_ref())?;
            progress.poll()?;
            let curves = curves.map(|curves| curves.with_sizes(&sizes));
            let records = TriangleRecords::with_twins(device, surface, curves.as_ref(), twins.clone())?;
            let device_sizes = DeviceSizes::new(device, &sizes)?;
            Ok((records, curves, FeatureSummary::of(&features), sizes, device_sizes))
        };
        let (parts, target) = rayon::join(parts, || Target::with_twins(&mesh, &twins));
        let (records, curves, features, sizes, device_sizes) = parts?;
        let mut pinned = options.user_corners.clone();
        pinned.sort_unstable();
        let patches = curves.as_ref().map_or_else(Vec::new, |curves| curves.patches.clone());
        Ok(Self {
            records,
            target: target.in_patches(patches),
            curves,
            sizes,
            pinned,
            device_sizes,
            features,
        })
    }

    /// The surface on the device.
    pub fn on_device(&self) -> DeviceSurface<'_> {
        DeviceSurface { records: &self.records, sizes: self.device_sizes.as_ref() }
    }
}

/// What the features of a run's surface are found by. `on_surface` are its [`surface_vertices`].
///
/// # Errors
/// Those of the user's curves.
pub(crate) fn feature_options(
    context: &RunContext,
    request: &ModelRequest,
    on_surface: &[u32],
) -> Result<FeatureOptions> {
    let RunContext { mesh, surface, options, plan, .. } = *context;
    let on = |v: u32| on_surface[v as usize];
    Ok(FeatureOptions {
        feature_angle: options.coarse_to_fine.feature_angle,
        spacing: request.coarseness * spacing(surface.area(), request.vertices),
        user_edges: plan.edges(mesh)?.into_iter().map(|edge| edge.map(on)).collect(),
        user_corners: plan.pinned.vertices.iter().map(|v| on(*v)).collect(),
        whole_edges: plan.pinned.whole.iter().map(|(a, b)| edge_key(on(*a), on(*b))).collect(),
        round_facets: request.round_facets,
    })
}

/// Values at the vertices of a run's mesh as those at the vertices of its surface.
pub(crate) fn by_surface(on_surface: &[u32], values: &[f64]) -> Vec<f64> {
    let mut list = vec![1.0; values.len()];
    on_surface.iter().zip(values).for_each(|(v, value)| list[*v as usize] = *value);
    list
}

/// For each vertex of the mesh its index on the surface, which has the mesh's triangles in another order, and
/// its vertices in another.
pub(crate) fn surface_vertices(surface: &Surface, mesh: &TriMesh) -> Vec<u32> {
    let mut on_surface = vec![0; mesh.vertices.len()];
    for (origin, triangle) in surface.origin.iter().zip(&surface.triangles) {
        for (from, to) in mesh.triangles[*origin as usize].iter().zip(triangle) {
            on_surface[*from as usize] = *to;
        }
    }
    on_surface
}
