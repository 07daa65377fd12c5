//! Brute-force k-nearest neighbours on the device.

use crate::Result;
use crate::gpu::kernels::neighbours::knn;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::Vec4;

/// Finds the `k` nearest points of every query, nearest first, ties by index.
pub struct Nearest {
    pipeline: Pipeline<knn::Shader>,
    /// `neighbours[slot * queries + query]`; [`crate::gpu::NONE`] where there are fewer than `k` points.
    pub neighbours: Buffer<u32>,
    exclude_self: bool,
}

impl Nearest {
    /// For `queries` queries; with `exclude_self` the queries are the points, and no point is its own neighbour.
    /// `workgroup` overrides the kernel's own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        name: &str,
        queries: usize,
        k: u32,
        exclude_self: bool,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let default = knn::Constants::default();
        let workgroup = workgroup.unwrap_or(default.workgroup);
        Ok(Self {
            pipeline: Pipeline::new(device, knn::Constants { workgroup, k })?,
            neighbours: Buffer::new(device, name, queries * k as usize)?,
            exclude_self,
        })
    }

    /// Records the search.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, queries: &Buffer<Vec4>, points: &Buffer<Vec4>) -> Result<()> {
        let push = knn::Push {
            query_count: queries.len() as u32,
            point_count: points.len() as u32,
            exclude_self: self.exclude_self.into(),
        };
        let bindings = knn::Bindings { queries, points, neighbours: &self.neighbours };
        recorder.dispatch(&self.pipeline, Threads(queries.len()), &push, &bindings)
    }
}
