//! The faces of [`super::planar`] as polygons with the sites behind their edges, for connecting and for
//! tests.

use super::planar::{PlanarInputs, PlanarOptions};
use crate::Result;
use crate::gpu::kernels::face::polygons;
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::Vec2;

/// Faces as ordered polygons, as [`super::cell::CellFaces`] has them.
pub struct PlanarPolygons {
    pipeline: Pipeline<polygons::Shader>,
    /// Corners of each face; fewer than 3 where too few lines bound it.
    pub corner_count: Buffer<u32>,
    /// `corners[slot * sites + site]`, counter-clockwise in the frame of the tangent plane.
    pub corners: Buffer<Vec2>,
    /// The site behind the edge that ends in the corner.
    pub fan: Buffer<u32>,
    /// 0 for a closed face. Bit 0: bounded by the disc. Bit 1: more edges than slots, not to be used.
    pub state: Buffer<u32>,
}

impl PlanarPolygons {
    /// For `sites` sites, [`PlanarOptions::slots`] corners each.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, options: &PlanarOptions) -> Result<Self> {
        let PlanarOptions { k, slots, workgroup, layout, .. } = *options;
        let mut constants = polygons::Constants { k, slots, packed: layout.packed(), ..Default::default() };
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        let corners = sites * slots as usize;
        Ok(Self {
            pipeline: Pipeline::new(device, constants)?,
            corner_count: Buffer::new(device, "default.polygons.corner_count", sites)?,
            corners: Buffer::new(device, "default.polygons.corners", corners)?,
            fan: Buffer::new(device, "default.polygons.fan", corners)?,
            state: Buffer::new(device, "default.polygons.state", sites)?,
        })
    }

    /// Records the faces, none of which reaches farther than `widest` from its site; lists and boxes must be
    /// of the sites where they are.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, inputs: &PlanarInputs<'_>, widest: f32) -> Result<()> {
        let bindings = polygons::Bindings {
            sites: inputs.sites,
            normals: inputs.normals,
            neighbours: inputs.neighbours.whole()?,
            boxes: inputs.tree.boxes,
            corner_count: &self.corner_count,
            corners: &self.corners,
            fan: &self.fan,
            state: &self.state,
        };
        let push = polygons::Push {
            starts_low: inputs.tree.starts[0],
            starts_high: inputs.tree.starts[1],
            levels: inputs.tree.levels,
            site_count: self.state.len() as u32,
            widest,
        };
        recorder.dispatch(&self.pipeline, Threads(self.state.len()), &push, &bindings)
    }
}
