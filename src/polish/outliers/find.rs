//! Where mesh and surface are far apart.

use glam::DVec3;
use rayon::prelude::*;

use super::FAR;
use super::edit::Ground;
use crate::mesh::bvh::Bvh;
use crate::polish::relax::CHUNK;
use crate::{Result, TriMesh};

/// Where nearly everything is far, these many spots are looked at, and one more for so many vertices.
const MOST_SPOTS: usize = 100;
const VERTICES_A_SPOT: usize = 100;

/// A point of the mesh and one of the surface that should not be so far apart.
pub(crate) struct Outlier {
    distance: f64,
    pub triangle: u32,
    /// From the mesh to the surface.
    pub offset: DVec3,
    /// On the surface.
    pub at: DVec3,
}

/// Where mesh and surface are far apart, the farthest first, and the surface's vertices nearest to each
/// triangle.
pub(crate) fn find(mesh: &TriMesh, ground: &Ground) -> Result<(Vec<Outlier>, Vec<Vec<u32>>)> {
    let Ground { target, options, edge, progress } = *ground;
    let bvh = Bvh::new(mesh);
    progress.poll()?;
    let shortest = options.lengths.iter().copied().reduce(f64::min).unwrap_or(1.0);
    let least = (FAR * edge * shortest).powi(2);
    let inward: Vec<_> = (target.points.par_iter())
        .with_min_len(CHUNK)
        .map_init(|| 0, |rank, point| bvh.closest_or_near(point.at, rank, least))
        .collect();
    let mut points_of = vec![Vec::new(); mesh.triangles.len()];
    let mut spots = Vec::new();
    for (p, found) in inward.iter().enumerate() {
        let Some(found) = found else { continue };
        points_of[found.triangle as usize].push(p as u32);
        if found.distance_sq > ground.least_sq(mesh.triangles[found.triangle as usize]) {
            let at = target.points[p].at;
            let offset = at - found.point;
            spots.push(Outlier { distance: offset.length(), triangle: found.triangle, offset, at });
        }
    }
    progress.poll()?;
    let outward: Vec<Outlier> = (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map_init(|| 0, |rank, t| outward(mesh, ground, t, rank))
        .flatten()
        .collect();
    spots.extend(outward);
    spots.sort_by(|a, b| b.distance.total_cmp(&a.distance).then(a.triangle.cmp(&b.triangle)));
    spots.truncate(MOST_SPOTS + mesh.vertices.len() / VERTICES_A_SPOT);
    Ok((spots, points_of))
}

/// The farthest of a triangle's samples, if it is far.
fn outward(mesh: &TriMesh, ground: &Ground, t: u32, rank: &mut usize) -> Option<Outlier> {
    let least = ground.least_sq(mesh.triangles[t as usize]);
    let spots = samples(mesh.corners(t as usize)).into_iter().filter_map(|p| {
        let found = ground.target.bvh.closest_or_near(p, rank, least)?;
        let (distance, offset) = (found.distance_sq.sqrt(), found.point - p);
        (found.distance_sq > least).then_some(Outlier { distance, triangle: t, offset, at: found.point })
    });
    spots.max_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Points of a triangle that stand for it.
fn samples([a, b, c]: [DVec3; 3]) -> [DVec3; 7] {
    [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0]
}
