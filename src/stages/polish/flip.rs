//! Edge flips of many edges at once.

use super::mesh::DeviceMesh;
use super::work_list::WorkList;
use crate::Result;
use crate::gpu::kernels::polish::{claim, flip, wanted, win};
use crate::gpu::{Buffer, Device, Download, Pipeline, Recorder, Threads};

/// Passes of a sweep. In each, edges are flipped that have the vertices around them to themselves; what then
/// is left, and still pays, comes in the next pass or sweep.
pub const PASSES: u32 = 4;

/// Flips edges towards Delaunay triangles and six edges a vertex, with what they need for it.
///
/// In a pass, every edge whose flip pays puts a priority of its own onto the four vertices around it, and is
/// flipped if it has the largest at all four. So flips of a pass never touch each other, and the result does
/// not depend on the order in which the device gets to them.
pub struct Flips {
    wanted: Pipeline<wanted::Shader>,
    claim: Pipeline<claim::Shader>,
    win: Pipeline<win::Shader>,
    flip: Pipeline<flip::Shader>,
    candidates: WorkList,
    claims: Buffer<u32>,
}

impl Flips {
    /// For a mesh of this size; `workgroup` overrides the kernels' own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, vertices: usize, triangles: usize, workgroup: Option<u32>) -> Result<Self> {
        let workgroup = workgroup.unwrap_or(wanted::Constants::default().workgroup);
        Ok(Self {
            wanted: Pipeline::new(device, wanted::Constants { workgroup })?,
            claim: Pipeline::new(device, claim::Constants { workgroup })?,
            win: Pipeline::new(device, win::Constants { workgroup })?,
            flip: Pipeline::new(device, flip::Constants { workgroup })?,
            // Every edge with two triangles at most once.
            candidates: WorkList::new(device, "flips", 3 * triangles / 2)?,
            claims: Buffer::new(device, "polish.flips.claims", vertices)?,
        })
    }

    /// Records a sweep over all edges in `passes` passes. `valence_weight` is that of
    /// [`crate::polish::PolishOptions`]; `sweep` numbers the sweeps of a mesh.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        mesh: &DeviceMesh,
        valence_weight: f32,
        (sweep, passes): (u32, u32),
    ) -> Result<()> {
        let DeviceMesh { positions, corners, twins, firsts, states } = mesh;
        let WorkList { list: candidates, counters, groups, .. } = &self.candidates;
        self.candidates.record_clear(recorder)?;
        let push = wanted::Push { triangle_count: mesh.triangles() as u32, valence_weight };
        let bindings = wanted::Bindings { positions, corners, twins, states, candidates, counters };
        recorder.dispatch(&self.wanted, Threads(mesh.triangles()), &push, &bindings)?;
        self.candidates.record_advance(recorder, &self.claim)?;
        for pass in 0..passes {
            let salt = sweep * PASSES + pass;
            recorder.fill(&self.claims, 0)?;
            let claims = &self.claims;
            let bindings =
                claim::Bindings { counters, candidates, positions, corners, twins, firsts, states, claims };
            let push = claim::Push { valence_weight, salt };
            recorder.dispatch_indirect(&self.claim, groups, 0, &push, &bindings)?;
            let bindings = win::Bindings { counters, candidates, corners, twins, claims };
            recorder.dispatch_indirect(&self.win, groups, 0, &win::Push { salt }, &bindings)?;
            let bindings = flip::Bindings { counters, candidates, corners, twins, firsts, states };
            recorder.dispatch_indirect(&self.flip, groups, 0, &flip::Push {}, &bindings)?;
        }
        Ok(())
    }

    /// Records a copy of the number of edges that were flipped in all.
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download_flips(&self, recorder: &mut Recorder) -> Result<Download<u32>> {
        self.candidates.download_count(recorder)
    }
}
