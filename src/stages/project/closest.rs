//! Closest points on the whole surface, by a search in the tree of boxes.

use super::bvh::Bvh;
use super::walk::Walk;
use crate::Result;
use crate::gpu::kernels::project::closest;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::records::TriangleRecords;
use glam::Vec4;

/// Improves the results of a [`Walk`] where another triangle that faces the same way is nearer.
pub struct ClosestPoints {
    pipeline: Pipeline<closest::Shader>,
}

/// Projections that a search improves.
#[derive(Clone, Copy)]
pub struct Projections<'a> {
    /// Same as [`Walk::projected`].
    pub projected: &'a Buffer<Vec4>,
    /// The sides that triangles must face to be taken, and then normals as [`Walk::normals`].
    pub normals: &'a Buffer<Vec4>,
    /// Projections that are no farther than this from their targets are kept as they are.
    pub least: f32,
}

impl<'a> From<&'a Walk> for Projections<'a> {
    fn from(walk: &'a Walk) -> Self {
        Self { projected: &walk.projected, normals: &walk.normals, least: 0.0 }
    }
}

impl ClosestPoints {
    /// `workgroup` overrides the kernel's own.
    ///
    /// # Errors
    /// [`crate::Error::Device`].
    pub fn new(device: &Device, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = closest::Constants::default();
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        Ok(Self { pipeline: Pipeline::new(device, constants)? })
    }

    /// Records the search. `found` and `site_triangle` hold the results of a walk of the same `targets`, and
    /// after it those of the search.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        triangles: &TriangleRecords,
        bvh: &Bvh,
        found: Projections,
        site_triangle: &Buffer<u32>,
    ) -> Result<()> {
        let push =
            closest::Push { site_count: targets.len() as u32, levels: bvh.level_count(), least: found.least };
        let bindings = closest::Bindings {
            targets,
            corners: &triangles.corners,
            wedges: &triangles.wedges,
            triangle_normals: &triangles.normals,
            nodes: &bvh.nodes,
            projected: found.projected,
            normals: found.normals,
            site_triangle,
        };
        recorder.dispatch(&self.pipeline, Threads(targets.len()), &push, &bindings)
    }
}
