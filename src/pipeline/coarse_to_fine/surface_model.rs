//! The surface in the forms that the default pipeline needs, with its features and its size field.

use super::level::DeviceSurface;
use super::near_points::{GROWTH, shorter_at_points};
use super::size_field::{Curvatures, SizeRequest, size_field};
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
use std::sync::Arc;

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

/// The surface with the features found by some options: what models with other edge lengths share.
#[derive(Clone)]
pub(crate) struct FeaturedSurface {
    options: FeatureOptions,
    twins: Arc<Vec<u32>>,
    records: Arc<TriangleRecords>,
    /// As one patch.
    whole: Target,
    /// In its patches.
    target: Target,
    /// Without sizes; `None` without features.
    curves: Option<Arc<SurfaceCurves>>,
    curvatures: Arc<Curvatures>,
    /// In the unit-diagonal frame.
    summary: FeatureSummary,
}

/// Makes the size field for the curves of a surface.
type MakeSizes<'a> = dyn Fn(Option<&SurfaceCurves>, &Curvatures) -> Result<SizeField> + Sync + 'a;

/// The surface for a number of vertices, on which its features and sizes depend.
pub(crate) struct SurfaceModel {
    featured: FeaturedSurface,
    /// For projections on the host.
    pub target: Target,
    /// `None` without features.
    pub curves: Option<Arc<SurfaceCurves>>,
    pub sizes: SizeField,
    /// Vertices of the surface that stay where they are, rising.
    pub pinned: Vec<u32>,
    device_sizes: Option<DeviceSizes>,
    /// Counts of the features, without sites, and lengths in the units of the input.
    pub features: FeatureSummary,
}

impl SurfaceModel {
    /// With the features and sizes of the run and the request; what does not differ is taken over from
    /// `known`.
    ///
    /// # Errors
    /// As [`SurfaceModel::with`], and those of the user's curves.
    pub fn new(
        context: &RunContext,
        request: &ModelRequest,
        known: Option<FeaturedSurface>,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let RunContext { device, mesh, frame, surface, options, plan, .. } = *context;
        let ModelRequest { vertices, sizing, refined, .. } = *request;
        let on_surface = surface_vertices(surface, mesh);
        let features = feature_options(context, request, &on_surface)?;
        let by_surface = |values: &[f64]| by_surface(&on_surface, values);
        let given = if let Sizing::Given(values) = sizing { by_surface(values) } else { Vec::new() };
        let [fixed, floors] = [refined, &plan.refined.least].map(by_surface);
        let sizes = |curves: Option<&SurfaceCurves>, curvatures: &Curvatures| {
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
            let field = size_field(&mesh, (curves, curvatures), &request)?;
            let at_points = curves.map_or_else(Vec::new, |curves| shorter_at_points(curves, spacing));
            Ok(field.shortened(&mesh, &at_points, GROWTH, spacing))
        };
        let mut model = Self::with(device, surface, &features, (known, &sizes), progress)?;
        model.features.in_units(frame.scale);
        Ok(model)
    }

