//! From points to a surface: neighbours, normals, field, triangles, ends.

use glam::DVec3;
use rayon::prelude::*;

use super::PointCloud;
use super::field::{Oriented, field};
use super::fill::fill;
use super::neighbours::{COUNT, Neighbours};
use super::normals::{planes, with_own_sheets};
use super::orient::orient;
use super::prepare::{LEAST, Points, check};
use super::signs::normals_disagree;
use super::survey::{NO_NOISE, Survey, fill_volume, neighbours_without_outliers};
use super::terrain::{is_flat, is_terrain, terrain};
use super::trim::trim;
use crate::mesh::attributes::{Attribute, Attributes};
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::handles::remove_small_handles;
use crate::mesh::kd_tree::KdTree;
use crate::mesh::level_set::extract;
use crate::mesh::repair::{RepairOptions, repair_with};
use crate::progress::ProgressReporter;
use crate::{Error, Flow, Phase, Progress, ProgressToken, Result, TriMesh};

/// How a surface is made of points.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct SurfaceOptions {
    /// Boundary loops up to this diameter, in the unit of the points, are filled; infinity closes the
    /// surface. Loops of up to six spacings are always filled, because random points leave such gaps.
    pub fill_holes: f64,
    /// The kind of object.
    pub kind: SurfaceKind,
}

/// The kind of object that points show, which determines how a surface is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SurfaceKind {
    /// A terrain if points without normals are classified as ground or buildings, or if they are flat and
    /// have one height at most places but not everywhere, or if they are flat and fill a volume; otherwise an
    /// object.
    #[default]
    Automatic,
    /// A landscape seen from above, along z: ground and roofs with one height at each place, without trees
    /// and other objects. From classified points it uses ground, buildings, water, roads, rails and bridges.
    Terrain,
    /// Any object; all points are on the surface.
    Object,
}

impl SurfaceOptions {
    /// Sets [`SurfaceOptions::fill_holes`].
    #[must_use]
    pub fn fill_holes(self, fill_holes: f64) -> Self {
        Self { fill_holes, ..self }
    }

    /// Sets [`SurfaceOptions::kind`].
    #[must_use]
    pub fn kind(self, kind: SurfaceKind) -> Self {
        Self { kind, ..self }
    }

    /// # Errors
    /// [`Error::Usage`] for what is out of range.
    pub fn validate(&self) -> Result<()> {
        if self.fill_holes >= 0.0 {
            return Ok(());
        }
        let problem = format!("`fill_holes` {} is out of range", self.fill_holes);
        Err(Error::option("fill_holes", problem, "use 0 or a length, or infinity"))
    }
}

/// A surface through points.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CloudSurface {
    /// The surface, in the units of the points: manifold, with many small and uneven triangles, for
    /// [`crate::remesh`].
    pub mesh: TriMesh,
    /// Values of the nearest points, for each vertex.
    pub attributes: Attributes,
    /// The distance between points, in their units: the side of the square that one has for itself. Half of
    /// the points have more room.
    pub spacing: f64,
    /// The side of the cells that the surface was made with, in their units: smaller details are lost. Wider
    /// than the spacing with noise, with many points, or where some are much closer than others.
    pub cell: f64,
    /// The distance of points from the surface near them, root mean square, in their units.
    pub noise: f64,
    /// Points left out since others are at the same place.
    pub duplicates: usize,
    /// Points left out since they are far from all others.
    pub outliers: usize,
    /// Parts of the surface left out since they are too small for one.
    pub small_parts: usize,
    /// Boundary loops that were filled; not counted for a terrain.
    pub filled: usize,
    /// Handles and tunnels removed, of up to six spacings, as chance makes them between points.
    pub handles: usize,
    /// Points left out to finish early: the surface goes through an even choice of the others.
    pub unused: usize,
    /// Whether the surface is a terrain ([`SurfaceKind::Terrain`]).
    pub is_terrain: bool,
    /// For a terrain, points left out since their class is neither ground nor building.
    pub other_classes: usize,
    /// For a terrain, points left out since they are above it, below it or far off, as of trees, walls, cars.
    pub off_terrain: usize,
    /// Whether the given normals disagreed with their neighbours', so that none was used.
    pub normals_disagree: bool,
}

