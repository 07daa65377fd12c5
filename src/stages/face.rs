//! Restricted tangent faces by clipping 3-D cells.

use crate::Result;
use crate::gpu::kernels::face::cell;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::neighbours::TileBounds;
use glam::{Vec2, Vec4};
use serde::Serialize;

/// The cell kernel and the faces that it writes.
pub struct CellFaces {
    pipeline: Pipeline<cell::Shader>,
    push: cell::Push,
    /// Corners of each face; 0 where a flag says why there is none.
    pub corner_count: Buffer<u32>,
    /// `corners[slot * sites + site]` in the tangent frame, counter-clockwise.
    pub corners: Buffer<Vec2>,
    /// `fan[slot * sites + site]`: the site behind the edge that ends in the corner of the same slot.
    pub fan: Buffer<u32>,
}

/// How the cell kernel is set up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellOptions {
    /// Neighbours in the lists that it will be given.
    pub k: u32,
    /// Mean distance of sites in the unit-diagonal frame.
    pub spacing: f64,
    /// Distance of the two virtual points in spacings: the paper's d. The paper takes 20 of an unnamed unit and says
    /// that the value does not matter; 2 spacings make the slab of its illustration at every density, thin enough
    /// to leave out the points where bisectors meet in bundles.
    pub virtual_offset: f32,
    /// Dual triangles of a cell (the paper's #T).
    pub max_triangles: u32,
    /// Planes of a cell (the paper's #P), at most 255.
    pub max_planes: u32,
    /// Invocations of a workgroup; halved until its cells fit the device's shared memory.
    pub workgroup: u32,
}

impl CellOptions {
    /// The paper's capacities for lists of `k` neighbours.
    pub fn paper(k: u32, spacing: f64) -> Self {
        let c = cell::Constants::default();
        Self {
            k,
            spacing,
            virtual_offset: 2.0,
            max_triangles: c.max_triangles,
            max_planes: c.max_planes,
            workgroup: c.workgroup,
        }
    }

    /// Shared memory of one cell in bytes.
    fn cell_bytes(&self) -> u32 {
        16 * self.max_planes + 4 * self.max_triangles + 4 * self.max_planes.div_ceil(4)
    }
}

/// Half the edge of the cube that a cell starts from, in spacings. The paper starts from the surface's bounding box.
/// A sound face is the same in either, but at the tip of a spike all neighbours lie below the tangent plane, and the
/// face would be as large as the model and carry its site away.
pub const BOX_HALF: f64 = 4.0;

impl CellFaces {
    /// For `sites` sites.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, options: &CellOptions) -> Result<Self> {
        let mut workgroup = options.workgroup;
        while workgroup > 1 && workgroup * options.cell_bytes() > device.info().limits.shared_memory_bytes {
            workgroup /= 2;
        }
        let constants = cell::Constants {
            workgroup,
            max_triangles: options.max_triangles,
            max_planes: options.max_planes,
            k: options.k,
            ..Default::default()
        };
        let slots = sites * constants.max_corners as usize;
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            push: cell::Push {
                site_count: sites as u32,
                spacing: options.spacing as f32,
                virtual_offset: options.virtual_offset,
                box_half: BOX_HALF as f32,
            },
            corner_count: Buffer::new(device, "rtf.face.corner_count", sites)?,
            corners: Buffer::new(device, "rtf.face.corners", slots)?,
            fan: Buffer::new(device, "rtf.face.fan", slots)?,
        })
    }

    /// Records the clipping; `bounds` are the boxes of `sites`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        sites: &Buffer<Vec4>,
        normals: &Buffer<Vec4>,
        neighbours: &Buffer<u32>,
        bounds: &TileBounds,
        flags: &Buffer<u32>,
    ) -> Result<()> {
        let bindings = cell::Bindings {
            sites,
            normals,
            neighbours,
            bounds: &bounds.bounds,
            corner_count: &self.corner_count,
            corners: &self.corners,
            fan: &self.fan,
            flags,
        };
        recorder.dispatch(&self.pipeline, Threads(sites.len()), &self.push, &bindings)
    }
}

/// How many sites carry each flag of `glsl/common/flags.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct FlagCounts {
    /// More dual triangles than #T: no face.
    pub triangle_overflow: usize,
    /// More planes than #P: no face.
    pub plane_overflow: usize,
    /// More corners than a face can store: no face.
    pub corner_overflow: usize,
    /// A cut that did not close: no face.
    pub badly_closed: usize,
    /// The k nearest did not reach the radius of security: completed with all sites.
    pub security_missed: usize,
    /// Another site on the same spot: parted by index.
    pub coincident: usize,
    /// The face reaches the cube that its cell started from, as at the tip of a spike.
    pub unbounded: usize,
    /// No plane fits the neighbours, or it stands more than 37 degrees off the surface: the surface's normal was taken.
    pub surface_normal_taken: usize,
    /// Completing a face overflowed: the one by its k neighbours stands, and others might cut it.
    pub incomplete: usize,
}

impl FlagCounts {
    /// Counts the bits.
    pub fn of(flags: &[u32]) -> Self {
        let count = |bit: u32| flags.iter().filter(|f| *f & bit != 0).count();
        Self {
            triangle_overflow: count(1),
            plane_overflow: count(2),
            corner_overflow: count(4),
            badly_closed: count(8),
            security_missed: count(16),
            coincident: count(32),
            unbounded: count(64),
            surface_normal_taken: count(128),
            incomplete: count(256),
        }
    }
}
