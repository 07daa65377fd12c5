//! Where the vertices and faces of a remeshed surface lie on the mesh that it was made from.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::TriMesh;
use super::bvh::Bvh;
use super::repair::Repaired;
use super::triangle::{closest_on_triangle, doubled_normal};
use super::unit_frame::UnitFrame;
use crate::{ProgressToken, Result};

/// A triangle that faces the other way counts only if it is nearer than the nearest one that faces the same
/// way by more than this share of the length of the edges there.
const OTHER_SIDE: f64 = 0.5;
/// Weights below this share are rounding: the point is on the side, or at the corner.
const ON_SIDE: f64 = 1e-11;
/// Points that each thread takes in a row; those that follow each other are near each other.
const CHUNK: usize = 512;

/// A point of a triangle mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Index into [`TriMesh::triangles`].
    pub triangle: u32,
    /// The weights of the triangle's corners, each 0..=1, summing to 1.
    pub barycentric: [f64; 3],
}

/// The parts of a mesh whose places on another one are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CorrespondenceRequest {
    /// Its vertices.
    pub vertices: bool,
    /// The centres of its faces, of which there are twice as many.
    pub faces: bool,
}

impl CorrespondenceRequest {
    /// Nothing.
    pub const NONE: Self = Self { vertices: false, faces: false };
    /// Vertices and faces.
    pub const ALL: Self = Self { vertices: true, faces: true };
}

/// Where a mesh lies on another one; lists that were not requested are empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Correspondence {
    /// For each vertex the nearest point among triangles that face as the faces around the vertex do, unless
    /// one that faces otherwise is much nearer. A vertex on a curve lies on an edge of that curve.
    pub vertices: Vec<SurfacePoint>,
    /// For the centre of each face, the nearest point in the same sense.
    pub faces: Vec<SurfacePoint>,
}

impl SurfacePoint {
    /// Its place on `mesh`. Panics if the mesh is another one.
    pub fn position(&self, mesh: &TriMesh) -> DVec3 {
        let [a, b, c] = mesh.corners(self.triangle as usize);
        let [_, v, w] = self.barycentric;
        a + (b - a) * v + (c - a) * w
    }
}

/// Finds where the requested parts of `output` lie on `input`, which `repaired` was made from.
///
/// # Errors
/// [`crate::Error::Input`]: no vertices, a coordinate that is not finite, or no extent;
/// [`crate::Error::Cancelled`].
pub fn find_correspondence(
    input: &TriMesh,
    repaired: &Repaired,
    output: &TriMesh,
    request: CorrespondenceRequest,
    progress: &ProgressToken,
) -> Result<Correspondence> {
    find_correspondence_by(None, input, repaired, output, request, progress)
}

/// Like [`find_correspondence`], by a search over the repaired mesh in its unit frame; `None` makes a new
/// one.
///
/// # Errors
/// As [`find_correspondence`].
pub(crate) fn find_correspondence_by(
    search: Option<SurfaceSearch>,
    input: &TriMesh,
    repaired: &Repaired,
    output: &TriMesh,
    request: CorrespondenceRequest,
    progress: &ProgressToken,
) -> Result<Correspondence> {
    let frame = UnitFrame::of(&repaired.mesh)?;
    let unit = |mesh: &TriMesh| TriMesh {
        vertices: mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect(),
        triangles: mesh.triangles.clone(),
    };
    let (search, points) = rayon::join(
        || search.unwrap_or_else(|| SurfaceSearch::new(&unit(&repaired.mesh))),
        || query_points(&unit(output), request),
    );
    // Each point is looked for where `first` says, or else where the one before it was found.
    let find = |points: &[QueryPoint], first: &(dyn Fn(usize) -> Option<usize> + Sync)| -> Result<Found> {
        let chunks = points.par_chunks(CHUNK).zip((0..points.len()).into_par_iter().step_by(CHUNK));
        let found = chunks.take_any_while(|_| !progress.is_cancelled()).flat_map_iter(|(chunk, start)| {
            let mut rank = 0;
            let of_input = |(index, point): (usize, &QueryPoint)| {
                rank = first(index).unwrap_or(rank);
                let triangle = repaired.origin[search.find(point, &mut rank) as usize];
                // Of the input's own triangle, whose corners repair may have in another order.
                let corners = input.corners(triangle as usize).map(|p| frame.to_unit(p));
                let barycentric = snapped(closest_on_triangle(point.at, corners).barycentric);
                (SurfacePoint { triangle, barycentric }, rank)
            };
            (start..).zip(chunk).map(of_input).collect::<Vec<_>>()
        });
        let found = found.unzip();
        progress.poll()?;
        Ok(found)
    };
    let (vertices, faces) = points.split_at(if request.vertices { output.vertices.len() } else { 0 });
    let (vertices, ranks) = find(vertices, &|_| None)?;
    let beside = |t: usize| ranks.get(output.triangles[t][0] as usize).copied();
    let (faces, _) = find(faces, &beside)?;
    Ok(Correspondence { vertices, faces })
}

