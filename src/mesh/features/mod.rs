//! Features: the curves, corners and patches that remeshing must preserve.
//!
//! *Curves* are chains of boundary, non-manifold, inconsistently oriented, sharp and user's edges; *corners*
//! are where curves end, branch or turn sharply; *patches* are what is left when the surface is cut along its
//! curves.

mod chains;
mod corners;
mod curve;
mod discarded;
mod graph;
mod grow;
mod network;
mod patches;
mod round;
mod scale;
mod sharpness;
mod short_chains;
mod strips;
mod surface;
mod user_lines;
mod wedges;

use glam::DVec3;

use std::collections::HashSet;

use super::TriMesh;
use super::half_edges::edge_key;
use super::triangle::area;
use super::unit_frame::UnitFrame;
use crate::{Error, Result};
pub use curve::{Curve, CurveKind};
pub use discarded::Discarded;
use graph::Graph;
use scale::Scale;
use surface::FeatureSurface;
pub use user_lines::{FeatureLine, user_edges};

/// A loop of sharp edges shorter than this many spacings is the rim of a small hole or pin.
pub(crate) const LONGEST_RIM: f64 = 8.0;

/// What counts as a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureOptions {
    /// Least angle in degrees between the normals on both sides of a sharp edge, above 0 to 180; 180 turns
    /// sharp edges off. Chains are followed down to 0.4 of it.
    pub feature_angle: f64,
    /// Typical edge length of the output in the mesh's units, above 0: chains shorter than a few of it are
    /// discarded, and normals are averaged over half of it.
    pub spacing: f64,
    /// Edges that the user marks as curves, each as its two vertices in either order.
    pub user_edges: Vec<[u32; 2]>,
    /// Vertices that the user marks as corners.
    pub user_corners: Vec<u32>,
    /// Edges between such corners that stay whole if they are curves, each as its smaller vertex and the
    /// other.
    pub whole_edges: HashSet<(u32, u32)>,
    /// Whether rows of edges between facets narrower than the spacing are taken for those of a round surface
    /// that is sampled coarsely, and not for sharp edges.
    pub round_facets: bool,
}

impl FeatureOptions {
    /// The default feature angle in degrees.
    pub const FEATURE_ANGLE: f64 = 40.0;

    /// The default options for an output of this spacing, in the mesh's units.
    pub fn new(spacing: f64) -> Self {
        Self {
            feature_angle: Self::FEATURE_ANGLE,
            spacing,
            user_edges: Vec::new(),
            user_corners: Vec::new(),
            whole_edges: HashSet::new(),
            round_facets: false,
        }
    }
}

/// Curves, corners and patches of a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Features {
    /// The curves; every curve edge is in exactly one.
    pub curves: Vec<Curve>,
    /// Vertices where curves end, branch or turn sharply, or where sheets of the surface meet in a point
    /// alone; ascending.
    pub corners: Vec<u32>,
    /// The patch of each triangle, counted from 0 in the order of the patches' first triangles.
    pub patches: Vec<u32>,
    /// How many patches there are.
    pub patch_count: usize,
    /// Corners that are there only because the user marked them, ascending.
    pub user_corners: Vec<u32>,
    /// For each curve whether it is one edge that stays whole; empty if none is.
    pub whole: Vec<bool>,
    /// Sharp edges that were discarded again.
    pub discarded: Discarded,
}

impl Features {
    /// The curves of each kind that occurs, kinds and curves in order.
    pub fn curves_by_kind(&self) -> impl Iterator<Item = (CurveKind, Vec<&Curve>)> {
        let of = |kind| (kind, self.curves.iter().filter(|curve| curve.kind == kind).collect::<Vec<_>>());
        CurveKind::ALL.into_iter().map(of).filter(|(_, curves)| !curves.is_empty())
    }
}

