//! The spare way from a surface to a mesh of so many vertices: collapsed edges, then the same polish as after
//! cells. It keeps the topology however few vertices there are, at the price of less even triangles.

pub(crate) mod components;
pub(crate) mod faulty;

use crate::mesh::features::{Curve, FeatureOptions, Features, find_features};
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::simplify::{Kept, Simplified, Site, at_sites, with_vertices};
use crate::mesh::topology::topology;
use crate::polish::{FitOptions, PolishOptions, Target, fit, polish};
use crate::{CoarseToFineOptions, Options, ProgressToken, Result, TriMesh};

/// What is wanted of the mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish<'a> {
    /// Vertices.
    pub vertices: usize,
    /// Edges that turn by more degrees are held as far as there are vertices for it.
    pub feature_angle: f64,
    /// Rounds of the polish.
    pub polish_rounds: u32,
    /// Whether vertices may leave the surface to fit it better.
    pub fit: bool,
    /// Edge length of the whole mesh.
    pub spacing: f64,
    pub progress: &'a ProgressToken,
}

impl<'a> Wish<'a> {
    /// What the options say, at this spacing.
    pub fn of(options: &Options, spacing: f64, progress: &'a ProgressToken) -> Self {
        let CoarseToFineOptions { feature_angle, polish_rounds, fit, .. } = options.coarse_to_fine;
        Self { vertices: options.vertices, feature_angle, polish_rounds, fit, spacing, progress }
    }
}

/// A mesh of the asked number of vertices, or of the least that keeps the topology if that is more; with them
/// at `sites` as far as possible, if there are any.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn spare(surface: &TriMesh, sites: &[Site], wish: &Wish) -> Result<TriMesh> {
    // The share of the phase that this is of is unknown.
    let progress = &wish.progress.silent();
    let raw = simplified(surface, sites, wish)?;
    let mut better = raw.mesh.clone();
    let target = Target::new(surface);
    let options =
        PolishOptions { rounds: wish.polish_rounds, fixed: raw.fixed.clone(), ..Default::default() };
    polish(&mut better, &target, &options, progress)?;
    if wish.fit {
        let options = FitOptions { fixed: raw.fixed, ..Default::default() };
        fit(&mut better, &target, &options, progress)?;
    }
    let crossing = |mesh| Ok(intersecting_faces(mesh, progress)?.len());
    let sound = topology(&better).matches(&topology(&raw.mesh));
    Ok(if sound && crossing(&better)? <= crossing(&raw.mesh)? { better } else { raw.mesh })
}

/// The same before it is polished.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn simplified(surface: &TriMesh, sites: &[Site], wish: &Wish) -> Result<Simplified> {
    let made = |kept: Kept| match sites {
        [] => with_vertices(surface, kept, wish.vertices, wish.progress),
        sites => at_sites(surface, kept, sites, wish.vertices, wish.progress),
    };
    let options = FeatureOptions { feature_angle: wish.feature_angle, ..FeatureOptions::new(wish.spacing) };
    if let Ok(found) = find_features(surface, &options) {
        let sharp = made(Kept { curves: &curve_halves(surface, &found), corners: &found.corners })?;
        if sharp.mesh.vertices.len() <= wish.vertices {
            return Ok(sharp);
        }
    }
    // Sharp edges give way to the number of vertices, the topology does not.
    made(Kept::default())
}

/// Of each half-edge whether it is on a curve.
fn curve_halves(surface: &TriMesh, found: &Features) -> Vec<bool> {
    let ends = found.curves.iter().flat_map(Curve::edge_ends);
    let mut edges: Vec<(u32, u32)> = ends.map(|[a, b]| edge_key(a, b)).collect();
    edges.sort_unstable();
    let corners = surface.triangles.as_flattened();
    let key = |h: u32| edge_key(corners[h as usize], corners[next(h) as usize]);
    (0..corners.len() as u32).map(|h| edges.binary_search(&key(h)).is_ok()).collect()
}
