//! Restricted power faces by clipping polygons in tangent planes.

use super::cell::{BOX_HALF, CellFaces, Kernel};
use crate::Result;
use crate::gpu::kernels::face::power;
use crate::gpu::{Device, Pipeline};

/// How the power kernel is set up.
///
/// The restricted power face of a site s with the normal n, as the paper describes it in Sect. 3.3 after Xu
/// et al. (2019): a shadow site s + d n of weight d², sites have none, and the face is what the power cells
/// of the site and of its shadow have in common. The two have equal power distance on the tangent plane of s;
/// so the face is that part of the plane where no other site is nearer than s, and no other shadow nearer by
/// power distance. Each site has one shadow, outside, as in the paper's text; it clips where the surface is
/// concave. Where the radius of curvature there is below the offset, a site may lie in the shadow of another,
/// and then has no face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerOptions {
    /// Neighbours in the lists that it will be given.
    pub k: u32,
    /// Spacing of the sites in the unit-diagonal frame.
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

impl CellFaces {
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
}