/// Radius of the points' weights, in spacings, of points without noise. Even random points leave gaps of two
/// spacings' radius.
const RADIUS: f64 = 3.2;
/// Added to [`RADIUS`] for noise of one spacing.
const RADIUS_FOR_NOISE: f64 = 7.0;
/// Side of the grid's cells, in spacings.
const SIDE: f64 = 1.0;
/// Added to [`SIDE`] for noise of one spacing.
const SIDE_FOR_NOISE: f64 = 0.7;
/// Nodes this share of a point's radius away from it, or farther, are not reached by it alone.
const REACH: f64 = 0.9;
/// For noise of one spacing, points reach nodes this many spacings farther away.
const NOISE_REACH: f64 = 2.0;
/// Weights are as wide as for this spacing at least, in sides of the grid's cells.
const LEAST_SPACING: f64 = 0.9;
/// Points with opposite normals belong to two sheets if these are this many spacings plus the noise apart.
const APART: f64 = 0.1;
/// A part of a surface has at least the room of this many points.
const LEAST_POINTS: f64 = 30.0;
/// Cells are larger where the surface would have more triangles than this; devices with little memory in one
/// buffer take some more.
const MOST_TRIANGLES: f64 = 2e6;
/// Cells are larger where points would reach more nodes of the grid than this: with points of very different
/// density, the cells of the dense ones fill the wide reach of the others.
const MOST_NODES: f64 = 3e7;
/// Boundary loops up to this many spacings across are filled.
const GAP: f64 = 6.0;
/// Surfaces with more handles than this keep all of them, since to remove them would take long.
const MOST_HANDLES: usize = 10_000;

/// About this many points are used to finish early: they take less than a second.
const FEW: usize = 40_000;

/// A surface through the points of a cloud.
///
/// # Errors
/// [`Error::Input`] for coordinates that are not finite, fewer than 10 points, points on one line or without
/// any surface.
pub fn surface(cloud: &PointCloud, options: &SurfaceOptions) -> Result<CloudSurface> {
    surface_with_progress(cloud, options, |_| {})
}

/// Like [`surface`], calling `progress` several times a second, as [`crate::remesh_with_progress`] does.
///
/// # Errors
/// As [`surface`], and [`Error::Cancelled`] if `progress` asks for it.
pub fn surface_with_progress<F: Into<Flow>>(
    cloud: &PointCloud,
    options: &SurfaceOptions,
    mut progress: impl FnMut(Progress) -> F,
) -> Result<CloudSurface> {
    options.validate()?;
    let mut callback = |now| progress(now).into();
    let mut reporter = ProgressReporter::new(&mut callback);
    reporter.phase(Phase::Surface, 1.0, 1.0)?;
    reporter.during(|token| run(cloud, options, token))
}

fn run(cloud: &PointCloud, options: &SurfaceOptions, progress: &ProgressToken) -> Result<CloudSurface> {
    check(cloud)?;
    if cloud.points.len() < 2 * FEW {
        return with_agreeing_normals(cloud, options, progress);
    }
    let rough = |progress: &ProgressToken| {
        let fewer = cloud.one_of(cloud.points.len() / FEW);
        let found = with_agreeing_normals(&fewer, options, progress)?;
        Ok(CloudSurface { unused: cloud.points.len() - fewer.points.len(), ..found })
    };
    progress.or_rough(|progress| with_agreeing_normals(cloud, options, progress), rough)
}

/// With the normals of the cloud if they agree.
fn with_agreeing_normals(
    cloud: &PointCloud,
    options: &SurfaceOptions,
    progress: &ProgressToken,
) -> Result<CloudSurface> {
    if normals_disagree(cloud, progress)? {
        let found = run_with_known(&PointCloud { normals: Vec::new(), ..cloud.clone() }, options, progress)?;
        return Ok(CloudSurface { normals_disagree: true, ..found });
    }
    run_with_known(cloud, options, progress)
}

