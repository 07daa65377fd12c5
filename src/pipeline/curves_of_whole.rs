//! The curves of a whole surface of which one half was remeshed.

use super::given_up::Searched;
use super::result::FeatureSummary;
use super::warning::Warning;
use crate::mesh::bvh::Bvh;
use crate::mesh::features::{Curve, FeatureOptions, find_features};
use crate::mesh::spacing;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Options;
use crate::{ProgressToken, Result, TriMesh};
use rayon::prelude::*;

/// Vertices are on a curve if they are this close to it, in diagonals: formats round them.
const ON_CURVE: f64 = 1e-5;

/// The curves for a number of vertices.
pub(crate) struct CurvesOfWhole {
    /// The surface in the unit frame, and its area.
    unit: TriMesh,
    area: f64,
    vertices: usize,
    /// Without vertices on curves; lengths in the units of the input.
    found: FeatureSummary,
    /// The edges of all curves as triangles, in the units of the input.
    edges: Bvh,
    reach: f64,
}

impl CurvesOfWhole {
    /// # Errors
    /// Those of [`find_features`].
    pub fn find(surface: &TriMesh, frame: &UnitFrame, options: &Options, vertices: usize) -> Result<Self> {
        let unit = surface.vertices.iter().map(|p| frame.to_unit(*p)).collect();
        let unit = TriMesh { vertices: unit, triangles: surface.triangles.clone() };
        let area = unit.area();
        let feature_angle = options.coarse_to_fine.feature_angle;
        let wanted = FeatureOptions { feature_angle, ..FeatureOptions::new(spacing(area, vertices)) };
        let features = find_features(&unit, &wanted)?;
        let mut found = FeatureSummary::of(&features);
        found.in_units(frame.scale);
        let edges = features.curves.iter().flat_map(Curve::edge_ends).map(|[a, b]| [a, b, b]).collect();
        let edges = Bvh::new(&TriMesh { vertices: surface.vertices.clone(), triangles: edges });
        Ok(Self { unit, area, vertices, found, edges, reach: ON_CURVE * frame.scale })
    }

    /// With the vertices of a result on them.
    pub fn summary(&self, result: &TriMesh) -> FeatureSummary {
        let is_on = |p: &&glam::DVec3| {
            self.edges.closest(**p).is_some_and(|found| found.distance_sq <= self.reach * self.reach)
        };
        FeatureSummary { curve_sites: result.vertices.par_iter().filter(is_on).count(), ..self.found }
    }

    /// The warnings of sharp edges that are not among them.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn warnings(&self, options: &Options, progress: &ProgressToken) -> Result<Vec<Warning>> {
        let Self { unit, area, vertices, found, .. } = self;
        let feature_angle = options.coarse_to_fine.feature_angle;
        let searched =
            Searched { surface: unit, area: *area, feature_angle, vertices: *vertices, elsewhere: 0 };
        searched.warnings(found, progress)
    }
}
