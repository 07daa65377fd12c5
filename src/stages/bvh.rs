//! A tree of boxes over the triangles, built on the device.

use super::records::TriangleRecords;
use crate::Result;
use crate::gpu::kernels::project::{join, leaves};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::UVec4;

/// The tree of `glsl/common/hierarchy.glsl`: its shape follows from the number of triangles in spatial order.
pub struct Bvh {
    leaves: Pipeline<leaves::Shader>,
    join: Pipeline<join::Shader>,
    /// The nodes in depth-first order; see the shader for their bits.
    pub nodes: Buffer<UVec4>,
    /// How many nodes are below one, and triangles in a leaf.
    pub(super) shape: Shape,
    /// Nodes of each level, from the leaves to the root.
    levels: Vec<usize>,
}

/// Branching of the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Nodes below an inner node, at least 2.
    pub width: u32,
    /// Triangles in a leaf, at least 1.
    pub leaf: u32,
}

impl Default for Shape {
    /// The fastest of those measured.
    fn default() -> Self {
        let leaves::Constants { width, leaf, .. } = leaves::Constants::default();
        Self { width, leaf }
    }
}

impl Bvh {
    /// For `triangles` triangles.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, triangles: usize, shape: Shape, workgroup: Option<u32>) -> Result<Self> {
        let workgroup = workgroup.unwrap_or(leaves::Constants::default().workgroup);
        let Shape { width, leaf } = shape;
        let levels = levels(triangles, shape);
        Ok(Self {
            leaves: Pipeline::new(device, leaves::Constants { workgroup, width, leaf })?,
            join: Pipeline::new(device, join::Constants { workgroup, width, leaf })?,
            nodes: Buffer::new(device, "surface.bvh", levels.iter().sum())?,
            shape,
            levels,
        })
    }

    /// Records the building, needed once for a surface. `triangles` must be as many as the tree was made for.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, triangles: &TriangleRecords) -> Result<()> {
        let levels = self.levels.len() as u32;
        let push = leaves::Push { triangle_count: triangles.len() as u32, levels };
        let bindings = leaves::Bindings { records: &triangles.records, nodes: &self.nodes };
        recorder.dispatch(&self.leaves, Threads(self.levels[0]), &push, &bindings)?;
        for (level, pair) in (1..).zip(self.levels.windows(2)) {
            let node_count = self.nodes.len() as u32;
            let push = join::Push { level, levels, below: pair[0] as u32, node_count };
            let bindings = join::Bindings { nodes: &self.nodes };
            recorder.dispatch(&self.join, Threads(pair[1]), &push, &bindings)?;
        }
        Ok(())
    }
}

/// Nodes of each level, from the leaves to the root, which may be a leaf.
fn levels(triangles: usize, shape: Shape) -> Vec<usize> {
    let mut levels = vec![triangles.div_ceil(shape.leaf as usize)];
    while let Some(&last) = levels.last().filter(|n| **n > 1) {
        levels.push(last.div_ceil(shape.width as usize));
    }
    levels
}