/// With the normals of the cloud, which agree, or without any.
fn run_with_known(
    cloud: &PointCloud,
    options: &SurfaceOptions,
    progress: &ProgressToken,
) -> Result<CloudSurface> {
    let is_terrain = match options.kind {
        SurfaceKind::Automatic => is_terrain(cloud, progress)?,
        kind => kind == SurfaceKind::Terrain,
    };
    if is_terrain {
        return landscape(cloud, options, progress);
    }
    let mut points = Points::new(cloud, LEAST)?;
    let (neighbours, outliers) = neighbours_without_outliers(&mut points, &progress.part(0.0, 0.2))?;
    let tree = KdTree::new(&points.at);
    if options.kind == SurfaceKind::Automatic && is_flat(cloud) && fill_volume(&points.at, &tree, progress)? {
        return landscape(cloud, options, progress);
    }
    let Survey { spacing, thickness } = Survey::of_surface(&points, &tree, &neighbours, progress)?;
    let radius = radius_for(thickness);
    progress.done(0.3)?;
    let normals = normals(&points, &tree, &neighbours, radius, progress)?;
    progress.done(0.5)?;
    let side = (SIDE + SIDE_FOR_NOISE * (thickness - NO_NOISE).max(0.0)) * spacing;
    let side = side.max(least_side(&neighbours.spacing, radius));
    // Where points are dense, too, all nodes of a cell that the surface crosses must be reached.
    let radii: Vec<f64> =
        neighbours.spacing.iter().map(|own| radius * own.max(LEAST_SPACING * side)).collect();
    let oriented = Oriented {
        points: &points.at,
        normals: &normals,
        spacing: &neighbours.spacing,
        radius: &radii,
        apart: APART + thickness,
        reach: (RADIUS * REACH + NOISE_REACH * (thickness - NO_NOISE).max(0.0)) / radius,
    };
    let found = field(&oriented, side, &progress.part(0.5, 0.8))?;
    let extracted = extract(&found.grid, progress)?;
    progress.done(0.9)?;
    let offset = extracted.interpolated(&found.offset);
    // With noise, all is wider.
    let room = radius / RADIUS * spacing;
    let (mut mesh, small_parts) = trim(&extracted.mesh, &offset, room, LEAST_POINTS * room.powi(2));
    if mesh.triangles.is_empty() {
        let remedy = "give points that cover a surface, several times closer than its details";
        return Err(Error::input(None, "could not build a surface through the points", remedy));
    }
    let gap = (GAP * room).max(options.fill_holes / points.frame.scale);
    let filled = fill(&mut mesh, gap, progress)?;
    let handles = remove_small_handles(&mut mesh, GAP * room, MOST_HANDLES, progress)?;
    progress.done(0.95)?;
    let mut mesh = with_smooth_boundary(mesh, spacing)?;
    let attributes = carry_attributes(&cloud.attributes, &points.origin, &tree, &mesh);
    mesh.vertices.iter_mut().for_each(|p| *p = points.frame.to_input_units(*p));
    Ok(CloudSurface {
        mesh,
        attributes,
        spacing: spacing * points.frame.scale,
        cell: side * points.frame.scale,
        noise: thickness * spacing * points.frame.scale,
        duplicates: points.duplicates,
        outliers,
        small_parts,
        filled,
        handles,
        unused: 0,
        is_terrain: false,
        other_classes: 0,
        off_terrain: 0,
        normals_disagree: false,
    })
}

/// The surface of ground and roofs.
fn landscape(cloud: &PointCloud, options: &SurfaceOptions, progress: &ProgressToken) -> Result<CloudSurface> {
    let Some(found) = terrain(cloud, options.fill_holes, progress)? else {
        let remedy = "give points that are seen from above, along z, and cover an area";
        return Err(Error::input(None, "the points show no terrain", remedy));
    };
    let mut mesh = with_smooth_boundary(found.mesh, found.spacing)?;
    let attributes = if cloud.attributes.vertex.is_empty() {
        Attributes::default()
    } else {
        let used: Vec<DVec3> =
            found.used.par_iter().map(|i| cloud.points[*i as usize] - found.origin).collect();
        carry_attributes(&cloud.attributes, &found.used, &KdTree::new(&used), &mesh)
    };
    mesh.vertices.par_iter_mut().for_each(|p| *p += found.origin);
    Ok(CloudSurface {
        mesh,
        attributes,
        spacing: found.spacing,
        cell: found.cell,
        noise: found.noise,
        duplicates: 0,
        outliers: 0,
        small_parts: found.small_parts,
        filled: 0,
        handles: 0,
        unused: 0,
        is_terrain: true,
        other_classes: found.other_classes,
        off_terrain: found.off_surface,
        normals_disagree: false,
    })
}

