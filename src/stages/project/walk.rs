//! Projection onto the surface by a walk downhill over adjacent triangles.

use crate::Result;
use crate::gpu::kernels::project::walk;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::blocks::Block;
use crate::stages::records::TriangleRecords;
use glam::Vec4;

/// The walk and its results.
///
/// It ends where no adjacent triangle is nearer. From the triangle under a site that moved by less than
/// the surface bends that is the closest point, and it never leaves the site's sheet;
/// [`super::closest::ClosestPoints`] looks farther.
pub struct Walk {
    pipeline: Pipeline<walk::Shader>,
    /// Most sites of a dispatch.
    block: usize,
    /// Points on the surface; w = distance of the projection.
    pub projected: Buffer<Vec4>,
    /// Unit normals of the surface there, interpolated between its vertices, on the triangle's side; w = 1
    /// where the walk was stopped, otherwise 0.
    pub normals: Buffer<Vec4>,
}

/// Maximum number of triangles that a walk visits: enough to cross half as many, or to circle a few vertices
/// of high valence.
const MAX_STEPS: u32 = 256;

impl Walk {
    /// For `sites` sites.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = walk::Constants::default();
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            block: Block::largest(device, size_of::<Vec4>()),
            projected: Buffer::of_windows(device, "default.walk.projected", sites)?,
            normals: Buffer::of_windows(device, "default.walk.normals", sites)?,
        })
    }

    /// How many walks were stopped before they ended; `normals` are those downloaded.
    pub fn stopped(normals: &[Vec4]) -> usize {
        normals.iter().filter(|normal| normal.w != 0.0).count()
    }

    /// Records the walks of `targets`, as many as the walk was made for or fewer, from the triangles in
    /// `site_triangle`, which become those under the results.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        triangles: &TriangleRecords,
        site_triangle: &Buffer<u32>,
    ) -> Result<()> {
        for block in Block::divide(site_triangle.len(), self.block) {
            let push = walk::Push {
                site_count: block.sites,
                triangle_count: triangles.len() as u32,
                max_steps: MAX_STEPS,
            };
            let bindings = walk::Bindings {
                targets: &block.window(targets)?,
                corners: &triangles.corners,
                twins: &triangles.twins,
                wedges: &triangles.wedges,
                triangle_normals: &triangles.normals,
                projected: &block.window(&self.projected)?,
                normals: &block.window(&self.normals)?,
                site_triangle: &block.window(site_triangle)?,
            };
            recorder.dispatch(&self.pipeline, Threads(block.sites as usize), &push, &bindings)?;
        }
        Ok(())
    }
}
