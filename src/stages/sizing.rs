//! The size field in an iteration: the edge length wanted at each site, and the shift of its target towards
//! shorter edges.

use super::face::planar::PlanarInputs;
use super::site_layout::SiteLayout;
use crate::Result;
use crate::gpu::kernels::sizing::{attach, drift, lengths};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::mesh::sizing::SizeField;
use glam::Vec4;

/// A [`SizeField`] on the device.
pub struct DeviceSizes {
    /// Length = `xyz · p + w` in each triangle of the surface, relative to the spacing.
    slopes: Buffer<Vec4>,
    /// The smallest and the largest.
    pub range: [f64; 2],
}

impl DeviceSizes {
    /// Uploads a field; `None` if it is uniform.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if it does not fit.
    pub fn new(device: &Device, field: &SizeField) -> Result<Option<Self>> {
        if field.is_uniform() {
            return Ok(None);
        }
        let slopes: Vec<Vec4> =
            field.slopes().iter().map(|slope| Vec4::from_array(slope.map(|x| x as f32))).collect();
        let slopes = Buffer::from_slice(device, "surface.sizes", &slopes)?;
        Ok(Some(Self { slopes, range: field.range() }))
    }
}

/// Lengths as the fourth components of sites that all exist from the start.
pub struct AttachedLengths {
    attach: Pipeline<attach::Shader>,
    sizes: DeviceSizes,
}

impl AttachedLengths {
    /// With these lengths.
    ///
    /// # Errors
    /// [`crate::Error::Device`].
    pub fn new(device: &Device, sizes: DeviceSizes, workgroup: Option<u32>) -> Result<Self> {
        let default = attach::Constants::default();
        let constants = attach::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
        Ok(Self { attach: Pipeline::new(device, constants)?, sizes })
    }

    /// Records finding the lengths at `sites`, each on its triangle of the surface.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        sites: &Buffer<Vec4>,
        site_triangle: &Buffer<u32>,
    ) -> Result<()> {
        let DeviceSizes { slopes, range: [least, largest] } = &self.sizes;
        let push = attach::Push {
            site_count: sites.len() as u32,
            triangle_count: slopes.len() as u32,
            least: *least as f32,
            largest: *largest as f32,
        };
        let bindings = attach::Bindings { site_triangle, slopes, sites };
        recorder.dispatch(&self.attach, Threads(sites.len()), &push, &bindings)
    }
}

/// Lengths at the sites, and the drift of targets that they cause.
pub struct Sizing {
    find: Pipeline<lengths::Shader>,
    drift: Pipeline<drift::Shader>,
    /// The edge length wanted at each site, relative to the spacing.
    pub lengths: Buffer<f32>,
}

impl Sizing {
    /// For `sites` sites, which have the marks of [`super::pins`] if there are `curves`, in a buffer of
    /// this `layout`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        sites: usize,
        curves: bool,
        layout: SiteLayout,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let packed = layout.packed();
        let mut find = lengths::Constants { packed, ..Default::default() };
        find.workgroup = workgroup.unwrap_or(find.workgroup);
        let mut drift = drift::Constants { curves: curves.into(), packed, ..Default::default() };
        drift.workgroup = workgroup.unwrap_or(drift.workgroup);
        Ok(Self {
            find: Pipeline::new(device, find)?,
            drift: Pipeline::new(device, drift)?,
            lengths: Buffer::new(device, "default.sizing.lengths", sites)?,
        })
    }

    /// Records finding the lengths at `sites`, each on its triangle of the surface.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_lengths(
        &self,
        recorder: &mut Recorder,
        sizes: &DeviceSizes,
        sites: &Buffer<Vec4>,
        site_triangle: &Buffer<u32>,
    ) -> Result<()> {
        let push = lengths::Push {
            site_count: self.lengths.len() as u32,
            triangle_count: sizes.slopes.len() as u32,
            least: sizes.range[0] as f32,
            largest: sizes.range[1] as f32,
        };
        let bindings =
            lengths::Bindings { sites, site_triangle, slopes: &sizes.slopes, lengths: &self.lengths };
        recorder.dispatch(&self.find, Threads(self.lengths.len()), &push, &bindings)
    }

    /// Records the shift of `targets` whose faces have these `centroids`, as
    /// [`super::face::planar::PlanarFaces`] leaves them; no step is longer than `largest_move` times the
    /// length wanted there. The lists in `inputs` must have at least 6 slots.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_drift(
        &self,
        recorder: &mut Recorder,
        inputs: &PlanarInputs<'_>,
        (targets, centroids): (&Buffer<Vec4>, &Buffer<Vec4>),
        largest_move: f32,
    ) -> Result<()> {
        let PlanarInputs { sites, normals, neighbours, .. } = *inputs;
        for (block, neighbours) in neighbours.iter() {
            let push = drift::Push { first: block.first, block_sites: block.sites, largest_move };
            let bindings = drift::Bindings {
                sites,
                normals,
                neighbours,
                lengths: &self.lengths,
                centroids: &block.window(centroids)?,
                targets: &block.window(targets)?,
            };
            recorder.dispatch(&self.drift, Threads(block.sites as usize), &push, &bindings)?;
        }
        Ok(())
    }
}
