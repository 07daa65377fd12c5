//! The pipelines that have all sites from the start.

mod descent;
mod exact;
mod lbfgs;
mod projection;
mod rtf;
pub(crate) mod sizes;
mod unused;

use super::clock::Clock;
use super::cost::{AttemptCost, LevelWork};
use super::fallback::faulty::Fallback;
use super::outcome::Outcome;
use super::run_context::RunContext;
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::options::{Options, Seeding, Shortage};
use crate::progress::ProgressReporter;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::poisson::{DiskSummary, disks};
use crate::sites::seed;
use crate::{Phase, Result};
use exact::ExactRun;
use rtf::PlaneFacesRun;

/// A run with all sites from the start.
pub(crate) struct AllAtOnce<'a> {
    pub context: RunContext<'a>,
    /// Edge lengths over the surface.
    pub sizes: &'a SizeField,
}

impl AllAtOnce<'_> {
    /// The mesh, with what is wrong with it.
    ///
    /// # Errors
    /// Those of the device, [`crate::Error::Input`] for a fault that the options refuse, and
    /// [`crate::Error::Cancelled`].
    pub fn run(&self, progress: &mut ProgressReporter, clock: &mut Clock) -> Result<Outcome> {
        let RunContext { device, surface, input, options, .. } = self.context;
        let vertices = options.vertices;
        let spacing = spacing(surface.area(), vertices);
        let work = LevelWork { sites: vertices, iterations: options.iterations };
        let cost = AttemptCost::new(&[work], surface.triangles.len(), options, vertices);
        progress.phase(Phase::Prepare, cost.prepared, 0.0)?;
        let (seeds, disks) = self.seeds(progress)?;
        clock.end_phase("seed");
        let begin = |progress: &mut ProgressReporter| {
            progress.phase(Phase::LastLevel, cost.levels[0].until, cost.levels[0].after)?;
            if options.iterations > 0 {
                progress.level(0, options.iterations);
            }
            Ok(())
        };
        let outcome = if options.has_plane_faces() {
            let run = PlaneFacesRun::new(device, options, surface, &seeds, (spacing, self.sizes))?;
            clock.end_phase("compile");
            begin(progress)?;
            let steps = run.iterate(device, options, progress)?;
            clock.end_phase("iterate");
            Outcome { steps, ..run.connect(device, (surface, self.sizes), input, progress)? }
        } else if options.iterations > 0 {
            let mut run = ExactRun::new(device, options, surface, &seeds, spacing)?;
            clock.end_phase("compile");
            begin(progress)?;
            let (steps, exact) = run.iterate(surface, progress)?;
            clock.end_phase("iterate");
            Outcome { steps, exact: Some(exact), ..run.connect(surface, input, progress)? }
        } else {
            begin(progress)?;
            exact::connect_exact_cells(device, surface, input, seeds, spacing, progress)?
        };
        // Points that were moved are no longer a Poisson-disk sampling.
        let disks = disks.filter(|_| options.iterations == 0);
        clock.end_phase("connect");
        progress.phase(Phase::Check, cost.check.until, cost.check.after)?;
        let is_sized = !self.sizes.is_uniform();
        let edge_lengths = is_sized.then(|| self.sizes.range().map(|length| length * spacing));
        let outcome = Outcome { edge_lengths, ..outcome };
        let outcome = self.with_fault(Outcome { disks, vertices, attempts: 1, ..outcome }, progress)?;
        clock.end_phase("check");
        Ok(outcome)
    }

    /// The outcome with its fault, found as the default pipeline finds it.
    fn with_fault(&self, mut outcome: Outcome, progress: &mut ProgressReporter) -> Result<Outcome> {
        let RunContext { frame, input, options, .. } = self.context;
        let checks = Fallback { context: self.context, sizes: self.sizes };
        if outcome.fault.is_none() {
            let mesh = std::mem::take(&mut outcome.mesh);
            outcome = progress.during(|progress| checks.checked(mesh, outcome, progress))?;
        }
        match &outcome.fault {
            Some(fault) if outcome.is_refused() && options.shortage == Shortage::Refuse => {
                Err(fault.refusal(options.vertices, input, frame))
            }
            _ => Ok(outcome),
        }
    }

    /// The initial sites, with the figures of a Poisson-disk sampling if they are one.
    fn seeds(&self, progress: &mut ProgressReporter) -> Result<(SitesOnSurface, Option<DiskSummary>)> {
        let RunContext { surface, options: Options { vertices, seed, .. }, .. } = self.context;
        Ok(match self.context.options.all_at_once.seeding {
            Seeding::Random => (seed::random(surface, self.sizes, *vertices, *seed), None),
            Seeding::Stratified => (seed::stratified(surface, self.sizes, *vertices, *seed), None),
            Seeding::Poisson => {
                let sampling = progress.during(|progress| disks(surface, *vertices, *seed, progress))?;
                (sampling.sites, Some(sampling.summary))
            }
        })
    }
}
