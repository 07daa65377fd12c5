//! Relaxation: all vertices move at once towards the mean of their neighbours, over the surface.

use super::mesh::DeviceMesh;
use super::work_list::WorkList;
use crate::Result;
use crate::gpu::kernels::polish::{accept, folded, land, relax, spread};
use crate::gpu::{Buffer, Device, Download, Pipeline, Recorder, Threads};
use crate::stages::project::walk::Walk;
use crate::stages::records::TriangleRecords;
use glam::{UVec4, Vec4};

/// Times that undoing moves may spread before all moves of a round are undone.
const SPREADS: u32 = 8;

/// The relaxation of a mesh.
pub struct Relaxation {
    relax: Pipeline<relax::Shader>,
    land: Pipeline<land::Shader>,
    folded: Pipeline<folded::Shader>,
    spread: Pipeline<spread::Shader>,
    accept: Pipeline<accept::Shader>,
    walk: Walk,
    /// Where vertices are to go, before the walk; w = 0.
    pub targets: Buffer<Vec4>,
    normals: Buffer<u32>,
    moved: Buffer<UVec4>,
    stamps: Buffer<u32>,
    undone: WorkList,
}

impl Relaxation {
    /// For meshes of `vertices` vertices; `workgroup` overrides the kernels' own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, vertices: usize, workgroup: Option<u32>) -> Result<Self> {
        let own = workgroup.unwrap_or(relax::Constants::default().workgroup);
        Ok(Self {
            relax: Pipeline::new(device, relax::Constants { workgroup: own })?,
            land: Pipeline::new(device, land::Constants { workgroup: own })?,
            folded: Pipeline::new(device, folded::Constants { workgroup: own })?,
            spread: Pipeline::new(device, spread::Constants { workgroup: own })?,
            accept: Pipeline::new(device, accept::Constants { workgroup: own })?,
            walk: Walk::new(device, vertices, workgroup)?,
            targets: Buffer::new(device, "polish.relax.targets", vertices)?,
            normals: Buffer::new(device, "polish.relax.normals", vertices)?,
            moved: Buffer::new(device, "polish.relax.moved", vertices)?,
            stamps: Buffer::new(device, "polish.relax.stamps", vertices)?,
            undone: WorkList::new(device, "relax", vertices)?,
        })
    }

    /// Records one step of all vertices of `mesh`. `site_triangle` has the triangles of the surface that they
    /// stand on, from which walks begin, and then those where they ended.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        mesh: &DeviceMesh,
        surface: &TriangleRecords,
        site_triangle: &Buffer<u32>,
    ) -> Result<()> {
        let DeviceMesh { positions, corners, twins, firsts, states } = mesh;
        let Self { targets, normals, moved, stamps, .. } = self;
        let WorkList { list: undone, counters, groups, .. } = &self.undone;
        let (vertex_count, vertices) = (mesh.vertices() as u32, Threads(mesh.vertices()));
        let bindings = relax::Bindings { positions, corners, twins, firsts, states, targets, normals };
        recorder.dispatch(&self.relax, vertices, &relax::Push { vertex_count }, &bindings)?;
        self.walk.record(recorder, targets, surface, site_triangle)?;
        let (projected, surface_normals) = (&self.walk.projected, &self.walk.normals);
        let bindings =
            land::Bindings { positions, states, normals, projected, surface_normals, moved, stamps };
        recorder.dispatch(&self.land, vertices, &land::Push { vertex_count }, &bindings)?;
        self.undone.record_clear(recorder)?;
        let bindings = folded::Bindings { corners, positions, moved, stamps, undone, counters };
        let push = folded::Push { triangle_count: mesh.triangles() as u32 };
        recorder.dispatch(&self.folded, Threads(mesh.triangles()), &push, &bindings)?;
        for pass in 1..=SPREADS {
            self.undone.record_advance(recorder, &self.spread)?;
            let bindings =
                spread::Bindings { firsts, twins, corners, positions, moved, stamps, undone, counters };
            recorder.dispatch_indirect(&self.spread, groups, 0, &spread::Push { pass }, &bindings)?;
        }
        let bindings = accept::Bindings { moved, stamps, positions, counters };
        recorder.dispatch(&self.accept, vertices, &accept::Push { vertex_count }, &bindings)
    }

    /// Records a copy of the number of moves that were undone in all.
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download_undone(&self, recorder: &mut Recorder) -> Result<Download<u32>> {
        self.undone.download_count(recorder)
    }
}
