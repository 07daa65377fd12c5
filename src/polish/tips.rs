//! Tips: vertices go to the points of the surface that the mesh misses most, as corners and the tips of ears.
//!
//! Evenly spread vertices meet a corner by chance only; half a spacing beside it, the mesh cuts it off. A vertex moved
//! onto it lowers the Hausdorff distance, and its neighbours make room.

use glam::DVec3;
use rayon::prelude::*;

use super::is_locked;
use super::links::{Links, next, previous};
use super::relax::{spoils, vertex_normal};
use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::quality::TriangleQuality;

/// Points nearer to the mesh than this share of the typical edge are met well enough.
const MISSED: f64 = 0.25;
/// A vertex farther from the point than this share of the typical edge is not its vertex.
const FARTHEST: f64 = 0.9;
/// No triangle's smallest angle may fall below this many degrees, unless it was smaller before.
const LEAST_ANGLE: f64 = 20.0;
/// Least cosine between the normals of the surface at the point and of the vertex: else the point is in a fold.
const AGREEMENT: f64 = 0.3;

/// Moves vertices of `mesh` to those vertices of `surface` that the mesh misses by most and that are tips: farther off
/// than the surface's vertices around them. Says which vertices moved; they should stay there.
///
/// `edge` is the typical length of the mesh's edges. The topology stays, and no triangle folds. Panics if an index is
/// out of range.
pub fn reach_tips(mesh: &mut TriMesh, surface: &TriMesh, edge: f64) -> Vec<bool> {
    let links = Links::new(std::mem::take(&mut mesh.triangles), mesh.vertices.len());
    let mut moved = vec![false; mesh.vertices.len()];
    let current = TriMesh { vertices: mesh.vertices.clone(), triangles: links.triangles.clone() };
    for Missed { at, normal, triangle, .. } in missed(&current, surface, edge) {
        let points = &mesh.vertices;
        let near = links.triangles[triangle as usize].into_iter().min_by(|a, b| {
            let far = |v: u32| points[v as usize].distance_squared(at);
            far(*a).total_cmp(&far(*b)).then(a.cmp(b))
        });
        let Some(v) = near.filter(|v| may_go(&links, points, &moved, *v, at, normal, edge)) else { continue };
        mesh.vertices[v as usize] = at;
        moved[v as usize] = true;
    }
    mesh.triangles = links.triangles;
    moved
}

/// A vertex of the surface that the mesh misses.
struct Missed {
    distance_sq: f64,
    at: DVec3,
    /// Unit normal of the surface there.
    normal: DVec3,
    /// The nearest triangle of the mesh.
    triangle: u32,
}

/// The tips that are missed, the worst first.
fn missed(mesh: &TriMesh, surface: &TriMesh, edge: f64) -> Vec<Missed> {
    let bvh = Bvh::new(mesh);
    let near: Vec<(f64, u32)> = surface
        .vertices
        .par_iter()
        .map_init(
            || 0,
            |rank, p| {
                let found = bvh.closest_from(*p, rank);
                found.map_or((0.0, 0), |c| (c.distance_sq, c.triangle))
            },
        )
        .collect();
    let mut normals = vec![DVec3::ZERO; surface.vertices.len()];
    // A tip is farther off than all its neighbours; ties go to the lower index.
    let mut is_tip: Vec<bool> = near.iter().map(|(d, _)| *d > (MISSED * edge).powi(2)).collect();
    for (t, triangle) in surface.triangles.iter().enumerate() {
        let [a, b, c] = surface.corners(t);
        for v in triangle {
            normals[*v as usize] += (b - a).cross(c - a);
            is_tip[*v as usize] &= triangle.iter().all(|w| {
                let (mine, other) = (near[*v as usize].0, near[*w as usize].0);
                mine > other || (mine == other && v <= w)
            });
        }
    }
    let mut tips: Vec<(usize, Missed)> = (0..near.len())
        .filter(|v| is_tip[*v])
        .map(|v| {
            let (distance_sq, triangle) = near[v];
            let normal = normals[v].normalize_or_zero();
            (v, Missed { distance_sq, at: surface.vertices[v], normal, triangle })
        })
        .collect();
    tips.sort_by(|(v, a), (w, b)| b.distance_sq.total_cmp(&a.distance_sq).then(v.cmp(w)));
    tips.into_iter().map(|(_, tip)| tip).collect()
}

/// Whether vertex `v` may go `to` a tip with this normal.
fn may_go(
    links: &Links,
    points: &[DVec3],
    moved: &[bool],
    v: u32,
    to: DVec3,
    normal: DVec3,
    edge: f64,
) -> bool {
    let here = points[v as usize];
    let up = vertex_normal(links, points, v);
    if is_locked(links, moved, v as usize)
        || here.distance(to) > FARTHEST * edge
        || up.dot(normal) < AGREEMENT
    {
        return false;
    }
    links.ring(v).all(|h| {
        let [q, r] = [next(h), previous(h)].map(|h| points[links.origin(h) as usize]);
        let angle = |p: DVec3| TriangleQuality::new([p, q, r]).min_angle();
        !spoils([here, q, r], [to, q, r], up) && angle(to) >= LEAST_ANGLE.min(angle(here))
    })
}
