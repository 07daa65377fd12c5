//! The target of a site: a centroid of its face.

use super::face::cell::CellFaces;
use crate::Result;
use crate::gpu::kernels::centroid::{area, vertex};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::options::Centroid;
use glam::Vec4;

/// Either centroid kernel and its result.
pub struct Centroids {
    pipeline: Which,
    /// The centroid of each face, not on the surface; w = 0.
    pub targets: Buffer<Vec4>,
}

enum Which {
    Vertex(Pipeline<vertex::Shader>),
    Area(Pipeline<area::Shader>),
}

impl Centroids {
    /// For `sites` sites.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, kind: Centroid, workgroup: Option<u32>) -> Result<Self> {
        let pipeline = match kind {
            Centroid::Vertex => {
                let default = vertex::Constants::default();
                let constants = vertex::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
                Which::Vertex(Pipeline::new(device, constants)?)
            }
            Centroid::Area => {
                let default = area::Constants::default();
                let constants = area::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
                Which::Area(Pipeline::new(device, constants)?)
            }
        };
        Ok(Self { pipeline, targets: Buffer::new(device, "rtf.centroid.targets", sites)? })
    }

    /// Records the kernel.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        sites: &Buffer<Vec4>,
        normals: &Buffer<Vec4>,
        faces: &CellFaces,
    ) -> Result<()> {
        let threads = Threads(sites.len());
        let site_count = sites.len() as u32;
        let CellFaces { corner_count, corners, .. } = faces;
        let targets = &self.targets;
        match &self.pipeline {
            Which::Vertex(pipeline) => {
                let bindings = vertex::Bindings { sites, normals, corner_count, corners, targets };
                recorder.dispatch(pipeline, threads, &vertex::Push { site_count }, &bindings)
            }
            Which::Area(pipeline) => {
                let bindings = area::Bindings { sites, normals, corner_count, corners, targets };
                recorder.dispatch(pipeline, threads, &area::Push { site_count }, &bindings)
            }
        }
    }
}
