//! Distances between a mesh and points: how well it fits a scan.

use std::collections::HashSet;

use glam::DVec3;
use serde::Serialize;

use super::neighbours::{Neighbours, median};
use crate::mesh::bvh::Bvh;
use crate::mesh::distance::{check_faces, placed, usual_samples};
use crate::mesh::kd_tree::KdTree;
use crate::mesh::sampling::{Samples, Tally, tally_of};
use crate::mesh::{TriMesh, position_key};
use crate::{ProgressToken, Result};

/// Distances between a mesh and points, in percent of the diagonal of the points' bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PointDistances {
    /// Number of points; all are measured, including outliers.
    pub points: usize,
    /// Diagonal of their bounding box, in their unit.
    pub diagonal: f64,
    /// From each point to the mesh: how accurate the mesh is.
    pub from_points: DistanceStatistics,
    /// From at least 100,000 samples of the mesh, half along its edges and half over its triangles, to the
    /// nearest point: how far the mesh extends beyond the points. Where the mesh passes through the points,
    /// these distances are about half of the spacing.
    pub to_points: DistanceStatistics,
    /// The median spacing of the points: the square root of the area per point.
    pub spacing: f64,
}

/// Statistics of many distances.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceStatistics {
    /// Root mean square.
    pub rms: f64,
    /// Mean.
    pub mean: f64,
    /// The largest.
    pub largest: f64,
}

impl DistanceStatistics {
    fn new(tally: &Tally, unit: f64) -> Self {
        Self { rms: tally.rms() * unit, mean: tally.mean() * unit, largest: tally.largest() * unit }
    }
}

/// Distances between a mesh and points in its unit, both ways, as in Cignoni, Rocchini and Scopigno, "Metro",
/// 1998, with points in place of one mesh. The result is the same on every run and for every number of
/// threads.
///
/// # Errors
/// [`crate::Error::Input`] if the mesh has no faces, if a coordinate is not finite, if all points are at one
/// place, or if the mesh reaches 1e60 times as far as they do. [`crate::Error::Cancelled`]. Panics if an
/// index is out of range.
pub fn point_distances(mesh: &TriMesh, points: &[DVec3], progress: &ProgressToken) -> Result<PointDistances> {
    check_faces("mesh", mesh)?;
    let points = TriMesh { vertices: points.to_vec(), triangles: Vec::new() };
    let (mesh, placed, diagonal) = placed(mesh, &points)?;
    let hierarchy = Bvh::new(&mesh);
    let to_mesh = |p: DVec3, rank: &mut usize| hierarchy.closest_from(p, rank).map(|found| found.distance_sq);
    let from_points = tally_of(&placed.vertices, to_mesh, progress)?;
    let places = each_place(&placed.vertices);
    let tree = KdTree::new(&places);
    let to_nearest =
        |p: DVec3, _: &mut usize| tree.nearest(p).map(|i| places[i as usize].distance_squared(p));
    let samples = Samples::new(&mesh, &hierarchy, usual_samples(&mesh, &placed));
    let to_points = samples.tally(to_nearest, progress)?;
    let spacing = median(Neighbours::new(&places, &[], &tree, progress)?.spacing.into_iter());
    let percent = 100.0 / diagonal;
    Ok(PointDistances {
        points: placed.vertices.len(),
        diagonal: points.bounds().map_or(0.0, |[low, high]| low.distance(high)),
        from_points: DistanceStatistics::new(&from_points, percent),
        to_points: DistanceStatistics::new(&to_points, percent),
        spacing: spacing * percent,
    })
}

/// The places of points, each once.
fn each_place(points: &[DVec3]) -> Vec<DVec3> {
    let mut seen = HashSet::with_capacity(points.len());
    points.iter().filter(|p| seen.insert(position_key(**p))).copied().collect()
}
