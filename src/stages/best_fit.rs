//! Back onto the planes that best fit the input's points, as if the input were a point cloud.

use super::cloud::Cloud;
use crate::Result;
use crate::gpu::kernels::project::best_fit;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::{DVec3, Vec4};

/// The surface of a point cloud near a site: the plane of least squares through the nearest of its points.
///
/// So the paper tells it of Chen et al. (2018): each Voronoi cell is restricted to an underlying surface, approximated by
/// best-fit planes that depend on the number of input points, and sites are pulled back to those planes. The reading taken: one
/// plane a site, through the mean of its `k` nearest points; a site is pulled to the plane at its target, and its next
/// cell is cut by the plane through the site with that plane's normal, so that a site lies in its face. The points have the
/// normals of the mesh, as an oriented point cloud has its own; nothing else of the triangles is used.
pub struct BestFit {
    pipeline: Pipeline<best_fit::Shader>,
    /// The cloud; w = 0.
    pub points: Buffer<Vec4>,
    point_normals: Buffer<Vec4>,
    /// Points on the planes; w = distance of the projection.
    pub projected: Buffer<Vec4>,
    /// Unit normals of the planes on the points' side, w = 0.
    pub normals: Buffer<Vec4>,
    /// The flags of `stages::face`, begun anew.
    pub flags: Buffer<u32>,
    k: u32,
}

impl BestFit {
    /// For `sites` sites and lists of `k` points of the cloud.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, cloud: &Cloud, sites: usize, k: u32, workgroup: Option<u32>) -> Result<Self> {
        let default = best_fit::Constants::default();
        let constants = best_fit::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
        let upload = |name: &str, vectors: &[DVec3]| {
            let vectors: Vec<Vec4> = vectors.iter().map(|v| v.as_vec3().extend(0.0)).collect();
            Buffer::from_slice(device, name, &vectors)
        };
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            points: upload("rvc.points", &cloud.points)?,
            point_normals: upload("rvc.point_normals", &cloud.normals)?,
            projected: Buffer::new(device, "rvc.projected", sites)?,
            normals: Buffer::new(device, "rvc.normals", sites)?,
            flags: Buffer::new(device, "rvc.flags", sites)?,
            k,
        })
    }

    /// Records the pull of `targets` to the planes of their nearest points, which `neighbours` lists.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        neighbours: &Buffer<u32>,
    ) -> Result<()> {
        let push = best_fit::Push { site_count: targets.len() as u32, k: self.k };
        let Self { points: vertices, point_normals: vertex_normals, projected, normals, flags, .. } = self;
        let bindings =
            best_fit::Bindings { targets, neighbours, vertices, vertex_normals, projected, normals, flags };
        recorder.dispatch(&self.pipeline, Threads(targets.len()), &push, &bindings)
    }
}
