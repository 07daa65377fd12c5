//! The normal equations of the fit, solved by conjugate gradients.

use super::inward::InwardSamples;
use super::mesh::FitMesh;
use super::samples::FaceSamples;
use crate::Result;
use crate::gpu::kernels::fit::{
    apply, blocks, blocks_inward, descend, own, own_edges, own_inward, scalars, turn,
};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::{Vec2, Vec4};

/// What the solver's scalars are made from, as `glsl/fit/scalars.comp` has it.
#[derive(Clone, Copy)]
enum Scalar {
    FirstResidual,
    Length,
    Share,
}

/// The equations, a 3 × 3 block for each vertex and each edge, and their solution.
pub struct Equations {
    own_kernel: Pipeline<own::Shader>,
    own_edges_kernel: Pipeline<own_edges::Shader>,
    own_inward_kernel: Pipeline<own_inward::Shader>,
    blocks_kernel: Pipeline<blocks::Shader>,
    blocks_inward_kernel: Pipeline<blocks_inward::Shader>,
    apply_kernel: Pipeline<apply::Shader>,
    scalars_kernel: Pipeline<scalars::Shader>,
    descend_kernel: Pipeline<descend::Shader>,
    turn_kernel: Pipeline<turn::Shader>,
    /// Blocks on the diagonal, two values each: xx, yy, zz, yz; zx, xy.
    pub own: Buffer<Vec4>,
    /// First values of the edges' blocks: xx, yy, zz, yz.
    pub block_heads: Buffer<Vec4>,
    /// Last values of the edges' blocks: zx, xy.
    pub block_tails: Buffer<Vec2>,
    /// The right-hand side before solving, then what is left of it.
    pub residual: Buffer<Vec4>,
    /// The solution: the moves of the vertices.
    pub moves: Buffer<Vec4>,
    preconditioned: Buffer<Vec4>,
    direction: Buffer<Vec4>,
    product: Buffer<Vec4>,
    partials: Buffer<f32>,
    scalars: Buffer<f32>,
}

