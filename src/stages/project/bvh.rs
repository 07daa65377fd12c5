//! A tree of boxes over the triangles, built on the device.

use crate::Result;
use crate::gpu::kernels::project::{join, leaves};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::records::TriangleRecords;
use glam::UVec4;

/// The tree of `glsl/project/hierarchy.glsl`.
pub struct Bvh {
    leaves: Pipeline<leaves::Shader>,
    join: Pipeline<join::Shader>,
    /// The nodes in depth-first order, two values each; see the shader for their bits.
    pub nodes: Buffer<UVec4>,
    /// Nodes of each level, from the lowest to the root.
    levels: Vec<usize>,
}

/// Boxes in a node: `WIDTH` of `glsl/project/hierarchy.glsl`.
const WIDTH: usize = 4;

impl Bvh {
    /// For `triangles` triangles, at least one.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, triangles: usize, workgroup: Option<u32>) -> Result<Self> {
        let workgroup = workgroup.unwrap_or(leaves::Constants::default().workgroup);
        let levels = levels(triangles);
        Ok(Self {
            leaves: Pipeline::new(device, leaves::Constants { workgroup })?,
            join: Pipeline::new(device, join::Constants { workgroup })?,
            nodes: Buffer::new(device, "surface.bvh", 2 * levels.iter().sum::<usize>())?,
            levels,
        })
    }

    /// Records the building, needed once for a surface. `triangles` must be as many as the tree was made for.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, triangles: &TriangleRecords) -> Result<()> {
        self.record_over(recorder, &triangles.corners, &triangles.wedges)
    }

    /// Like [`Bvh::record`], for triangles by their corners, each a place in `wedges`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_over(
        &self,
        recorder: &mut Recorder,
        corners: &Buffer<u32>,
        wedges: &Buffer<UVec4>,
    ) -> Result<()> {
        let levels = self.level_count();
        let push = leaves::Push { triangle_count: corners.len() as u32 / 3, levels };
        let bindings = leaves::Bindings { corners, wedges, nodes: &self.nodes };
        recorder.dispatch(&self.leaves, Threads(self.levels[0]), &push, &bindings)?;
        for (level, pair) in (1..).zip(self.levels.windows(2)) {
            let push = join::Push { level, levels, below: pair[0] as u32 };
            let bindings = join::Bindings { nodes: &self.nodes };
            recorder.dispatch(&self.join, Threads(pair[1]), &push, &bindings)?;
        }
        Ok(())
    }

    /// Levels of the tree, at least one.
    pub(crate) fn level_count(&self) -> u32 {
        self.levels.len() as u32
    }
}

/// Nodes of each level, from the lowest to the root.
fn levels(triangles: usize) -> Vec<usize> {
    let mut levels = vec![triangles.div_ceil(WIDTH)];
    while let Some(&last) = levels.last().filter(|n| **n > 1) {
        levels.push(last.div_ceil(WIDTH));
    }
    levels
}
