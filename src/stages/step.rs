//! Moving the sites, and how far they go.

use super::blocks::{Block, STEP};
use super::face::planar::PlanarInputs;
use super::project::walk::Walk;
use super::site_layout::SiteLayout;
use crate::gpu::kernels::step::{keep_off, reduce, settle, step};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::{Error, Result};
use glam::{Vec2, Vec4};

/// Moves the sites and keeps the step length of every iteration.
pub struct Step {
    step: Pipeline<step::Shader>,
    reduce: Pipeline<reduce::Shader>,
    partials: Buffer<Vec2>,
    /// Per iteration: root mean square and largest step, in the unit-diagonal frame.
    pub history: Buffer<Vec2>,
}

impl Step {
    /// For `sites` sites and at most `iterations` iterations.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sites: usize, iterations: u32, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = step::Constants::default();
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        Ok(Self {
            step: Pipeline::new(device, constants)?,
            reduce: Pipeline::new(device, reduce::Constants::default())?,
            partials: Buffer::new(device, "rtf.step.partials", sites.div_ceil(constants.workgroup as usize))?,
            history: Buffer::new(device, "rtf.step.history", iterations as usize)?,
        })
    }

    /// Records that no iteration was made so far: steps that no device writes are 0.
    ///
    /// # Errors
    /// As [`Recorder::fill`].
    pub fn record_begin(&self, recorder: &mut Recorder) -> Result<()> {
        recorder.fill(&self.history, 0)
    }

    /// Records the move of `sites` to `projected` as iteration `iteration`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        projected: &Buffer<Vec4>,
        sites: &Buffer<Vec4>,
        iteration: u32,
    ) -> Result<()> {
        let site_count = sites.len() as u32;
        let bindings = step::Bindings { projected, sites, partials: &self.partials };
        recorder.dispatch(&self.step, Threads(sites.len()), &step::Push { site_count }, &bindings)?;
        let push = reduce::Push { partial_count: self.partials.len() as u32, site_count, iteration };
        let bindings = reduce::Bindings { partials: &self.partials, history: &self.history };
        // One workgroup, see the kernel.
        recorder.dispatch(&self.reduce, Threads(1), &push, &bindings)
    }
}

/// Moves the sites to their projections and keeps the step length of every iteration.
pub struct Settle {
    settle: Pipeline<settle::Shader>,
    reduce: Pipeline<reduce::Shader>,
    partials: Buffer<Vec2>,
    workgroup: u32,
    layout: SiteLayout,
    blocks: Vec<Block>,
    moving: usize,
    /// The surface's normals at the sites, packed as in `glsl/common/octahedral.glsl`.
    pub surface_normals: Buffer<u32>,
    /// Per iteration: root mean square and largest distance of a site to its centroid, in the unit-diagonal
    /// frame.
    pub history: Buffer<Vec2>,
}

impl Settle {
    /// For `sites` sites and at most `iterations` iterations. With curves, `moving` is the number of sites
    /// that are not pinned; sites then have the marks of [`super::pins`], and pinned ones do not count in
    /// means. Their buffer has this `layout`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(
        device: &Device,
        sites: usize,
        iterations: u32,
        moving: Option<usize>,
        layout: SiteLayout,
        workgroup: Option<u32>,
    ) -> Result<Self> {
        let mut constants = settle::Constants {
            curves: moving.is_some().into(),
            packed: layout.packed(),
            ..Default::default()
        };
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        let blocks = Block::divide(sites, Block::largest(device, size_of::<Vec4>()));
        if blocks.len() > 1 && !STEP.is_multiple_of(constants.workgroup as usize) {
            let problem = format!("workgroups of {} do not end where blocks do", constants.workgroup);
            return Err(Error::Internal(problem));
        }
        Ok(Self {
            settle: Pipeline::new(device, constants)?,
            reduce: Pipeline::new(device, reduce::Constants::default())?,
            partials: Buffer::new(
                device,
                "default.step.partials",
                sites.div_ceil(constants.workgroup as usize),
            )?,
            workgroup: constants.workgroup,
            layout,
            blocks,
            moving: moving.unwrap_or(sites),
            surface_normals: Buffer::new(device, "default.step.surface_normals", sites)?,
            history: Buffer::new(device, "default.step.history", iterations as usize)?,
        })
    }

    /// As [`Step::record_begin`].
    ///
    /// # Errors
    /// As [`Recorder::fill`].
    pub fn record_begin(&self, recorder: &mut Recorder) -> Result<()> {
        recorder.fill(&self.history, 0)
    }

    /// Records the move to what `walk` found for `targets`, whose w is the squared distance to the centroid.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        walk: &Walk,
        targets: &Buffer<Vec4>,
        sites: &Buffer<Vec4>,
        iteration: u32,
    ) -> Result<()> {
        for block in &self.blocks {
            let push = settle::Push { site_count: block.sites, first_partial: block.first / self.workgroup };
            let bindings = settle::Bindings {
                projected: &block.window(&walk.projected)?,
                normals: &block.window(&walk.normals)?,
                targets: &block.window(targets)?,
                sites: &self.layout.window(sites, *block)?,
                surface_normals: &block.window(&self.surface_normals)?,
                partials: &self.partials,
            };
            recorder.dispatch(&self.settle, Threads(block.sites as usize), &push, &bindings)?;
        }
        let moving = self.moving.max(1) as u32;
        let push = reduce::Push { partial_count: self.partials.len() as u32, site_count: moving, iteration };
        let bindings = reduce::Bindings { partials: &self.partials, history: &self.history };
        // One workgroup, see the kernel.
        recorder.dispatch(&self.reduce, Threads(1), &push, &bindings)
    }
}

/// Keeps targets at a clearance from curves.
pub struct KeepOff {
    pipeline: Pipeline<keep_off::Shader>,
    /// Bound in place of lengths where all are equal.
    no_lengths: Buffer<f32>,
}

impl KeepOff {
    /// `sized`: with a size field.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, sized: bool, workgroup: Option<u32>) -> Result<Self> {
        let mut constants = keep_off::Constants { sized: sized.into(), ..Default::default() };
        constants.workgroup = workgroup.unwrap_or(constants.workgroup);
        let no_lengths = Buffer::new(device, "default.step.no_lengths", 1)?;
        Ok(Self { pipeline: Pipeline::new(device, constants)?, no_lengths })
    }

    /// Records moving the `targets` of sites with the marks of [`super::pins`]. The lists in `inputs` must
    /// have at least 12 slots. With a size field, `lengths` has the lengths wanted at the sites, relative to
    /// `spacing`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        inputs: &PlanarInputs<'_>,
        targets: &Buffer<Vec4>,
        spacing: f64,
        lengths: Option<&Buffer<f32>>,
    ) -> Result<()> {
        let lengths = lengths.unwrap_or(&self.no_lengths);
        let PlanarInputs { sites, normals, neighbours, .. } = *inputs;
        let spacing = spacing as f32;
        for (block, neighbours) in neighbours.iter() {
            let push = keep_off::Push { first: block.first, block_sites: block.sites, spacing };
            let targets = &block.window(targets)?;
            let bindings = keep_off::Bindings { sites, normals, neighbours, targets, lengths };
            recorder.dispatch(&self.pipeline, Threads(block.sites as usize), &push, &bindings)?;
        }
        Ok(())
    }
}