/// Outward normals of length 1 for the points of a cloud: its own if they agree, otherwise computed ones.
/// Points that [`surface`] leaves out have that of the nearest other point.
///
/// # Errors
/// As [`surface`].
pub fn oriented_normals(cloud: &PointCloud) -> Result<Vec<DVec3>> {
    let progress = &ProgressToken::default();
    let mut points = Points::new(cloud, LEAST)?;
    if normals_disagree(cloud, progress)? {
        points.normals.clear();
    }
    let (neighbours, _) = neighbours_without_outliers(&mut points, progress)?;
    let tree = KdTree::new(&points.at);
    let Survey { thickness, .. } = Survey::of_surface(&points, &tree, &neighbours, progress)?;
    let normals = normals(&points, &tree, &neighbours, radius_for(thickness), progress)?;
    let nearest = |p: &DVec3| tree.nearest(points.frame.to_unit(*p)).unwrap_or(0);
    Ok(cloud.points.par_iter().map(|p| normals[nearest(p) as usize]).collect())
}

/// The radius of the weights of points with this much noise, both in spacings.
fn radius_for(thickness: f64) -> f64 {
    RADIUS + RADIUS_FOR_NOISE * (thickness - NO_NOISE).max(0.0)
}

/// The least side of the grid's cells with which neither triangles nor nodes are too many.
fn least_side(spacing: &[f64], radius: f64) -> f64 {
    // A surface of area A has about 3 A / side^2 triangles. Nodes are reached on both sides of it.
    let area: f64 = spacing.iter().map(|own| own * own).sum();
    let volume: f64 = spacing.iter().map(|own| 2.0 * radius * own.powi(3)).sum();
    (3.0 * area / MOST_TRIANGLES).sqrt().max((volume / MOST_NODES).cbrt())
}

/// The mesh with a boundary as smooth as the points allow; random ones end on a ragged line.
fn with_smooth_boundary(mesh: TriMesh, spacing: f64) -> Result<TriMesh> {
    let has_boundary = EdgeTable::new(&mesh.triangles).edges().any(|edge| edge.len() == 1);
    let Some([low, high]) = mesh.bounds().filter(|_| has_boundary) else { return Ok(mesh) };
    let share = (spacing / high.distance(low)).min(0.1);
    repair_with(&mesh, &RepairOptions::default().smooth_boundary(share)).map(|repaired| repaired.mesh)
}

/// The normals that are given, or those of planes that agree with each other.
fn normals(
    points: &Points,
    tree: &KdTree,
    neighbours: &Neighbours,
    radius: f64,
    progress: &ProgressToken,
) -> Result<Vec<DVec3>> {
    if !points.normals.is_empty() && points.normals.iter().all(|n| *n != DVec3::ZERO) {
        return Ok(points.normals.clone());
    }
    let count = (COUNT as f64 * (radius / RADIUS).powi(2)) as usize;
    let mut shapes = planes(&points.at, &[], tree, count, progress)?;
    with_own_sheets(&points.at, tree, count, &neighbours.spacing, &mut shapes, progress)?;
    orient((&points.at, tree), &shapes, count, neighbours, progress)
}

/// Values of the nearest points, for the vertices of a mesh. The points of the tree are those of the cloud
/// with the numbers `origin`.
fn carry_attributes(attributes: &Attributes, origin: &[u32], tree: &KdTree, mesh: &TriMesh) -> Attributes {
    if attributes.vertex.is_empty() {
        return Attributes::default();
    }
    let nearest = |p: &DVec3| origin[tree.nearest(*p).unwrap_or(0) as usize];
    let nearest: Vec<u32> = mesh.vertices.par_iter().map(nearest).collect();
    let of = |attribute: &Attribute| {
        let values = nearest.iter().flat_map(|i| attribute.at(*i as usize)).copied().collect();
        Attribute { values, ..attribute.clone() }
    };
    Attributes { vertex: attributes.vertex.iter().map(of).collect(), ..Attributes::default() }
}
