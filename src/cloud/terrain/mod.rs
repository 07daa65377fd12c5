//! A landscape seen from above: the surface of ground and roofs, without what stands on it or floats above.

mod cells;
mod fill;
mod heights;
mod regions;

use glam::DVec3;

use super::PointCloud;
use super::trim::without_pinches;
use crate::mesh::TriMesh;
use crate::mesh::attributes::Attribute;
use crate::mesh::repair::connected_components;
use crate::mesh::submesh::without_unused_vertices;
use crate::{ProgressToken, Result};
use cells::{Cells, flatness};
use heights::Heights;

/// The attribute with the classes of the points.
const CLASSIFICATION: &str = "classification";
/// Classes of the LAS standard that a terrain consists of: ground, building, model key point, water, rail,
/// road surface, bridge deck.
const KEPT: [f64; 7] = [2.0, 6.0, 8.0, 9.0, 10.0, 11.0, 17.0];
/// Classes that are noise: low and high.
const NOISE: [f64; 2] = [7.0, 18.0];
/// At least this share of the points must be ground or buildings for classes to be used.
const CLASSIFIED: f64 = 0.02;
/// Points seen from above are at most as high as this fraction of their width.
const FLAT: f64 = 0.35;
/// The fraction of points in cells with several heights, if points seen from above show trees or roofs. With
/// less they are a plain surface; with more, an object or an upright surface.
const SEVERAL: std::ops::Range<f64> = 0.02..0.5;
/// Fewer points than this are not a landscape.
const LEAST: usize = 1000;
/// Components have the room of at least this many points.
const LEAST_POINTS: f64 = 30.0;

/// A landscape, in the units of its points.
pub(super) struct Terrain {
    /// Relative to `origin`.
    pub mesh: TriMesh,
    pub origin: DVec3,
    /// The distance between points, seen from above.
    pub spacing: f64,
    /// The side of the square cells, each with one height.
    pub cell: f64,
    /// The distance of the used points from the surface, root mean square.
    pub noise: f64,
    /// The points that were used, ascending.
    pub used: Vec<u32>,
    /// Points left out since their class is not part of a terrain.
    pub other_classes: usize,
    /// Points left out since they are above the surface, below it, or far off.
    pub off_surface: usize,
    pub small_parts: usize,
}

/// Which points of a cloud a terrain may consist of.
struct Candidates {
    points: Vec<u32>,
    /// Whether their classes are those of ground and buildings.
    are_classified: bool,
}

impl Candidates {
    fn of(cloud: &PointCloud) -> Self {
        let all = || (0..cloud.points.len() as u32).collect();
        let Some(classes) = cloud.attributes.vertex.iter().find(|a| is_classification(a)) else {
            return Self { points: all(), are_classified: false };
        };
        let with = |wanted: &dyn Fn(f64) -> bool| -> Vec<u32> {
            let classes = (0..).zip(&classes.values);
            classes.filter(|(_, class)| wanted(**class)).map(|(i, _)| i).collect()
        };
        let kept = with(&|class| KEPT.contains(&class));
        if kept.len() as f64 > CLASSIFIED * cloud.points.len() as f64 {
            return Self { points: kept, are_classified: true };
        }
        Self { points: with(&|class| !NOISE.contains(&class)), are_classified: false }
    }

    fn are_flat(&self, cloud: &PointCloud) -> bool {
        !self.points.is_empty() && flatness(&cloud.points, &self.points) < FLAT
    }
}

fn is_classification(attribute: &Attribute) -> bool {
    attribute.name == CLASSIFICATION && attribute.components == 1
}

/// Whether a cloud shows a landscape from above: its points are classified as ground or buildings, or they
/// are flat, and at most places they have one height.
pub(super) fn is_terrain(cloud: &PointCloud, progress: &ProgressToken) -> Result<bool> {
    if cloud.points.len() < LEAST || !cloud.normals.is_empty() {
        return Ok(false);
    }
    let candidates = Candidates::of(cloud);
    if candidates.are_classified {
        return Ok(true);
    }
    if !candidates.are_flat(cloud) {
        return Ok(false);
    }
    let cells = Cells::new(&cloud.points, &candidates.points, progress)?;
    Ok(cells.is_some_and(|cells| SEVERAL.contains(&cells.share_with_several_heights())))
}