/// Finds the features of `mesh`, which must be as [`super::repair::repair`] leaves it.
///
/// # Errors
///
/// [`Error::Usage`] for options out of range; [`Error::Input`] for a user's edge that the mesh does not have,
/// for coordinates that are not finite, and for vertices that are all at one point.
pub fn find_features(mesh: &TriMesh, options: &FeatureOptions) -> Result<Features> {
    check(options)?;
    if mesh.triangles.is_empty() && options.user_edges.is_empty() {
        return Ok(Features::default());
    }
    let frame = UnitFrame::of(mesh)?;
    let points: Vec<DVec3> = mesh.vertices.iter().map(|&v| frame.to_unit(v)).collect();
    let scale = Scale { feature: options.feature_angle, spacing: options.spacing / frame.scale };

    let mut surface = FeatureSurface::new(&points, &mesh.triangles, scale.spacing);
    surface.add_user_edges(&options.user_edges)?;
    let mut discarded = Discarded::default();
    let mut turns = sharpness::turns(&surface, scale);
    if options.round_facets {
        round::discard_round(&points, &surface, &mut turns, scale, &mut discarded);
    }
    let candidates = sharpness::candidates(&points, &surface, &turns, scale);
    let mut graph = Graph::new(&points, candidates);
    grow::follow(&mut graph, scale);
    short_chains::discard_short_chains(&mut graph, scale.spacing, &mut discarded);
    strips::discard_strips(&mut graph, &surface, scale.spacing, &mut discarded);
    wedges::discard_wedges(&mut graph, &surface, scale.spacing, &mut discarded);
    if discarded.strips > 0 {
        short_chains::discard_short_chains(&mut graph, scale.spacing, &mut discarded);
    }
    discarded.in_units(frame.scale);

    let mut corners = corners::find(&graph, &surface, scale.spacing);
    let mut user_corners = options.user_corners.clone();
    user_corners.retain(|v| corners.get_mut(*v as usize).is_some_and(|is| !std::mem::replace(is, true)));
    user_corners.sort_unstable();
    let mut curves = chains::curves(&graph, &corners);
    curves.iter_mut().for_each(|curve| curve.length *= frame.scale);
    let whole = whole_curves(&curves, options);
    let (patches, patch_count) = patches::patches(&graph, &surface);
    let corners = (0..).zip(&corners).filter(|(_, is)| **is).map(|(vertex, _)| vertex).collect();
    Ok(Features { curves, corners, patches, patch_count, user_corners, whole, discarded })
}

/// For each curve whether it is one of the edges that stay whole.
fn whole_curves(curves: &[Curve], options: &FeatureOptions) -> Vec<bool> {
    if options.whole_edges.is_empty() {
        return Vec::new();
    }
    let is_whole = |curve: &Curve| match *curve.vertices {
        [a, b] => options.whole_edges.contains(&edge_key(a, b)),
        _ => false,
    };
    curves.iter().map(is_whole).collect()
}

/// The spacing of `vertices` vertices on `mesh`: the edge length of a perfect hexagonal layout on its area,
/// in the mesh's units.
///
/// # Errors
///
/// [`Error::Input`]: no vertices, a coordinate that is not finite, or no extent.
pub fn spacing_of(mesh: &TriMesh, vertices: usize) -> Result<f64> {
    let frame = UnitFrame::of(mesh)?;
    let area = |t: usize| area(mesh.corners(t).map(|corner| frame.to_unit(corner)));
    let area: f64 = (0..mesh.triangles.len()).map(area).sum();
    Ok(frame.scale * super::spacing(area, vertices))
}

fn check(options: &FeatureOptions) -> Result<()> {
    let FeatureOptions { feature_angle, spacing, .. } = options;
    if !(*feature_angle > 0.0 && *feature_angle <= 180.0) {
        let problem = format!("the feature angle {feature_angle} is out of range");
        return Err(Error::usage(
            problem,
            "use a number above 0 and at most 180 degrees, such as 40; 180 disables \
        sharp edges",
        ));
    }
    if !(*spacing > 0.0 && spacing.is_finite()) {
        let problem = format!("the spacing {spacing} is not a length above 0");
        return Err(Error::usage(problem, "give the edge length that the output should have"));
    }
    Ok(())
}
