//! Holding back moves that would spoil triangles.

use super::mesh::FitMesh;
use crate::Result;
use crate::gpu::kernels::fit::{accept, clamp, extremes, hold, shorten, spoiled};
use crate::gpu::{Buffer, Device, Download, Pipeline, Recorder, Threads};
use crate::stages::polish::work_list::WorkList;
use glam::Vec4;

/// Times that moves at spoiled triangles are halved before they are set to 0.
const HALVINGS: u32 = 4;
/// Times that setting moves to 0 may spread before all moves are.
const STOPS: u32 = 20;
/// Bits of a number above all angles, and of one below.
const NO_ANGLES: [u32; 2] = [0x7f00_0000, 0];

/// The last step of a round: moving the vertices, as far as no triangle folds over or gets worse angles than
/// it may.
pub struct Limits {
    clamp: Pipeline<clamp::Shader>,
    extremes: Pipeline<extremes::Shader>,
    spoiled: Pipeline<spoiled::Shader>,
    shorten: Pipeline<shorten::Shader>,
    hold: Pipeline<hold::Shader>,
    accept: Pipeline<accept::Shader>,
    marks: Buffer<u32>,
    held: WorkList,
}

impl Limits {
    /// For a mesh with this many vertices; `workgroup` overrides the kernels' own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, vertices: usize, workgroup: Option<u32>) -> Result<Self> {
        let workgroup = workgroup.unwrap_or(clamp::Constants::default().workgroup);
        Ok(Self {
            clamp: Pipeline::new(device, clamp::Constants { workgroup })?,
            extremes: Pipeline::new(device, extremes::Constants { workgroup })?,
            spoiled: Pipeline::new(device, spoiled::Constants { workgroup })?,
            shorten: Pipeline::new(device, shorten::Constants { workgroup })?,
            hold: Pipeline::new(device, hold::Constants { workgroup })?,
            accept: Pipeline::new(device, accept::Constants { workgroup })?,
            marks: Buffer::new(device, "fit.limits.marks", vertices)?,
            // A vertex comes again until its move is 0.
            held: WorkList::new(device, "fit", (HALVINGS as usize + 1) * vertices)?,
        })
    }

    /// Records moving the vertices by `moves`, whose fourth components become the share that is made. Angles
    /// below `least` radians may lose but little.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        on: &FitMesh,
        moves: &Buffer<Vec4>,
        least: f32,
    ) -> Result<()> {
        let mesh = on.mesh;
        let (positions, corners) = (&mesh.positions, &mesh.corners);
        let (firsts, twins, marks) = (&mesh.firsts, &mesh.twins, &self.marks);
        let WorkList { list: held, counters, groups, .. } = &self.held;
        let (vertex_count, vertices) = (mesh.vertices() as u32, Threads(mesh.vertices()));
        let (triangle_count, triangles) = (mesh.triangles() as u32, Threads(mesh.triangles()));
        let bindings = clamp::Bindings { frames: &on.frames, moves, marks };
        recorder.dispatch(&self.clamp, vertices, &clamp::Push { vertex_count }, &bindings)?;
        self.held.record_clear_with(recorder, NO_ANGLES)?;
        let bindings = extremes::Bindings { positions, corners, counters };
        recorder.dispatch(&self.extremes, triangles, &extremes::Push { triangle_count }, &bindings)?;
        let bindings = spoiled::Bindings { corners, positions, moves, marks, held, counters };
        let push = spoiled::Push { triangle_count, least };
        recorder.dispatch(&self.spoiled, triangles, &push, &bindings)?;
        for pass in 0..HALVINGS + STOPS {
            self.held.record_advance(recorder, &self.shorten)?;
            let push = shorten::Push { share: if pass < HALVINGS { 0.5 } else { 0.0 } };
            let bindings = shorten::Bindings { counters, held, moves };
            recorder.dispatch_indirect(&self.shorten, groups, 0, &push, &bindings)?;
            let bindings = hold::Bindings { firsts, twins, corners, positions, moves, marks, held, counters };
            let push = hold::Push { pass: pass + 2, least };
            recorder.dispatch_indirect(&self.hold, groups, 0, &push, &bindings)?;
        }
        let bindings = accept::Bindings { moves, positions, counters };
        recorder.dispatch(&self.accept, vertices, &accept::Push { vertex_count }, &bindings)
    }

    /// Records a copy of the number of moves that were shortened in all.
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download_held(&self, recorder: &mut Recorder) -> Result<Download<u32>> {
        self.held.download_count(recorder)
    }
}
