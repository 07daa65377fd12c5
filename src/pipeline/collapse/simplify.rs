//! One surface simplified to a number of vertices.

use crate::mesh::features::{Curve, FeatureOptions, Features, find_features};
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::simplify::{Preserved, Simplified, Site, at_sites, with_vertices};
use crate::mesh::topology::topology;
use crate::polish::{FitOptions, PolishOptions, Target, fit, polish};
use crate::{Options, ProgressToken, Result, TriMesh};

/// What to simplify to, and how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SimplifyTarget<'a> {
    pub vertices: usize,
    /// Edges that turn by more than so many degrees are kept, as far as there are vertices for it.
    pub feature_angle: f64,
    /// Rounds of the polish.
    pub polish_rounds: u32,
    /// Whether vertices may leave the surface for a closer fit.
    pub fit: bool,
    /// Edge length of the whole mesh.
    pub spacing: f64,
    pub progress: &'a ProgressToken,
}

impl<'a> SimplifyTarget<'a> {
    /// From the options, for a mesh with this spacing.
    pub fn new(options: &Options, vertices: usize, spacing: f64, progress: &'a ProgressToken) -> Self {
        let method = &options.coarse_to_fine;
        Self {
            vertices,
            feature_angle: method.feature_angle,
            polish_rounds: method.polish_rounds,
            fit: method.fit,
            spacing,
            progress,
        }
    }

    /// The same with another number of vertices.
    pub fn with_vertices(self, vertices: usize) -> Self {
        Self { vertices, ..self }
    }
}

/// A simplified and polished mesh with the target number of vertices, or more if the topology needs more;
/// with vertices at `sites` as far as possible, if there are any.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn simplified_and_polished(
    surface: &TriMesh,
    sites: &[Site],
    target: &SimplifyTarget,
) -> Result<TriMesh> {
    // The share of the phase that this is of is unknown.
    let progress = &target.progress.silent();
    let raw = simplified(surface, sites, target)?;
    let mut better = raw.mesh.clone();
    let surface = Target::new(surface);
    let fixed = raw.fixed;
    let options = PolishOptions { rounds: target.polish_rounds, fixed: fixed.clone(), ..Default::default() };
    polish(&mut better, &surface, &options, progress)?;
    if target.fit {
        fit(&mut better, &surface, &FitOptions { fixed, ..Default::default() }, progress)?;
    }
    let intersections = |mesh| Ok(intersecting_faces(mesh, progress)?.len());
    let is_sound = topology(&better).matches(&topology(&raw.mesh));
    Ok(if is_sound && intersections(&better)? <= intersections(&raw.mesh)? { better } else { raw.mesh })
}

/// The same without the polish.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn simplified(surface: &TriMesh, sites: &[Site], target: &SimplifyTarget) -> Result<Simplified> {
    let simplify = |preserved: Preserved| match sites {
        [] => with_vertices(surface, preserved, target.vertices, target.progress),
        sites => at_sites(surface, preserved, sites, target.vertices, target.progress),
    };
    let options =
        FeatureOptions { feature_angle: target.feature_angle, ..FeatureOptions::new(target.spacing) };
    if let Ok(features) = find_features(surface, &options) {
        let curves = curve_half_edges(surface, &features);
        let with_curves = simplify(Preserved { curves: &curves, corners: &features.corners })?;
        if with_curves.mesh.vertices.len() <= target.vertices {
            return Ok(with_curves);
        }
    }
    // The number of vertices comes before sharp edges, but not before the topology.
    simplify(Preserved::default())
}

/// For each half-edge whether it is on a curve.
fn curve_half_edges(surface: &TriMesh, features: &Features) -> Vec<bool> {
    let ends = features.curves.iter().flat_map(Curve::edge_ends);
    let mut edges: Vec<(u32, u32)> = ends.map(|[a, b]| edge_key(a, b)).collect();
    edges.sort_unstable();
    let corners = surface.triangles.as_flattened();
    let key = |h: u32| edge_key(corners[h as usize], corners[next(h) as usize]);
    (0..corners.len() as u32).map(|h| edges.binary_search(&key(h)).is_ok()).collect()
}
