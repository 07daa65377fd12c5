//! Samples of the surface: distances from its vertices to the mesh, by triangle of the mesh.

use super::mesh::FitMesh;
use crate::Result;
use crate::gpu::kernels::fit::{inward, keys, segments};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::octahedral::pack;
use crate::stages::project::walk::Walk;
use crate::stages::spatial::Sort;
use glam::{DVec3, Vec2, Vec4};

/// A vertex of the surface, as the fit sees it.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    /// Where it is.
    pub position: DVec3,
    /// The direction that the surface faces there, of any length but 0.
    pub normal: DVec3,
    /// The area around it.
    pub area: f64,
    /// A triangle of the mesh near it, from which walks begin.
    pub near: u32,
}

/// The samples of the surface.
pub struct InwardSamples {
    inward: Pipeline<inward::Shader>,
    keys: Pipeline<keys::Shader>,
    segments: Pipeline<segments::Shader>,
    points: Buffer<Vec4>,
    sides: Buffer<u32>,
    under: Buffer<u32>,
    walk: Walk,
    sort: Sort,
    /// `xyz` the direction and `w` the distance, both times the root of the weight; 0 where there is none.
    pub samples: Buffer<Vec4>,
    /// The weights of corners 1 and 2 of the triangle.
    pub weights: Buffer<Vec2>,
    /// Where the samples of each triangle begin and end in [`InwardSamples::order`].
    pub ranges: Buffer<u32>,
}

impl InwardSamples {
    /// For these vertices of the surface, and a mesh of `triangles` triangles. `workgroup` overrides the
    /// kernels' own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        points: &[SurfacePoint],
        triangles: usize,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let own = workgroup.unwrap_or(inward::Constants::default().workgroup);
        let at = |p: &SurfacePoint| p.position.as_vec3().extend(p.area as f32);
        let positions: Vec<Vec4> = points.iter().map(at).collect();
        let sides: Vec<u32> = points.iter().map(|p| pack(p.normal.normalize_or_zero())).collect();
        let near: Vec<u32> = points.iter().map(|p| p.near).collect();
        // Triangles, and one more number for points without a sample.
        let bits = u32::BITS - (triangles as u32).leading_zeros();
        Ok(Self {
            inward: Pipeline::new(device, inward::Constants { workgroup: own })?,
            keys: Pipeline::new(device, keys::Constants { workgroup: own })?,
            segments: Pipeline::new(device, segments::Constants { workgroup: own })?,
            points: Buffer::from_slice(device, "fit.inward.points", &positions)?,
            sides: Buffer::from_slice(device, "fit.inward.sides", &sides)?,
            under: Buffer::from_slice(device, "fit.inward.under", &near)?,
            walk: Walk::new(device, points.len(), workgroup)?,
            sort: Sort::new(device, points.len(), bits, workgroup)?,
            samples: Buffer::new(device, "fit.inward.samples", points.len())?,
            weights: Buffer::new(device, "fit.inward.weights", points.len())?,
            ranges: Buffer::new(device, "fit.inward.ranges", 2 * triangles)?,
        })
    }

    /// The indices of the samples, sorted by the triangle that they lie on.
    pub fn by_triangle(&self) -> &Buffer<u32> {
        &self.sort.values
    }

    /// The triangles of the mesh under the points, after [`InwardSamples::record`].
    pub fn under(&self) -> &Buffer<u32> {
        &self.under
    }

    /// Records looking up all samples.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, on: &FitMesh) -> Result<()> {
        let Self { points: surface_points, sides: surface_sides, under, .. } = self;
        let (inward_samples, inward_weights) = (&self.samples, &self.weights);
        let (point_count, threads) = (self.points.len() as u32, Threads(self.points.len()));
        self.walk.record(recorder, surface_points, &on.ground, under)?;
        let bindings = inward::Bindings {
            surface_points,
            surface_sides,
            projected: &self.walk.projected,
            under,
            positions: &on.mesh.positions,
            corners: &on.mesh.corners,
            inward_samples,
            inward_weights,
        };
        recorder.dispatch(&self.inward, threads, &inward::Push { point_count }, &bindings)?;
        let triangle_count = on.mesh.triangles() as u32;
        let (keys, values) = (&self.sort.keys, &self.sort.values);
        let push = keys::Push { point_count, triangle_count };
        let bindings = keys::Bindings { under, inward_samples, keys, values };
        recorder.dispatch(&self.keys, threads, &push, &bindings)?;
        self.sort.record(recorder)?;
        recorder.fill(&self.ranges, 0)?;
        let push = segments::Push { point_count, triangle_count };
        recorder.dispatch(&self.segments, threads, &push, &segments::Bindings { keys, ranges: &self.ranges })
    }
}
