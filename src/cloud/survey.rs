//! What can be said of points before a surface is made: spacing, outliers, noise.

use glam::DVec3;
use rayon::prelude::*;

use super::PointCloud;
use super::neighbours::{COUNT, Neighbours, median};
use super::normals::{Plane, noise, planes, relative_thickness};
use super::prepare::{Points, too_few};
use crate::mesh::TriMesh;
use crate::mesh::kd_tree::KdTree;
use crate::{Error, ProgressToken, Result};

/// Curved surfaces without noise have a measured noise of up to this many spacings.
pub(super) const NO_NOISE: f64 = 0.12;
/// Points in the wide surroundings of one.
const WIDE: usize = 128;
/// Surroundings of most points are as thick as this share of their width where there is no surface.
const FILLED: f64 = 0.5;
/// Most points have neighbours on a line if those are narrower than this share of their length.
const LINE: f64 = 0.05;

/// Statistics of a point cloud, with lengths in the unit of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CloudSurvey {
    /// The minimum and maximum coordinates.
    pub bounds: [DVec3; 2],
    /// The median spacing of the points: the square root of the area per point.
    pub spacing: f64,
    /// The minimum and maximum of this distance, each the median around a point.
    pub spacing_range: [f64; 2],
    /// Number of points at the position of another one, which [`crate::cloud::surface`] leaves out.
    pub duplicates: usize,
    /// Number of outliers, with 2.5 times the spacing of their neighbours, which are also left out.
    pub outliers: usize,
    /// The standard deviation of points from planes through their 16 nearest: noise, and the curvature of the
    /// surface, which alone makes up to [`CloudSurvey::CURVATURE`] spacings. `None` where points lie on
    /// lines.
    pub noise: Option<f64>,
}

impl CloudSurvey {
    /// The apparent noise of a noiseless cloud, in spacings, due to curvature.
    pub const CURVATURE: f64 = NO_NOISE;
}

/// Surveys a cloud of at least two different points. Spacing and noise are without duplicates and outliers.
///
/// # Errors
/// [`Error::Input`] for coordinates that are not finite, for fewer points, and for normals that are not as
/// many as points. [`Error::Cancelled`].
pub fn survey(cloud: &PointCloud, progress: &ProgressToken) -> Result<CloudSurvey> {
    let mut points = Points::new(cloud, 2)?;
    let (neighbours, outliers) = neighbours_without_outliers(&mut points, progress)?;
    let found = Survey::new(&points, &KdTree::new(&points.at), &neighbours, progress)?;
    let range = neighbours.spacing.iter();
    let range = range.fold([f64::INFINITY, 0.0], |[low, high], s| [s.min(low), s.max(high)]);
    let all = TriMesh { vertices: cloud.points.clone(), triangles: Vec::new() };
    let [low, high] = all.bounds().unwrap_or_default();
    let scale = points.frame.scale;
    Ok(CloudSurvey {
        bounds: [low, high],
        spacing: found.spacing * scale,
        spacing_range: range.map(|spacing| spacing * scale),
        duplicates: points.duplicates,
        outliers,
        noise: found.thickness.map(|thickness| thickness * found.spacing * scale),
    })
}

/// Normals of length 1 for the points of a cloud, of either sign: those of the planes through the 16 nearest
/// points of each, or of the nearest point that is not an outlier. [`crate::cloud::oriented_normals`] gives
/// them signs.
///
/// # Errors
/// As [`survey`].
pub fn unoriented_normals(cloud: &PointCloud, progress: &ProgressToken) -> Result<Vec<DVec3>> {
    let mut points = Points::new(cloud, 2)?;
    neighbours_without_outliers(&mut points, progress)?;
    let tree = KdTree::new(&points.at);
    let shapes = planes(&points.at, &[], &tree, COUNT, progress)?;
    let nearest = |p: &DVec3| tree.nearest(points.frame.to_unit(*p)).unwrap_or(0);
    Ok(cloud.points.par_iter().map(|p| shapes[nearest(p) as usize].normal).collect())
}

/// Leaves out the points that are far from all others; returns the neighbours of the others, and their
/// number.
pub(super) fn neighbours_without_outliers(
    points: &mut Points,
    progress: &ProgressToken,
) -> Result<(Neighbours, usize)> {
    let found = Neighbours::new(&points.at, &points.normals, &KdTree::new(&points.at), progress)?;
    let outliers = found.outliers.len();
    if outliers == 0 {
        return Ok((found, 0));
    }
    let mut is_out = vec![false; points.at.len()];
    found.outliers.iter().for_each(|i| is_out[*i as usize] = true);
    let kept: Vec<u32> = (0..points.at.len() as u32).filter(|i| !is_out[*i as usize]).collect();
    if kept.len() <= COUNT {
        return Err(too_few(kept.len()));
    }
    points.keep(&kept);
    Ok((Neighbours::new(&points.at, &points.normals, &KdTree::new(&points.at), progress)?, outliers))
}

/// What the scale of everything else follows from.
pub(super) struct Survey<T> {
    /// The median distance between points, in the unit frame.
    pub spacing: f64,
    /// Standard deviation of points from planes through their neighbours, in spacings.
    pub thickness: T,
}

impl Survey<Option<f64>> {
    /// Without a thickness where points lie on lines.
    fn new(
        points: &Points,
        tree: &KdTree,
        neighbours: &Neighbours,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let spacing = median(neighbours.spacing.iter().copied());
        // The other side of a thin sheet is not noise.
        let shapes: Vec<Plane> = planes(&points.at, &points.normals, tree, COUNT, progress)?;
        let width = median(shapes.iter().map(|plane| plane.extents[1] / plane.extents[2]));
        let is_surface = width > LINE;
        Ok(Self { spacing, thickness: is_surface.then(|| noise(&shapes, &neighbours.spacing)) })
    }
}

impl Survey<f64> {
    /// # Errors
    /// [`Error::Input`] where points lie on lines, or fill a volume.
    pub fn of_surface(
        points: &Points,
        tree: &KdTree,
        neighbours: &Neighbours,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let Survey { spacing, thickness } = Survey::new(points, tree, neighbours, progress)?;
        let Some(thickness) = thickness else {
            let remedy = "give points that cover a surface evenly";
            return Err(Error::input(None, "the points lie on lines and not on a surface", remedy));
        };
        if fill_volume(&points.at, tree, progress)? {
            let remedy =
                "give points of a surface, with less noise; values on a grid can be read as a volume";
            return Err(Error::input(None, "the points fill a volume and lie on no surface", remedy));
        }
        Ok(Self { spacing, thickness })
    }
}

/// Whether there are too many points for their surroundings to be this thick by chance. Noise is less in wide
/// surroundings; those may be as thick as a thin tube, but then narrow ones are flat.
pub(super) fn fill_volume(points: &[DVec3], tree: &KdTree, progress: &ProgressToken) -> Result<bool> {
    let is_thick = |count| Ok(relative_thickness(points, tree, count, progress)? > FILLED);
    Ok(points.len() > 8 * WIDE && is_thick(COUNT)? && is_thick(WIDE)?)
}
