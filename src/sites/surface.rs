//! The surface that sites live on, on host and device.

use super::morton::{morton_code, morton_order, sort_order};
use crate::gpu::{Buffer, Device};
use crate::mesh::csr::triangles_around;
use crate::mesh::triangle::doubled_normal;
use crate::mesh::unit_frame::UnitFrame;
use crate::{Result, TriMesh};
use glam::{DVec3, UVec4, Vec4};
use rayon::prelude::*;

/// A clean triangle mesh in the unit-diagonal frame.
pub struct Surface {
    /// Vertices in Morton order.
    pub vertices: Vec<DVec3>,
    /// Triangles in spatial order, much larger ones last.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle its index in the mesh that the surface was made from.
    pub origin: Vec<u32>,
    /// Unit normals of the triangles.
    pub normals: Vec<DVec3>,
    /// Areas of the triangles.
    pub areas: Vec<f64>,
}

/// A [`Surface`] as the kernels of other pipelines than the default one see it, which has
/// [`crate::stages::records`].
pub struct SurfaceBuffers {
    /// Positions, w = 0.
    pub vertices: Buffer<Vec4>,
    /// Vertex indices, w = 0.
    pub triangles: Buffer<UVec4>,
    /// Unit normals, w = 0.
    pub normals: Buffer<Vec4>,
    /// First entry of each vertex in `star`, and the end of the last.
    pub star_start: Buffer<u32>,
    /// Triangles around the vertices.
    pub star: Buffer<u32>,
}

impl Surface {
    /// A copy of vertices and triangles as a mesh.
    pub fn mesh(&self) -> TriMesh {
        TriMesh { vertices: self.vertices.clone(), triangles: self.triangles.clone() }
    }

    /// Moves a repaired mesh into `frame`.
    pub fn new(mesh: &TriMesh, frame: &UnitFrame) -> Self {
        let unit: Vec<DVec3> = mesh.vertices.par_iter().map(|p| frame.to_unit(*p)).collect();
        let order = morton_order(&unit);
        let mut new_index = vec![0; unit.len()];
        for (new, old) in order.iter().enumerate() {
            new_index[*old as usize] = new as u32;
        }
        let vertices: Vec<DVec3> = order.par_iter().map(|i| unit[*i as usize]).collect();
        let origin = sort_order(&spatial_keys(&unit, &mesh.triangles));
        let triangles: Vec<[u32; 3]> =
            origin.par_iter().map(|t| mesh.triangles[*t as usize].map(|v| new_index[v as usize])).collect();
        let (normals, areas) = triangles
            .par_iter()
            .map(|t| doubled_normal(t.map(|v| vertices[v as usize])))
            .map(|doubled| (doubled.normalize_or_zero(), 0.5 * doubled.length()))
            .unzip();
        Self { vertices, triangles, origin, normals, areas }
    }

    /// Total area in the unit-diagonal frame.
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }
}

impl SurfaceBuffers {
    /// Uploads a surface.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if it does not fit.
    pub fn new(device: &Device, surface: &Surface) -> Result<Self> {
        let Surface { vertices, triangles, normals, .. } = surface;
        let vec4 = |list: &[DVec3]| list.iter().map(|p| p.as_vec3().extend(0.0)).collect::<Vec<_>>();
        let star = triangles_around(vertices.len(), triangles);
        let indices: Vec<_> = triangles.iter().map(|t| UVec4::new(t[0], t[1], t[2], 0)).collect();
        Ok(Self {
            vertices: Buffer::from_slice(device, "surface.vertices", &vec4(vertices))?,
            triangles: Buffer::from_slice(device, "surface.triangles", &indices)?,
            normals: Buffer::from_slice(device, "surface.normals", &vec4(normals))?,
            star_start: Buffer::from_slice(device, "surface.star_start", &star.start)?,
            star: Buffer::from_slice(device, "surface.star", &star.entries)?,
        })
    }
}

/// Bits of a Morton code.
const CODE_BITS: u32 = 60;

/// One key a triangle; ascending keys are spatial order. Triangles much larger than most come last, by class
/// of size: among small ones they would inflate every box that holds one.
fn spatial_keys(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u64> {
    let corners = |t: &[u32; 3]| t.map(|v| vertices[v as usize]);
    let extent = |t: &[u32; 3]| {
        let [a, b, c] = corners(t);
        (a.max(b).max(c) - a.min(b).min(c)).length()
    };
    let mut extents: Vec<f64> = triangles.par_iter().map(extent).collect();
    let middle = extents.len() / 2;
    let usual =
        if extents.is_empty() { 1.0 } else { *extents.select_nth_unstable_by(middle, f64::total_cmp).1 };
    triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            // Up to 8 times the usual extent is class 0, and each further factor of 4 one more.
            let class = ((extent(t) / (2.0 * usual)).log2() / 2.0).clamp(0.0, 15.0) as u64;
            class << CODE_BITS | morton_code((a + b + c) / 3.0)
        })
        .collect()
}
