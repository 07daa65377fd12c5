//! Projection onto the triangles around the nearest input vertices (Algorithm 3).

use crate::Result;
use crate::gpu::kernels::project::nearest_vertices;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::sites::surface::SurfaceBuffers;
use glam::Vec4;

/// The projection kernel and its result.
pub struct NearestVertices {
    pipeline: Pipeline<nearest_vertices::Shader>,
    /// Points on the surface; w = distance of the projection.
    pub projected: Buffer<Vec4>,
    k: u32,
}

impl NearestVertices {
    /// For `sites` sites and lists of `k` input vertices.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, k: u32, workgroup: Option<u32>) -> Result<Self> {
        let default = nearest_vertices::Constants::default();
        let constants = nearest_vertices::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            projected: Buffer::new(device, "rtf.project.projected", sites)?,
            k,
        })
    }

    /// Records the projection of `targets`; also writes the triangle under each point.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        neighbours: &Buffer<u32>,
        surface: &SurfaceBuffers,
        site_triangle: &Buffer<u32>,
    ) -> Result<()> {
        let push = nearest_vertices::Push { site_count: targets.len() as u32, k: self.k };
        let bindings = nearest_vertices::Bindings {
            targets,
            neighbours,
            vertices: &surface.vertices,
            triangles: &surface.triangles,
            star_start: &surface.star_start,
            star: &surface.star,
            projected: &self.projected,
            site_triangle,
        };
        recorder.dispatch(&self.pipeline, Threads(targets.len()), &push, &bindings)
    }
}
