//! The triangles of the surface as the searches for closest points read them: corners, adjacent triangles,
//! normals.

use super::octahedral::pack;
use crate::Result;
use crate::gpu::{Buffer, Device};
use crate::mesh::NONE;
use crate::mesh::half_edges::{next, twins};
use crate::mesh::topology::Partition;
use crate::mesh::triangle::angle_at_first;
use crate::sites::surface::Surface;
use crate::sites::surface_curves::SurfaceCurves;
use glam::{DVec3, UVec4};
use rayon::prelude::*;

/// Buffers over the triangles of a [`Surface`], in its order. None has more than 12 bytes a triangle, so that
/// the least that Vulkan guarantees for one buffer, 128 MiB, holds 11 million.
pub struct TriangleRecords {
    /// `corners[3 * triangle + k]`: index into `wedges`.
    pub corners: Buffer<u32>,
    /// `twins[3 * triangle + k]`: the half-edge (`3 * triangle + side`) across the side from corner k to the
    /// next, [`NONE`] at boundaries, where more than two triangles meet, where two meet that run the same way
    /// along the side, and on curves.
    pub twins: Buffer<u32>,
    /// The corners of triangles that meet at a vertex, once for each patch there: the position in the bits of
    /// three floats, and the unit normal of the surface in octahedral form, or [`NO_NORMAL`].
    pub wedges: Buffer<UVec4>,
    /// Unit normals of the triangles in octahedral form.
    pub normals: Buffer<u32>,
}

impl TriangleRecords {
    /// Prepares and uploads the records of `surface`. No walk crosses its `curves`, and normals are those of
    /// the patch.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if they do not fit.
    pub fn new(device: &Device, surface: &Surface, curves: Option<&SurfaceCurves>) -> Result<Self> {
        Self::with_twins(device, surface, curves, twins(&surface.triangles))
    }

    /// Like [`TriangleRecords::new`], with the [`twins`] of the surface.
    pub(crate) fn with_twins(
        device: &Device,
        surface: &Surface,
        curves: Option<&SurfaceCurves>,
        mut twins: Vec<u32>,
    ) -> Result<Self> {
        if let Some(curves) = curves {
            let on_curve = twins.par_iter_mut().zip(&curves.on_curve).filter(|(_, on_curve)| **on_curve);
            on_curve.for_each(|(twin, _)| *twin = NONE);
        }
        let wedges = Wedges::new(surface, curves.is_some().then_some(&twins));
        let normals: Vec<u32> = surface.normals.par_iter().map(|n| pack(*n)).collect();
        Ok(Self {
            corners: Buffer::from_slice(device, "surface.corners", &wedges.of_corner)?,
            twins: Buffer::from_slice(device, "surface.twins", &twins)?,
            wedges: Buffer::from_slice(device, "surface.wedges", &wedges.packed(surface))?,
            normals: Buffer::from_slice(device, "surface.triangle_normals", &normals)?,
        })
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// Whether there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }
}

/// In place of a normal where the triangles' cancel: [`pack`] gives it to no vector.
const NO_NORMAL: u32 = 0x8000_8000;

/// The corners of triangles that share a position and a normal.
struct Wedges {
    /// For each corner (`3 * triangle + k`) its wedge.
    of_corner: Vec<u32>,
    /// For each wedge its vertex.
    vertices: Vec<u32>,
}

impl Wedges {
    /// One for each vertex in use; with `twins`, one for each group of corners that they connect.
    fn new(surface: &Surface, twins: Option<&Vec<u32>>) -> Self {
        let corners = surface.triangles.as_flattened();
        let mut of_corner = twins.map_or_else(|| corners.to_vec(), |twins| fans(twins));
        // Numbered as they first occur, so that near triangles have near wedges.
        let mut number = vec![NONE; if twins.is_some() { corners.len() } else { surface.vertices.len() }];
        let mut vertices = Vec::with_capacity(surface.vertices.len());
        for (wedge, vertex) in of_corner.iter_mut().zip(corners) {
            let number = &mut number[*wedge as usize];
            if *number == NONE {
                *number = vertices.len() as u32;
                vertices.push(*vertex);
            }
            *wedge = *number;
        }
        Self { of_corner, vertices }
    }

    /// Positions and normals: each normal the mean of the triangles' by their angles there.
    fn packed(&self, surface: &Surface) -> Vec<UVec4> {
        let angle = |corner: usize| {
            let at = |k: usize| surface.vertices[surface.triangles[corner / 3][k % 3] as usize];
            let k = corner % 3;
            angle_at_first([at(k), at(k + 1), at(k + 2)]) as f32
        };
        let angles: Vec<f32> = (0..self.of_corner.len()).into_par_iter().map(angle).collect();
        let mut sums = vec![DVec3::ZERO; self.vertices.len()];
        for (corner, (wedge, angle)) in self.of_corner.iter().zip(&angles).enumerate() {
            sums[*wedge as usize] += surface.normals[corner / 3] * f64::from(*angle);
        }
        let packed = |(vertex, sum): (&u32, &DVec3)| {
            let p = surface.vertices[*vertex as usize].as_vec3();
            let normal = sum.try_normalize().map_or(NO_NORMAL, pack);
            UVec4::new(p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), normal)
        };
        self.vertices.par_iter().zip(&sums).map(packed).collect()
    }
}

/// For each corner (`3 * triangle + k`) the first of those around the same vertex that `twins` lead to.
fn fans(twins: &[u32]) -> Vec<u32> {
    let mut partition = Partition::new(twins.len());
    for (corner, twin) in (0..).zip(twins).filter(|(_, twin)| **twin != NONE) {
        // The twin runs against this side, so it ends where this one begins.
        partition.join(corner, next(*twin));
    }
    (0..twins.len() as u32).map(|corner| partition.root(corner)).collect()
}