/// Points with their ranks among the triangles of a [`SurfaceSearch`].
type Found = (Vec<SurfacePoint>, Vec<usize>);

/// A point to be found.
pub(super) struct QueryPoint {
    pub at: DVec3,
    /// Along the normal there, of any length.
    pub normal: DVec3,
    /// How much nearer a triangle that faces otherwise must be.
    pub margin: f64,
}

/// The vertices of a mesh, then the centres of its faces, as far as they are requested.
fn query_points(mesh: &TriMesh, request: CorrespondenceRequest) -> Vec<QueryPoint> {
    let mut normals = vec![DVec3::ZERO; mesh.vertices.len()];
    let mut lengths = vec![(0.0, 0.0); mesh.vertices.len()];
    let mut centres = Vec::with_capacity(if request.faces { mesh.triangles.len() } else { 0 });
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let normal = doubled_normal([a, b, c]);
        let around = a.distance(b) + b.distance(c) + c.distance(a);
        for v in triangle {
            normals[*v as usize] += normal;
            let (sum, count) = &mut lengths[*v as usize];
            *sum += around;
            *count += 3.0;
        }
        if request.faces {
            centres.push(QueryPoint { at: (a + b + c) / 3.0, normal, margin: OTHER_SIDE * around / 3.0 });
        }
    }
    if !request.vertices {
        return centres;
    }
    let at_vertices = mesh.vertices.iter().zip(normals).zip(lengths);
    let mut points: Vec<QueryPoint> = at_vertices
        .map(|((at, normal), (sum, count))| {
            let margin = if count > 0.0 { OTHER_SIDE * sum / count } else { 0.0 };
            QueryPoint { at: *at, normal, margin }
        })
        .collect();
    points.append(&mut centres);
    points
}

/// A surface prepared for [`find_correspondence`].
pub(crate) struct SurfaceSearch {
    /// A hierarchy over its triangles.
    pub(crate) bvh: Arc<Bvh>,
    /// The normal of each triangle, of any length.
    pub(crate) normals: Arc<Vec<DVec3>>,
    /// For each triangle its index in the repaired mesh; empty if that is its own.
    pub(crate) origin: Vec<u32>,
}

impl SurfaceSearch {
    pub(super) fn new(surface: &TriMesh) -> Self {
        let normals = (0..surface.triangles.len()).map(|t| surface.doubled_normal(t)).collect();
        Self { normals: Arc::new(normals), bvh: Arc::new(Bvh::new(surface)), origin: Vec::new() }
    }

    /// The triangle of the repaired mesh that a point lies on. `rank` is where to look first, and then where
    /// it was.
    pub(super) fn find(&self, point: &QueryPoint, rank: &mut usize) -> u32 {
        let found = self.find_own(point, rank);
        self.origin.get(found as usize).copied().unwrap_or(found)
    }

