//! Normals of the tangent planes at the sites.

use crate::Result;
use crate::gpu::kernels::normals::{plane_fit, smooth};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::blocks::Blocked;
use glam::Vec4;

/// Fits a plane to each site and its nearest sites, as PCL does for the paper.
pub struct PlaneFit {
    pipeline: Pipeline<plane_fit::Shader>,
    /// Unit normals on the surface's side, w = 0.
    pub normals: Buffer<Vec4>,
    /// Flags ([`crate::stages::flags`]); this kernel overwrites those of the last iteration.
    pub flags: Buffer<u32>,
    k: u32,
}

impl PlaneFit {
    /// For `sites` sites and `k` points in a fit, the site included.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, k: u32, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = plane_fit::Constants::default();
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            normals: Buffer::new(device, "rtf.normals.normals", sites)?,
            flags: Buffer::new(device, "rtf.normals.flags", sites)?,
            k,
        })
    }

    /// Records the fit. `neighbours` must have at least `k - 1` slots; where the fit is more than 37 degrees
    /// off the surface's normal, that is taken.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        sites: &Buffer<Vec4>,
        neighbours: &Buffer<u32>,
        site_triangle: &Buffer<u32>,
        triangle_normals: &Buffer<Vec4>,
    ) -> Result<()> {
        let push = plane_fit::Push { site_count: sites.len() as u32, k: self.k };
        let bindings = plane_fit::Bindings {
            sites,
            neighbours,
            site_triangle,
            triangle_normals,
            normals: &self.normals,
            flags: &self.flags,
        };
        recorder.dispatch(&self.pipeline, Threads(sites.len()), &push, &bindings)
    }
}

/// Normals of tangent planes: means of the surface's normals over the nearest sites.
pub struct SmoothNormals {
    pipeline: Pipeline<smooth::Shader>,
    /// Packed as in `glsl/common/octahedral.glsl`.
    pub normals: Buffer<u32>,
}

impl SmoothNormals {
    /// For `sites` sites, which have the marks of [`super::pins`] if there are `curves`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, curves: bool, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = smooth::Constants { curves: curves.into(), ..Default::default() };
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            normals: Buffer::new(device, "default.normals", sites)?,
        })
    }

    /// Records the means of `surface_normals` over the first neighbours, of which there must be at least six
    /// slots. Of `sites` only the marks are read.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        surface_normals: &Buffer<u32>,
        neighbours: &Blocked<u32>,
        sites: &Buffer<Vec4>,
    ) -> Result<()> {
        for (block, neighbours) in neighbours.iter() {
            let push = smooth::Push { first: block.first, block_sites: block.sites };
            let bindings = smooth::Bindings { surface_normals, neighbours, normals: &self.normals, sites };
            recorder.dispatch(&self.pipeline, Threads(block.sites as usize), &push, &bindings)?;
        }
        Ok(())
    }
}
