//! Projection onto the planes that best fit the input's vertices, as if the input were a point cloud.

use crate::Result;
use crate::gpu::kernels::project::best_fit;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::sites::surface::{Surface, SurfaceBuffers};
use glam::{DVec3, Vec4};

/// The surface of a point cloud near a site: the plane of least squares through the nearest of its points.
///
/// The paper describes Chen et al. (2018) like this: each Voronoi cell is restricted to a surface,
/// approximated by best-fit planes that depend on the number of input points, and sites are pulled back to
/// those planes. It is read here as one plane for each site, through the mean of its `k` nearest points; a
/// site is pulled to the plane at its target, and its next cell is cut by the plane through the site with
/// that plane's normal, so that a site lies in its face. The points are the surface's vertices, with the
/// normals of the mesh, as an oriented point cloud has its own; nothing else of the triangles is used. Of the
/// `k` nearest, those that face away from the nearest one do not count: a plane through points of two sheets
/// lies between them, and so would the site. A plane has no end; a site stays as close to the nearest point
/// as every point of the surface is.
pub struct BestFit {
    pipeline: Pipeline<best_fit::Shader>,
    vertex_normals: Buffer<Vec4>,
    /// Points on the planes; w = distance of the projection.
    pub projected: Buffer<Vec4>,
    /// Unit normals of the planes on the points' side, w = 0.
    pub normals: Buffer<Vec4>,
    /// Flags ([`crate::stages::flags`]); this kernel overwrites those of the last iteration.
    pub flags: Buffer<u32>,
    k: u32,
    reach: f64,
}

impl BestFit {
    /// For `sites` sites and lists of `k` vertices of the surface, whose edges are at most `longest_edge`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        surface: &Surface,
        sites: usize,
        (k, longest_edge): (u32, f64),
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let default = best_fit::Constants::default();
        let constants = best_fit::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
        let outward: Vec<Vec4> = vertex_normals(surface).iter().map(|n| n.as_vec3().extend(0.0)).collect();
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            vertex_normals: Buffer::from_slice(device, "rvc.vertex_normals", &outward)?,
            projected: Buffer::new(device, "rvc.projected", sites)?,
            normals: Buffer::new(device, "rvc.normals", sites)?,
            flags: Buffer::new(device, "rvc.flags", sites)?,
            k,
            // A triangle lies in discs of this radius around its corners.
            reach: longest_edge / 3_f64.sqrt(),
        })
    }

    /// Records the projection of `targets` onto the planes of their nearest vertices, which `neighbours`
    /// lists.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        neighbours: &Buffer<u32>,
        SurfaceBuffers { vertices, .. }: &SurfaceBuffers,
    ) -> Result<()> {
        let push = best_fit::Push { site_count: targets.len() as u32, k: self.k, reach: self.reach as f32 };
        let Self { vertex_normals, projected, normals, flags, .. } = self;
        let bindings =
            best_fit::Bindings { targets, neighbours, vertices, vertex_normals, projected, normals, flags };
        recorder.dispatch(&self.pipeline, Threads(targets.len()), &push, &bindings)
    }
}

/// Unit normals at the vertices: the sums of their triangles' by area or, where those cancel, that of the
/// last triangle.
pub fn vertex_normals(surface: &Surface) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; surface.vertices.len()];
    let mut last = vec![DVec3::Z; surface.vertices.len()];
    for (t, triangle) in surface.triangles.iter().enumerate() {
        for v in triangle {
            sums[*v as usize] += surface.areas[t] * surface.normals[t];
            if surface.normals[t] != DVec3::ZERO {
                last[*v as usize] = surface.normals[t];
            }
        }
    }
    sums.iter().zip(last).map(|(sum, last)| sum.try_normalize().unwrap_or(last)).collect()
}