    /// Like [`SurfaceSearch::find`], but by the search's own numbers.
    fn find_own(&self, point: &QueryPoint, rank: &mut usize) -> u32 {
        let faces_so = |t: u32| self.normals[t as usize].dot(point.normal) > 0.0;
        let same = self.bvh.closest_accepted(point.at, rank, faces_so);
        if let Some(near) = same.filter(|near| near.distance_sq <= point.margin * point.margin) {
            return near.triangle;
        }
        let any = self.bvh.closest_from(point.at, rank);
        let much_nearer = |any: f64, same: f64| same.sqrt() > any.sqrt() + point.margin;
        match (same, any) {
            (Some(same), Some(any)) if !much_nearer(any.distance_sq, same.distance_sq) => same.triangle,
            (_, Some(any)) => any.triangle,
            // A point that is not finite is nowhere; a repaired mesh has a triangle 0.
            (same, None) => same.map_or(0, |same| same.triangle),
        }
    }
}

/// Weights that rounding left just off a side or a corner, moved onto it.
pub(super) fn snapped(weights: [f64; 3]) -> [f64; 3] {
    let kept = weights.map(|w| if w < ON_SIDE { 0.0 } else { w });
    let sum: f64 = kept.iter().sum();
    kept.map(|w| w / sum)
}

/// Values at the vertices of `input`, carried over to those of the repaired mesh.
pub(crate) fn vertex_values_after(input: &TriMesh, repaired: &Repaired, values: &[f64]) -> Vec<f64> {
    let mut after = vec![f64::NAN; repaired.mesh.vertices.len()];
    for (triangle, origin) in repaired.mesh.triangles.iter().zip(&repaired.origin) {
        for v in triangle {
            let at = repaired.mesh.vertices[*v as usize];
            let near = |w: &&u32| input.vertices[**w as usize].distance_squared(at);
            let corners = input.triangles[*origin as usize];
            // Welding may have moved it, but it was one of these.
            let nearest = corners.iter().min_by(|a, b| near(a).total_cmp(&near(b)));
            if let Some(w) = nearest.filter(|_| after[*v as usize].is_nan()) {
                after[*v as usize] = values[*w as usize];
            }
        }
    }
    after
}

/// The half-edges of the repaired mesh where the given ones of `input` are, each `3 * triangle + k`; those
/// that it does not have are left out.
pub(crate) fn half_edges_after(input: &TriMesh, repaired: &Repaired, half_edges: &[u32]) -> Vec<u32> {
    if half_edges.is_empty() {
        return Vec::new();
    }
    // Triangles that fill holes have none of them.
    let is_own = |t: &u32| !repaired.patches.contains(&(*t as usize));
    let own = repaired.origin.iter().copied().zip(0..).filter(|(_, t)| is_own(t));
    let mut kept: Vec<(u32, u32)> = own.collect();
    kept.sort_unstable();
    let of_one = |half: &u32| {
        let (triangle, side) = (half / 3, half % 3);
        let first = kept.partition_point(|(origin, _)| *origin < triangle);
        let now = kept[first..].iter().take_while(move |(origin, _)| *origin == triangle);
        let corners = input.triangles.get(triangle as usize).map(|_| input.corners(triangle as usize));
        now.filter_map(move |(_, t)| side_between(repaired, *t, corners?, side as usize))
    };
    let mut found: Vec<u32> = half_edges.iter().flat_map(of_one).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The side of triangle `t` that runs where side `side` of a triangle with these corners does, either way
/// round.
fn side_between(repaired: &Repaired, t: u32, corners: [DVec3; 3], side: usize) -> Option<u32> {
    let own = repaired.mesh.corners(t as usize);
    let nearest =
        |p: DVec3| (0..3).min_by(|a, b| own[*a].distance_squared(p).total_cmp(&own[*b].distance_squared(p)));
    let (from, to) = (nearest(corners[side])?, nearest(corners[(side + 1) % 3])?);
    let first = if (from + 1) % 3 == to { from } else { to };
    (from != to).then_some(3 * t + first as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::mesh::repair::repair;
    use crate::mesh::samples::sample;

    #[test]
    fn a_cancelled_search_gives_no_part_of_the_result() {
        let mesh = sample("torus").unwrap();
        let repaired = repair(&mesh).unwrap();
        let progress = ProgressToken::default();
        progress.cancel();
        let stopped = find_correspondence(&mesh, &repaired, &mesh, CorrespondenceRequest::ALL, &progress);
        assert_eq!(stopped, Err(Error::Cancelled));
    }
}
