//! What becomes of a surface that the vertices asked for do not suffice for: other random starts, then
//! collapsed edges or more vertices.

use super::connect::Fault;
use super::levels::enough;
use super::{CoarseToFine, Ground};
use crate::gpu::Device;
use crate::mesh::topology::Topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Options, Shortage};
use crate::pipeline::prepare::ground;
use crate::pipeline::user_curves::may_simplify;
use crate::pipeline::{Clock, Connection, FeatureSummary};
use crate::progress::ProgressReporter;
use crate::sites::surface::Surface;
use crate::{Error, Result, TriMesh};
use std::sync::OnceLock;

/// Random starts with as many vertices as asked for.
const STARTS: u64 = 3;
/// Each further attempt has this many times the vertices of the last,
const GROWTH: f64 = 1.5;
/// up to so many times those asked for,
const MOST_GROWTH: usize = 4;
/// or this many.
const FEW: usize = 5000;

/// What all attempts share.
pub(crate) struct Attempts<'a> {
    pub device: &'a Device,
    /// The repaired input.
    pub mesh: &'a TriMesh,
    pub frame: &'a UnitFrame,
    pub surface: &'a Surface,
    pub input: &'a Topology,
    /// Vertices of the components that are too small to be among these.
    pub done: usize,
    pub options: &'a Options,
    /// Faces of the repaired input that run through others, once somebody asked.
    pub crossing: &'a OnceLock<usize>,
}

/// The result of the attempt that counts.
pub(crate) struct Settled {
    pub connection: Connection,
    /// Root mean square step of every iteration of the last level, in its spacings.
    pub steps: Vec<f64>,
    /// Of the default pipeline.
    pub skeleton: Option<FeatureSummary>,
    /// Vertices that the attempt was to have.
    pub vertices: usize,
    pub attempts: u32,
}

impl Attempts<'_> {
    /// The first attempt that comes out right.
    ///
    /// # Errors
    /// [`Error::Input`] if none does with as many vertices as asked for and the options want no other.
    pub fn run(&self, first: Ground, progress: &mut ProgressReporter, clock: &mut Clock) -> Result<Settled> {
        let Options { vertices: asked, seed, .. } = *self.options;
        let shortage = self.options.coarse_to_fine.shortage;
        let (first, vertices) = match shortage {
            Shortage::AddVertices => self.room(first, asked, progress)?,
            Shortage::Refuse | Shortage::BestEffort => (first, asked),
        };
        let crossing = self.crossing;
        let mut attempts = 0;
        let mut run = |ground: &Ground,
                       vertices: usize,
                       seed: u64,
                       progress: &mut ProgressReporter|
         -> Result<Settled> {
            attempts += 1;
            progress.attempt(attempts);
            let options = Options { vertices, seed, ..self.options.clone() };
            let Self { device, mesh, frame, surface, input, .. } = *self;
            let options = &options;
            let run = CoarseToFine { device, surface, ground, mesh, frame, input, crossing, options };
            let (connection, steps) = run.run(progress, clock)?;
            Ok(Settled { connection, steps, skeleton: Some(ground.skeleton), vertices, attempts })
        };
        let begun = match run(&first, vertices, seed, progress) {
            // Sharp edges need more than there are.
            Err(error @ Error::Usage { .. }) if may_simplify(self.options) => {
                let skeleton = first.skeleton;
                let collapsed =
                    progress.during(|progress| self.collapsed(skeleton, vertices, crossing, progress))?;
                return collapsed.ok_or(error);
            }
            begun => begun?,
        };
        let Some(fault) = begun.connection.fault.clone() else { return Ok(begun) };
        // Uneven triangles, but as many as asked for. Who gladly takes more gets even ones.
        let mended = |progress: &mut ProgressReporter| {
            progress.during(|progress| self.mended(&begun, crossing, progress))
        };
        // Of what is torn to begin with, other starts are unlikely to do better, and nobody waits for them.
        let torn = !self.input.is_manifold();
        if torn && let Some(mended) = mended(progress)? {
            return Ok(mended);
        }
        for start in 1..STARTS {
            let other = run(&first, vertices, seed.wrapping_add(start), progress)?;
            if other.connection.fault.is_none() {
                return Ok(other);
            }
        }
        let spare = |progress: &mut ProgressReporter| if torn { Ok(None) } else { mended(progress) };
        if shortage != Shortage::AddVertices
            && let Some(mended) = spare(progress)?
        {
            return Ok(mended);
        }
        if shortage == Shortage::BestEffort {
            return Ok(begun);
        }
        drop(first);
        let mut more = vertices;
        let enough = loop {
            more = (GROWTH * more as f64).ceil() as usize;
            if more > (MOST_GROWTH * vertices).max(FEW) {
                break None;
            }
            let larger = run(&self.ground(more, progress)?, more, seed, progress)?;
            if larger.connection.fault.is_none() {
                break Some(larger);
            }
        };
        match (enough, shortage) {
            (Some(larger), Shortage::AddVertices) => Ok(larger),
            (None, Shortage::AddVertices) => {
                spare(progress)?.ok_or_else(|| self.refusal(&fault, more, false))
            }
            (enough, _) => Err(self.refusal(&fault, more, enough.is_some())),
        }
    }

    fn ground(&self, vertices: usize, progress: &mut ProgressReporter) -> Result<Ground> {
        let options = Options { vertices, ..self.options.clone() };
        progress
            .during(|progress| ground(self.device, (self.mesh, self.frame), self.surface, &options, progress))
    }

    /// As many vertices, or more if curves leave too few of them. What counts as a curve depends on their
    /// number.
    fn room(
        &self,
        mut ground: Ground,
        mut vertices: usize,
        progress: &mut ProgressReporter,
    ) -> Result<(Ground, usize)> {
        while let Some(curves) = &ground.curves {
            let enough = enough(curves, self.surface.area(), vertices);
            if enough <= vertices {
                break;
            }
            vertices = enough;
            ground = self.ground(vertices, progress)?;
        }
        Ok((ground, vertices))
    }

    fn refusal(&self, fault: &Fault, more: usize, enough: bool) -> Error {
        let problem = format!(
            "{} vertices are too few: {}",
            self.options.vertices + self.done,
            fault.in_words(self.frame)
        );
        let more = more + self.done;
        let mend =
            if self.input.is_manifold() { "" } else { "mend the input there (`weld` closes cracks), " };
        let count = match enough {
            true => format!("ask for {more}, let `shortage` add-vertices add them"),
            false => format!("ask for more than {more}"),
        };
        let remedy = format!("{mend}{count}, or take what comes with `shortage` best-effort");
        Error::input(None, problem, remedy)
    }
}