/// Whether the points could be a landscape that is hidden by trees: they are flat as a whole.
pub(super) fn is_flat(cloud: &PointCloud) -> bool {
    cloud.points.len() >= LEAST && cloud.normals.is_empty() && Candidates::of(cloud).are_flat(cloud)
}

/// The landscape that points show from above, along z. Holes up to `fill_holes` across are filled, and those
/// of some cells in any case. `None` if there is no surface.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn terrain(
    cloud: &PointCloud,
    fill_holes: f64,
    progress: &ProgressToken,
) -> Result<Option<Terrain>> {
    let candidates = Candidates::of(cloud);
    let Some(cells) = Cells::new(&cloud.points, &candidates.points, progress)? else { return Ok(None) };
    progress.done(0.3)?;
    let mut heights = Heights::lowest(&cells, progress)?;
    if !candidates.are_classified {
        regions::leave_out_what_stands(&cells, &mut heights, progress)?;
    }
    progress.done(0.5)?;
    let tilted = Heights::along_slopes(&cells, &heights, progress)?;
    let (used, noise) = (tilted.used, tilted.noise);
    let (is_hidden, heights) = (heights.hidden, tilted.values);
    progress.done(0.7)?;
    let heights = fill::filled(cells.size, heights, &is_hidden, fill_holes / cells.side, progress)?;
    let (mesh, small_parts) = triangulate(&cells, &heights);
    progress.done(0.9)?;
    if mesh.triangles.is_empty() {
        return Ok(None);
    }
    let other_classes = cloud.points.len() - candidates.points.len();
    let off_surface = candidates.points.len() - used.len();
    let Cells { origin, spacing, side: cell, .. } = cells;
    Ok(Some(Terrain { mesh, origin, spacing, cell, noise, used, other_classes, off_surface, small_parts }))
}

/// Two triangles in each square of four cells with heights, one in that of three; without small components,
/// which are counted.
fn triangulate(cells: &Cells, heights: &[f64]) -> (TriMesh, usize) {
    let [nx, ny] = cells.size;
    let place = |cell: usize| {
        let [x, y] = [cell % nx, cell / nx].map(|c| (c as f64 + 0.5) * cells.side);
        DVec3::new(x, y, heights[cell])
    };
    let vertices = (0..heights.len()).map(place).collect();
    let mut triangles = Vec::new();
    for low in (0..ny.saturating_sub(1)).flat_map(|y| (0..nx - 1).map(move |x| x + nx * y)) {
        let around = [low, low + 1, low + 1 + nx, low + nx];
        let missing: Vec<usize> = (0..4).filter(|k| heights[around[*k]].is_nan()).collect();
        let corner = |k: usize| around[k % 4] as u32;
        match missing[..] {
            [] => {
                // Along the diagonal whose ends are nearer in height.
                let across = |k: usize| (heights[around[k]] - heights[around[k + 2]]).abs();
                let first = usize::from(across(1) < across(0));
                triangles.extend([0, 2].map(|k| [first + k, first + k + 1, first + k + 2].map(corner)));
            }
            [gone] => triangles.push([gone + 1, gone + 2, gone + 3].map(corner)),
            _ => {}
        }
    }
    let mesh = TriMesh { vertices, triangles };
    let (of_triangle, areas) = connected_components(&mesh);
    let least = LEAST_POINTS * cells.spacing * cells.spacing;
    let is_small = |t: usize| areas[of_triangle[t] as usize] < least;
    let kept = (0..mesh.triangles.len()).filter(|t| !is_small(*t)).map(|t| mesh.triangles[t]).collect();
    let small = areas.iter().filter(|area| **area < least).count();
    (without_unused_vertices(&mesh, without_pinches(mesh.vertices.len(), kept)), small)
}
