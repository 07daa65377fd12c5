//! The spare way from a surface to a mesh of so many vertices: collapsed edges, then the same polish as after
//! cells. It keeps the topology however few vertices there are, at the price of less even triangles.

pub(crate) mod components;
pub(crate) mod faulty;

use crate::mesh::features::{Curve, FeatureOptions, Features, find_features};
use crate::mesh::half_edges::{edge_key, next};
use crate::mesh::intersections::intersecting_faces_until;
use crate::mesh::simplify::{Kept, Simplified, Site, at_sites_until, with_vertices_until};
use crate::mesh::topology::topology;
use crate::polish::{FitOptions, PolishOptions, Target, fit_while, polish_while};
use crate::{CoarseToFineOptions, Options, TriMesh};
use std::sync::atomic::{AtomicBool, Ordering};

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
    /// Once set, nobody wants it any more: whatever it is then, it is to be there soon.
    pub stop: &'a AtomicBool,
}

impl<'a> Wish<'a> {
    /// What the options say, at this spacing.
    pub fn of(options: &Options, spacing: f64, stop: &'a AtomicBool) -> Self {
        let CoarseToFineOptions { feature_angle, polish_rounds, fit, .. } = options.coarse_to_fine;
        Self { vertices: options.vertices, feature_angle, polish_rounds, fit, spacing, stop }
    }
}

/// A mesh of the asked number of vertices, or of the least that keeps the topology if that is more; with them
/// at `sites` as far as possible, if there are any.
pub(crate) fn spare(surface: &TriMesh, sites: &[Site], wish: &Wish) -> TriMesh {
    let raw = simplified(surface, sites, wish);
    let mut better = raw.mesh.clone();
    let target = Target::new(surface);
    let options =
        PolishOptions { rounds: wish.polish_rounds, fixed: raw.fixed.clone(), ..Default::default() };
    let mut go_on = |_| !wish.stop.load(Ordering::Relaxed);
    polish_while(&mut better, &target, &options, &mut go_on);
    if wish.fit {
        fit_while(&mut better, &target, &FitOptions { fixed: raw.fixed, ..Default::default() }, &mut go_on);
    }
    let crossing = |mesh| intersecting_faces_until(mesh, wish.stop).len();
    let sound = topology(&better).matches(&topology(&raw.mesh));
    if sound && crossing(&better) <= crossing(&raw.mesh) { better } else { raw.mesh }
}

/// The same before it is polished.
pub(crate) fn simplified(surface: &TriMesh, sites: &[Site], wish: &Wish) -> Simplified {
    let made = |kept: Kept| match sites {
        [] => with_vertices_until(surface, kept, wish.vertices, wish.stop),
        sites => at_sites_until(surface, kept, (sites, wish.vertices), wish.stop),
    };
    let options = FeatureOptions { feature_angle: wish.feature_angle, ..FeatureOptions::new(wish.spacing) };
    let sharp = find_features(surface, &options)
        .ok()
        .map(|found| made(Kept { curves: &curve_halves(surface, &found), corners: &found.corners }));
    // Sharp edges give way to the number of vertices, the topology does not.
    sharp.filter(|made| made.mesh.vertices.len() <= wish.vertices).unwrap_or_else(|| made(Kept::default()))
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
