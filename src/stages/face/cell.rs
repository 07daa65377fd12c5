//! Restricted tangent faces by clipping 3-D cells, and restricted power faces.

use crate::Result;
use crate::gpu::kernels::face::{cell, power};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::neighbours::knn::TileBounds;
use glam::{Vec2, Vec4};
use serde::Serialize;

/// The kernel of the cells, or that of the power faces, and the faces that it writes.
pub struct CellFaces {
    kernel: Kernel,
    /// Corners of each face; 0 where a flag says why there is none.
    pub corner_count: Buffer<u32>,
    /// `corners[slot * sites + site]` in the tangent frame, counter-clockwise.
    pub corners: Buffer<Vec2>,
    /// `fan[slot * sites + site]`: the site behind the edge that ends in the corner of the same slot.
    pub fan: Buffer<u32>,
}

enum Kernel {
    Cell(Pipeline<cell::Shader>, cell::Push),
    Power(Pipeline<power::Shader>, power::Push),
}

/// How the power kernel is set up.
///
/// The restricted power face of a site s with the normal n, as the paper tells it in Sect. 3.3 after Xu et
/// al. (2019): a shadow site s + d n of weight d², sites have none, and the face is what the power cells of
/// the site and of its shadow have in common. The two have equal power distance on the tangent plane of s; so
/// the face is that part of the plane where no other site is nearer than s, and no other shadow nearer by
/// power distance. There is one shadow a site, outside, as in the paper's text; it cuts where the surface is
/// hollow. A site may lie in the shadow of another where the surface is hollow with a radius below the
/// offset, and has no face then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerOptions {
    /// Neighbours in the lists that it will be given.
    pub k: u32,
    /// Mean distance of sites in the unit-diagonal frame.
    pub spacing: f64,
    /// Distance of a shadow site from its site in spacings: d. 0 gives the restricted tangent face.
    pub offset: f64,
    /// Invocations of a workgroup; halved until its polygons fit the device's shared memory.
    pub workgroup: u32,
}

impl PowerOptions {
    /// With the kernel's own workgroup.
    pub fn new(k: u32, spacing: f64, offset: f64) -> Self {
        Self { k, spacing, offset, workgroup: power::Constants::default().workgroup }
    }
}

/// How the cell kernel is set up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellOptions {
    /// Neighbours in the lists that it will be given.
    pub k: u32,
    /// Mean distance of sites in the unit-diagonal frame.
    pub spacing: f64,
    /// Distance of the two virtual points in spacings: the paper's d. The paper takes 20 of an unnamed unit
    /// and says that the value does not matter; 2 spacings make the slab of its illustration at every
    /// density, thin enough to leave out the points where bisectors meet in bundles.
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

/// Half the edge of the cube that a cell starts from, in spacings. The paper starts from the surface's
/// bounding box. A sound face is the same in either, but at the tip of a spike all neighbours lie below the
/// tangent plane, and the face would be as large as the model and carry its site away.
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
        let push = cell::Push {
            site_count: sites as u32,
            spacing: options.spacing as f32,
            virtual_offset: options.virtual_offset,
            box_half: BOX_HALF as f32,
        };
        let kernel = Kernel::Cell(Pipeline::new(device, constants)?, push);
        Self::with(device, sites, constants.max_corners, kernel)
    }

    /// Restricted power faces for `sites` sites.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn power(device: &Device, sites: usize, options: &PowerOptions) -> Result<Self> {
        let mut constants =
            power::Constants { workgroup: options.workgroup, k: options.k, ..Default::default() };
        // Two polygons of corners and labels.
        let bytes = 2 * 12 * constants.max_corners;
        while constants.workgroup > 1
            && constants.workgroup * bytes > device.info().limits.shared_memory_bytes
        {
            constants.workgroup /= 2;
        }
        let push = power::Push {
            site_count: sites as u32,
            spacing: options.spacing as f32,
            offset: options.offset as f32,
            box_half: BOX_HALF as f32,
        };
        let kernel = Kernel::Power(Pipeline::new(device, constants)?, push);
        Self::with(device, sites, constants.max_corners, kernel)
    }

    fn with(device: &Device, sites: usize, max_corners: u32, kernel: Kernel) -> Result<Self> {
        let slots = sites * max_corners as usize;
        Ok(Self {
            kernel,
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
        let Self { kernel, corner_count, corners, fan } = self;
        let (threads, bounds) = (Threads(sites.len()), &bounds.bounds);
        match kernel {
            Kernel::Cell(pipeline, push) => {
                let bindings =
                    cell::Bindings { sites, normals, neighbours, bounds, corner_count, corners, fan, flags };
                recorder.dispatch(pipeline, threads, push, &bindings)
            }
            Kernel::Power(pipeline, push) => {
                let bindings =
                    power::Bindings { sites, normals, neighbours, bounds, corner_count, corners, fan, flags };
                recorder.dispatch(pipeline, threads, push, &bindings)
            }
        }
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
    /// No plane fits the neighbours, or it stands more than 37 degrees off the surface: the surface's normal
    /// was taken.
    pub surface_normal_taken: usize,
    /// Completing a face overflowed: the one by its k neighbours stands, and others might cut it.
    pub incomplete: usize,
    /// The shadow sites of others leave nothing of the face: the site stays where it is.
    pub hidden: usize,
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
            hidden: count(512),
        }
    }
}