    /// With the features found by `options`, in the unit-diagonal frame, and the size field that `sizes`
    /// makes for them; what does not differ is taken over from `known`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if the surface does not fit on the device, [`crate::Error::Cancelled`],
    /// and those of [`find_features`] and `sizes`.
    pub fn with(
        device: &Device,
        surface: &Surface,
        options: &FeatureOptions,
        (known, sizes): (Option<FeaturedSurface>, &MakeSizes),
        progress: &ProgressToken,
    ) -> Result<Self> {
        if let Some(known) = known.as_ref().filter(|known| known.options == *options) {
            let sizes = sizes(known.curves.as_deref(), &known.curvatures)?;
            let device_sizes = DeviceSizes::new(device, &sizes)?;
            return Ok(Self::of(known.clone(), sizes, device_sizes));
        }
        let mesh = surface.mesh();
        // The records of other features leave the device before there are new ones.
        let (twins, whole) = match known {
            Some(known) => (known.twins, Some(known.whole)),
            None => (Arc::new(twins(&mesh.triangles)), None),
        };
        let curvatures = Arc::new(Curvatures::default());
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
            let sizes = sizes(curves.as_ref(), &curvatures)?;
            progress.poll()?;
            let records =
                TriangleRecords::with_twins(device, surface, curves.as_ref(), twins.as_ref().clone())?;
            let device_sizes = DeviceSizes::new(device, &sizes)?;
            Ok((Arc::new(records), curves, FeatureSummary::of(&features), sizes, device_sizes))
        };
        let whole = || whole.unwrap_or_else(|| Target::with_twins(&mesh, &twins));
        let (parts, whole) = rayon::join(parts, whole);
        let (records, curves, summary, sizes, device_sizes) = parts?;
        let patches = curves.as_ref().map_or_else(Vec::new, |curves| curves.patches.clone());
        let target = whole.clone().in_patches(patches);
        let (options, curves) = (options.clone(), curves.map(Arc::new));
        let featured =
            FeaturedSurface { options, twins, records, whole, target, curves, curvatures, summary };
        Ok(Self::of(featured, sizes, device_sizes))
    }

    fn of(featured: FeaturedSurface, sizes: SizeField, device_sizes: Option<DeviceSizes>) -> Self {
        let mut pinned = featured.options.user_corners.clone();
        pinned.sort_unstable();
        let sized = |curves: &Arc<SurfaceCurves>| match sizes.is_uniform() {
            true => Arc::clone(curves),
            false => Arc::new(curves.as_ref().clone().with_sizes(&sizes)),
        };
        Self {
            target: featured.target.clone(),
            curves: featured.curves.as_ref().map(sized),
            features: featured.summary,
            pinned,
            sizes,
            device_sizes,
            featured,
        }
    }

    /// What models with other edge lengths share with this one.
    pub fn featured(&self) -> FeaturedSurface {
        self.featured.clone()
    }

    /// The surface on the device.
    pub fn on_device(&self) -> DeviceSurface<'_> {
        DeviceSurface { records: &self.featured.records, sizes: self.device_sizes.as_ref() }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DeviceOptions;
    use crate::mesh::samples::sample;
    use crate::mesh::unit_frame::UnitFrame;
    use glam::DVec3;

    #[test]
    fn what_is_taken_over_from_another_model_is_as_if_made_afresh() {
        let device = Device::open(&DeviceOptions::from_env()).unwrap();
        let mesh = sample("box").unwrap();
        let surface = Surface::new(&mesh, &UnitFrame::of(&mesh).unwrap());
        let unit = surface.mesh();
        let even = |_: Option<&SurfaceCurves>, _: &Curvatures| Ok(SizeField::default());
        let uneven = |_: Option<&SurfaceCurves>, _: &Curvatures| {
            let lengths = unit.vertices.iter().map(|p| 0.1 + 0.05 * p.x.abs()).collect();
            Ok(SizeField::new(unit.clone(), lengths))
        };
        let with = |angle: f64, known: Option<FeaturedSurface>, sizes: &MakeSizes| {
            let options = FeatureOptions { feature_angle: angle, ..FeatureOptions::new(0.1) };
            SurfaceModel::with(&device, &surface, &options, (known, sizes), &ProgressToken::default())
                .unwrap()
        };
        let first = with(40.0, None, &even);
        assert!(first.curves.is_some());
        for (angle, sizes, is_shared) in
            [(40.0, &uneven as &MakeSizes, true), (40.0, &even, true), (180.0, &even, false)]
        {
            let (other, fresh) = (with(angle, Some(first.featured()), sizes), with(angle, None, sizes));
            assert_eq!(Arc::ptr_eq(&other.featured.records, &first.featured.records), is_shared);
            assert_eq!(other.features, fresh.features);
            assert_eq!(other.sizes.range(), fresh.sizes.range());
            let lengths = |model: &SurfaceModel| {
                model.curves.as_ref().map(|curves| curves.lengths().collect::<Vec<f64>>())
            };
            assert_eq!(lengths(&other), lengths(&fresh));
            for k in 0..20 {
                let p = DVec3::new(f64::from(k), f64::from(k * k), 1.0).map(f64::sin);
                let closest = |model: &SurfaceModel| model.target.closest(p, p, 0, &mut 0);
                assert_eq!(closest(&other), closest(&fresh));
            }
        }
    }
}
