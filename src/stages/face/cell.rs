//! Restricted tangent faces by clipping cells in space; and the faces as this kernel and that of
//! [`super::power`] write them.

use crate::Result;
use crate::gpu::kernels::face::{cell, power};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::options::Centroid;
use crate::stages::neighbours::knn::TileBounds;
use glam::{Vec2, Vec4};

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

pub(super) enum Kernel {
    Cell(Pipeline<cell::Shader>, cell::Push),
    Power(Pipeline<power::Shader>, power::Push),
}

/// How the cell kernel is set up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellOptions {
    /// Neighbours in the lists that it will be given.
    pub k: u32,
    /// Spacing of the sites in the unit-diagonal frame.
    pub spacing: f64,
    /// Distance of the two virtual points in spacings: the paper's d. The paper takes 20 of an unnamed unit
    /// and says that the value does not matter; 2 spacings make the slab of its illustration at every
    /// density, thin enough to leave out the points where bisectors meet in bundles.
    pub virtual_offset: f32,
    /// Dual triangles of a cell (the paper's #T).
    pub max_triangles: u32,
    /// Planes of a cell (the paper's #P), at most 255.
    pub max_planes: u32,
    /// Attempts at a cell: one by its list, one by all sites within reach, the others in thinner slabs.
    pub max_attempts: u32,
    /// How weights move the bisectors; without them they are in the middle.
    pub weights: Option<CellWeights>,
    /// Invocations of a workgroup; halved until its cells fit the device's shared memory.
    pub workgroup: u32,
}

/// Weights of sites that have the edge length wanted there, relative to the spacing, as fourth components.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellWeights {
    /// The weight of a site over its squared edge length.
    pub share: f64,
    /// The most that edge lengths change per unit of distance; the product with the square root of `share`
    /// is below 1.
    pub steepness: f64,
}

impl CellWeights {
    /// Weights whose cells balance when the sites' distances are the edge lengths wanted.
    ///
    /// Where edges of length h get longer along the surface, the centroid of a cell without weights is off
    /// its site by k h² ∇ln h, with k = 1/6 for the mean of a hexagon's corners and 5/18 for its area.
    /// Weights k h² move all of its sides by -∇(k h²) / 2, which is just that.
    pub fn balanced(centroid: Centroid, steepness: f64) -> Self {
        let share = match centroid {
            Centroid::Area => 5.0 / 18.0,
            Centroid::Corners | Centroid::WeightedCorners => 1.0 / 6.0,
        };
        Self { share, steepness }
    }
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
            max_attempts: c.max_attempts,
            weights: None,
            workgroup: c.workgroup,
        }
    }

    /// Shared memory of one cell in bytes.
    fn cell_bytes(&self) -> u32 {
        16 * self.max_planes + 4 * self.max_triangles + 4 * self.max_planes.div_ceil(4)
    }
}

/// Half the edge of the cube that a cell starts from, in spacings. The paper starts from the surface's
/// bounding box. A bounded face is the same in either, but at the tip of a spike all neighbours lie below the
/// tangent plane; the face would be as large as the model and carry its site away.
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
            max_attempts: options.max_attempts,
            weighted: options.weights.is_some().into(),
            ..Default::default()
        };
        let push = cell::Push {
            site_count: sites as u32,
            spacing: options.spacing as f32,
            virtual_offset: options.virtual_offset,
            box_half: BOX_HALF as f32,
            weight_share: options.weights.map_or(0.0, |weights| weights.share as f32),
            steepness: options.weights.map_or(0.0, |weights| weights.steepness as f32),
        };
        let kernel = Kernel::Cell(Pipeline::new(device, constants)?, push);
        Self::with(device, sites, constants.max_corners, kernel)
    }

    pub(super) fn with(device: &Device, sites: usize, max_corners: u32, kernel: Kernel) -> Result<Self> {
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
