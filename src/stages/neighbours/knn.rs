//! Brute-force k-nearest neighbours on the device, tile by tile.

use crate::Result;
use crate::gpu::kernels::neighbours::{knn, tile_bounds};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::Vec4;

/// Points in a tile: `TILE` of `glsl/common/tiles.glsl`.
const TILE: usize = 64;

/// Bounding boxes of the tiles of a list of points; needed by every search in it.
pub struct TileBounds {
    pipeline: Pipeline<tile_bounds::Shader>,
    /// Lower and upper corner of each tile, w = 0.
    pub bounds: Buffer<Vec4>,
}

impl TileBounds {
    /// For `points` points.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, name: &str, points: usize) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(device, tile_bounds::Constants::default())?,
            bounds: Buffer::new(device, name, 2 * points.div_ceil(TILE))?,
        })
    }

    /// Records the boxes.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, points: &Buffer<Vec4>) -> Result<()> {
        let push = tile_bounds::Push { point_count: points.len() as u32 };
        let bindings = tile_bounds::Bindings { points, bounds: &self.bounds };
        recorder.dispatch(&self.pipeline, Threads(points.len().div_ceil(TILE)), &push, &bindings)
    }
}

/// Finds the `k` nearest points of every query, nearest first, ties by index.
pub struct Nearest {
    pipeline: Pipeline<knn::Shader>,
    /// `neighbours[slot * queries + query]`; [`crate::mesh::NONE`] where there are fewer than `k` points.
    pub neighbours: Buffer<u32>,
    exclude_self: bool,
}

impl Nearest {
    /// For `queries` queries; with `exclude_self` the queries are the points, and no point is its own
    /// neighbour. `workgroup` overrides the kernel's own.
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

    /// Records the search; `bounds` are the boxes of `points`. Queries in the same spatial order as the
    /// points are fastest. There must be at least one point.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        queries: &Buffer<Vec4>,
        points: &Buffer<Vec4>,
        bounds: &TileBounds,
    ) -> Result<()> {
        let push = knn::Push {
            query_count: queries.len() as u32,
            point_count: points.len() as u32,
            exclude_self: self.exclude_self.into(),
        };
        let bindings =
            knn::Bindings { queries, points, bounds: &bounds.bounds, neighbours: &self.neighbours };
        recorder.dispatch(&self.pipeline, Threads(queries.len()), &push, &bindings)
    }
}
