//! One surface simplified to a number of vertices.

use crate::local::{LocalMesh, LocalOptions, remesh_locally};
use crate::mesh::features::{Curve, FeatureOptions, Features, find_features};
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::simplify::{Preserved, Simplified, Site, at_sites, with_vertices};
use crate::mesh::sizing::SizeField;
use crate::mesh::topology::topology;
use crate::polish::{FitOptions, OutlierOptions, PolishOptions, Target, fit, polish, reduce_outliers};
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
    /// Over the whole surface; `None` if edges are equally long everywhere.
    pub sizes: Option<&'a SizeField>,
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
            sizes: None,
            progress,
        }
    }

    /// The same with another number of vertices.
    pub fn with_vertices(self, vertices: usize) -> Self {
        Self { vertices, ..self }
    }
}

/// Longest target lengths, in spacings, that are tried one after the other.
const LONGEST: [f64; 2] = [1.06, 1.25];
/// Rounds of polish beyond those of a mesh from cells, whose triangles are more even from the start.
const MORE_ROUNDS: u32 = 10;

/// A remeshed or simplified, and polished, mesh with the target number of vertices, or more if the topology
/// needs more; with vertices at `sites` as far as possible, if there are any.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn simplified_and_polished(
    surface: &TriMesh,
    (lengths, sites): (&[f64], &[Site]),
    target: &SimplifyTarget,
) -> Result<TriMesh> {
    // The share of the phase that this is of is unknown.
    let progress = &target.progress.silent();
    if let Some(mesh) = remeshed_locally(surface, lengths, target, progress)? {
        return Ok(mesh);
    }
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

/// The surface remeshed by local operations and polished; `None` if that does not reach the number of
/// vertices, or if more faces intersect than before.
fn remeshed_locally(
    surface: &TriMesh,
    lengths: &[f64],
    target: &SimplifyTarget,
    progress: &ProgressToken,
) -> Result<Option<TriMesh>> {
    let options =
        FeatureOptions { feature_angle: target.feature_angle, ..FeatureOptions::new(target.spacing) };
    let Ok(features) = find_features(surface, &options) else { return Ok(None) };
    let on = Target::new(surface).in_patches(features.patches.clone());
    for longest in LONGEST {
        let options = LocalOptions { vertices: target.vertices, lengths, longest };
        let local = remesh_locally(surface, &features, &on, &options, progress)?;
        if local.mesh.vertices.len() != target.vertices {
            return Ok(None);
        }
        let polished = polished(local, surface, &on, target, progress)?;
        if polished.is_some() {
            return Ok(polished);
        }
    }
    Ok(None)
}

/// A mesh made by local operations, polished as far as its faces do not intersect more than the surface's;
/// `None` if they do so from the beginning.
fn polished(
    local: LocalMesh,
    surface: &TriMesh,
    on: &Target,
    target: &SimplifyTarget,
    progress: &ProgressToken,
) -> Result<Option<TriMesh>> {
    let LocalMesh { mesh: raw, patches, fixed, sliding_curves, lengths } = local;
    let most = intersecting_faces(surface, progress)?.len();
    let is_accepted = |mesh: &TriMesh| -> Result<bool> {
        Ok(topology(mesh).matches(&topology(surface)) && intersecting_faces(mesh, progress)?.len() <= most)
    };
    // The last of the steps after which faces do not intersect more than before.
    let mut best = is_accepted(&raw)?.then(|| raw.clone());
    let mut mesh = raw;
    let rounds = target.polish_rounds + MORE_ROUNDS;
    let options = PolishOptions { rounds, fixed, patches, sliding_curves, lengths, ..Default::default() };
    polish(&mut mesh, on, &options, progress)?;
    if is_accepted(&mesh)? {
        best = Some(mesh.clone());
    }
    let PolishOptions { fixed, patches, lengths, .. } = options;
    if target.fit {
        let options = FitOptions { fixed, patches, ..Default::default() };
        fit(&mut mesh, on, &options, progress)?;
        let FitOptions { fixed, patches, .. } = options;
        let options = OutlierOptions { fixed, patches, lengths, ..Default::default() };
        reduce_outliers(&mut mesh, on, target.spacing, &options, progress)?;
        if is_accepted(&mesh)? {
            best = Some(mesh);
        }
    }
    Ok(best)
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