impl Equations {
    /// For a mesh with these numbers of vertices and edges; `workgroup` overrides the kernels' own.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, vertices: usize, edges: usize, workgroup: Option<u32>) -> Result<Self> {
        let workgroup = workgroup.unwrap_or(apply::Constants::default().workgroup);
        let vectors = |name: &str| Buffer::new(device, &format!("fit.equations.{name}"), vertices);
        Ok(Self {
            own_kernel: Pipeline::new(device, own::Constants { workgroup })?,
            own_edges_kernel: Pipeline::new(device, own_edges::Constants { workgroup })?,
            own_inward_kernel: Pipeline::new(device, own_inward::Constants { workgroup })?,
            blocks_kernel: Pipeline::new(device, blocks::Constants { workgroup })?,
            blocks_inward_kernel: Pipeline::new(device, blocks_inward::Constants { workgroup })?,
            apply_kernel: Pipeline::new(device, apply::Constants { workgroup })?,
            scalars_kernel: Pipeline::new(device, scalars::Constants::default())?,
            descend_kernel: Pipeline::new(device, descend::Constants { workgroup })?,
            turn_kernel: Pipeline::new(device, turn::Constants { workgroup })?,
            own: Buffer::new(device, "fit.equations.own", 2 * vertices)?,
            block_heads: Buffer::new(device, "fit.equations.block_heads", edges)?,
            block_tails: Buffer::new(device, "fit.equations.block_tails", edges)?,
            residual: vectors("residual")?,
            moves: vectors("moves")?,
            preconditioned: vectors("preconditioned")?,
            direction: vectors("direction")?,
            product: vectors("product")?,
            partials: Buffer::new(device, "fit.equations.partials", vertices.div_ceil(workgroup as usize))?,
            scalars: Buffer::new(device, "fit.equations.scalars", 4)?,
        })
    }

    /// Records making the equations from all samples.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        on: &FitMesh,
        samples: &FaceSamples,
        inward: &InwardSamples,
    ) -> Result<()> {
        let FitMesh { mesh, edges, starts, links, frames, areas, .. } = on;
        let (firsts, twins, own, right) = (&mesh.firsts, &mesh.twins, &self.own, &self.residual);
        let FaceSamples { corners: corner_samples, faces: face_samples, edges: edge_samples, .. } = samples;
        let InwardSamples { samples: inward_samples, weights: inward_weights, ranges, .. } = inward;
        let order = inward.by_triangle();
        let (vertex_count, vertices) = (mesh.vertices() as u32, Threads(mesh.vertices()));
        let bindings =
            own::Bindings { frames, firsts, twins, corner_samples, face_samples, areas, own, right };
        recorder.dispatch(&self.own_kernel, vertices, &own::Push { vertex_count }, &bindings)?;
        let bindings = own_edges::Bindings { starts, links, edge_samples, own, right };
        recorder.dispatch(&self.own_edges_kernel, vertices, &own_edges::Push { vertex_count }, &bindings)?;
        let bindings =
            own_inward::Bindings { firsts, twins, ranges, order, inward_samples, inward_weights, own, right };
        let push = own_inward::Push { vertex_count };
        recorder.dispatch(&self.own_inward_kernel, vertices, &push, &bindings)?;
        let Self { block_heads, block_tails, .. } = self;
        let bindings =
            blocks::Bindings { edges, twins, edge_samples, face_samples, areas, block_heads, block_tails };
        let (edge_count, threads) = (edges.len() as u32, Threads(edges.len()));
        recorder.dispatch(&self.blocks_kernel, threads, &blocks::Push { edge_count }, &bindings)?;
        let bindings = blocks_inward::Bindings {
            edges,
            twins,
            ranges,
            order,
            inward_samples,
            inward_weights,
            block_heads,
            block_tails,
        };
        let push = blocks_inward::Push { edge_count };
        recorder.dispatch(&self.blocks_inward_kernel, threads, &push, &bindings)
    }

    /// Records `steps` steps of the solver from zero, preconditioned by the blocks on the diagonal.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_solve(&self, recorder: &mut Recorder, on: &FitMesh, steps: u32) -> Result<()> {
        for zero in [&self.moves, &self.direction, &self.product] {
            recorder.fill(zero, 0)?;
        }
        recorder.fill(&self.scalars, 0)?;
        self.record_descend(recorder)?;
        self.record_scalars(recorder, Scalar::FirstResidual)?;
        for _ in 0..steps {
            self.record_turn(recorder)?;
            self.record_apply(recorder, on)?;
            self.record_scalars(recorder, Scalar::Length)?;
            self.record_descend(recorder)?;
            self.record_scalars(recorder, Scalar::Share)?;
        }
        Ok(())
    }

    fn vertices(&self) -> (u32, Threads) {
        (self.moves.len() as u32, Threads(self.moves.len()))
    }

    fn record_apply(&self, recorder: &mut Recorder, on: &FitMesh) -> Result<()> {
        let Self { own, block_heads, block_tails, direction, product, partials, .. } = self;
        let FitMesh { starts, links, .. } = on;
        let (vertex_count, threads) = self.vertices();
        let bindings =
            apply::Bindings { starts, links, own, block_heads, block_tails, direction, product, partials };
        recorder.dispatch(&self.apply_kernel, threads, &apply::Push { vertex_count }, &bindings)
    }

    fn record_scalars(&self, recorder: &mut Recorder, what: Scalar) -> Result<()> {
        let Self { partials, scalars, .. } = self;
        let push = scalars::Push { part_count: partials.len() as u32, what: what as u32 };
        let threads = Threads(self.scalars_kernel.workgroup() as usize);
        recorder.dispatch(&self.scalars_kernel, threads, &push, &scalars::Bindings { partials, scalars })
    }

    fn record_descend(&self, recorder: &mut Recorder) -> Result<()> {
        let Self { own, direction, product, scalars, moves, residual, preconditioned, partials, .. } = self;
        let (vertex_count, threads) = self.vertices();
        let bindings =
            descend::Bindings { own, direction, product, scalars, moves, residual, preconditioned, partials };
        recorder.dispatch(&self.descend_kernel, threads, &descend::Push { vertex_count }, &bindings)
    }

    fn record_turn(&self, recorder: &mut Recorder) -> Result<()> {
        let Self { preconditioned, scalars, direction, .. } = self;
        let (vertex_count, threads) = self.vertices();
        let bindings = turn::Bindings { preconditioned, scalars, direction };
        recorder.dispatch(&self.turn_kernel, threads, &turn::Push { vertex_count }, &bindings)
    }
}
