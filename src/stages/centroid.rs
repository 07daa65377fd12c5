//! The target of a site: a centroid of its face.

use super::face::cell::CellFaces;
use crate::Result;
use crate::gpu::kernels::centroid::{area, corners, weighted_corners};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::options::Centroid;
use glam::Vec4;

/// One of the centroid kernels and its result.
pub struct Centroids {
    pipeline: Which,
    /// The centroid of each face, not on the surface; w = 0.
    pub targets: Buffer<Vec4>,
}

enum Which {
    Corners(Pipeline<corners::Shader>),
    WeightedCorners(Pipeline<weighted_corners::Shader>),
    Area(Pipeline<area::Shader>),
}

impl Centroids {
    /// For `sites` sites.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, kind: Centroid, workgroup: Option<u32>) -> Result<Self> {
        let pipeline = match kind {
            Centroid::Corners => {
                let default = corners::Constants::default();
                let constants = corners::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
                Which::Corners(Pipeline::new(device, constants)?)
            }
            Centroid::WeightedCorners => {
                let default = weighted_corners::Constants::default();
                let constants =
                    weighted_corners::Constants { workgroup: workgroup.unwrap_or(default.workgroup) };
                Which::WeightedCorners(Pipeline::new(device, constants)?)
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
            Which::Corners(pipeline) => {
                let bindings = corners::Bindings { sites, normals, corner_count, corners, targets };
                recorder.dispatch(pipeline, threads, &corners::Push { site_count }, &bindings)
            }
            Which::WeightedCorners(pipeline) => {
                let bindings = weighted_corners::Bindings { sites, normals, corner_count, corners, targets };
                recorder.dispatch(pipeline, threads, &weighted_corners::Push { site_count }, &bindings)
            }
            Which::Area(pipeline) => {
                let bindings = area::Bindings { sites, normals, corner_count, corners, targets };
                recorder.dispatch(pipeline, threads, &area::Push { site_count }, &bindings)
            }
        }
    }
}
