//! Samples of the mesh: distances from its vertices, edges and triangles to the surface.

use super::mesh::FitMesh;
use crate::Result;
use crate::gpu::kernels::fit::{corner_samples, face_samples, points};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::blocks::Block;
use crate::stages::project::bvh::Bvh;
use crate::stages::project::closest::{ClosestPoints, Projections};
use crate::stages::project::walk::Walk;
use crate::stages::records::TriangleRecords;
use glam::Vec4;

/// Samples that are looked up at a time, so that what lies between takes little memory.
const CHUNK: usize = 1 << 19;

/// The samples of a mesh, `xyz` the direction and `w` the distance, both times the root of the weight; 0
/// where there is none.
pub struct FaceSamples {
    corner_kernel: Pipeline<corner_samples::Shader>,
    points_kernel: Pipeline<points::Shader>,
    samples_kernel: Pipeline<face_samples::Shader>,
    of_vertices: Walk,
    of_points: Walk,
    points: Buffer<Vec4>,
    under: Buffer<u32>,
    sides: Buffer<Vec4>,
    closest: ClosestPoints,
    tree: Bvh,
    chunk: usize,
    /// At the vertices.
    pub corners: Buffer<Vec4>,
    /// At the centres of the triangles.
    pub faces: Buffer<Vec4>,
    /// At the middles of the edges.
    pub edges: Buffer<Vec4>,
}

impl FaceSamples {
    /// For a mesh and a surface on the device; `workgroup` overrides the kernels' own, and `chunk` how many
    /// samples are looked up at a time.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        (on, surface): (&FitMesh, &TriangleRecords),
        workgroup: Option<u32>,
        chunk: Option<usize>,
    ) -> Result<Self> {
        let (vertices, triangles, edges) = (on.mesh.vertices(), on.mesh.triangles(), on.edges.len());
        let own = workgroup.unwrap_or(points::Constants::default().workgroup);
        let chunk = chunk.unwrap_or(CHUNK).min(edges.max(triangles));
        Ok(Self {
            corner_kernel: Pipeline::new(device, corner_samples::Constants { workgroup: own })?,
            points_kernel: Pipeline::new(device, points::Constants { workgroup: own })?,
            samples_kernel: Pipeline::new(device, face_samples::Constants { workgroup: own })?,
            of_vertices: Walk::new(device, vertices, workgroup)?,
            of_points: Walk::new(device, chunk, workgroup)?,
            points: Buffer::new(device, "fit.samples.points", chunk)?,
            under: Buffer::new(device, "fit.samples.under", chunk)?,
            sides: Buffer::new(device, "fit.samples.sides", chunk)?,
            closest: ClosestPoints::new(device, workgroup)?,
            tree: Bvh::new(device, surface.len(), workgroup)?,
            chunk,
            corners: Buffer::new(device, "fit.samples.corners", vertices)?,
            faces: Buffer::new(device, "fit.samples.faces", triangles)?,
            edges: Buffer::new(device, "fit.samples.edges", edges)?,
        })
    }

    /// Records the tree over the surface that searches need, once.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_tree(&self, recorder: &mut Recorder, surface: &TriangleRecords) -> Result<()> {
        self.tree.record(recorder, surface)
    }

    /// Records looking up all samples. `site_triangle` has the triangles of the surface near the vertices,
    /// and then those under them. Samples that a walk leaves farther from the surface than `far` are looked
    /// up in all of it, since walks can end in a valley.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        on: &FitMesh,
        surface: &TriangleRecords,
        site_triangle: &Buffer<u32>,
        far: f32,
    ) -> Result<()> {
        let positions = &on.mesh.positions;
        self.of_vertices.record(recorder, positions, surface, site_triangle)?;
        let found = Projections { projected: &self.of_vertices.projected, normals: &on.sides, least: far };
        self.closest.record(recorder, positions, surface, &self.tree, found, site_triangle)?;
        let push = corner_samples::Push { vertex_count: on.mesh.vertices() as u32 };
        let bindings = corner_samples::Bindings {
            positions,
            frames: &on.frames,
            projected: &self.of_vertices.projected,
            site_triangle,
            triangle_normals: &surface.normals,
            corner_samples: &self.corners,
        };
        recorder.dispatch(&self.corner_kernel, Threads(on.mesh.vertices()), &push, &bindings)?;
        for (samples, of_edges) in [(&self.faces, 0), (&self.edges, 1)] {
            for block in Block::divide(samples.len(), self.chunk) {
                self.record_chunk(recorder, on, (surface, site_triangle, far), (samples, of_edges, block))?;
            }
        }
        Ok(())
    }

    fn record_chunk(
        &self,
        recorder: &mut Recorder,
        on: &FitMesh,
        (surface, site_triangle, far): (&TriangleRecords, &Buffer<u32>, f32),
        (samples, of_edges, block): (&Buffer<Vec4>, u32, Block),
    ) -> Result<()> {
        let (positions, corners, states) = (&on.mesh.positions, &on.mesh.corners, &on.mesh.states);
        let (edges, threads) = (&on.edges, Threads(block.sites as usize));
        let (first, sample_count) = (block.first, block.sites);
        let part = Block { first: 0, sites: block.sites };
        let (points, under) = (&part.window(&self.points)?, &part.window(&self.under)?);
        let sides = &part.window(&self.sides)?;
        let bindings =
            points::Bindings { positions, corners, states, edges, site_triangle, points, under, sides };
        let push = points::Push { first, sample_count, of_edges };
        recorder.dispatch(&self.points_kernel, threads, &push, &bindings)?;
        self.of_points.record(recorder, points, surface, under)?;
        let found = Projections { projected: &self.of_points.projected, normals: sides, least: far };
        self.closest.record(recorder, points, surface, &self.tree, found, under)?;
        let bindings = face_samples::Bindings {
            positions,
            corners,
            twins: &on.mesh.twins,
            edges,
            projected: &self.of_points.projected,
            under,
            triangle_normals: &surface.normals,
            samples: &block.window(samples)?,
        };
        let push = face_samples::Push { first, sample_count, of_edges };
        recorder.dispatch(&self.samples_kernel, threads, &push, &bindings)
    }
}
