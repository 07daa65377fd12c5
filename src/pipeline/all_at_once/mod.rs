//! The pipelines that have all sites from the start.

pub(crate) mod descent;
pub(crate) mod exact;
pub(crate) mod lbfgs;
pub(crate) mod projection;
pub(crate) mod rtf;

use super::coarse_to_fine::attempts::Settled;
use super::cost::{AttemptCost, LevelWork};
use super::{Clock, Connection};
use crate::gpu::Device;
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::mesh::topology::Topology;
use crate::options::{Options, Seeding};
use crate::progress::ProgressReporter;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::poisson::{DiskSummary, disks};
use crate::sites::seed;
use crate::sites::surface::Surface;
use crate::{Phase, Result};

/// A run with all sites from the start.
pub(crate) struct AllAtOnce<'a> {
    pub device: &'a Device,
    pub surface: &'a Surface,
    /// Topology of the surface.
    pub input: &'a Topology,
    pub options: &'a Options,
}

impl AllAtOnce<'_> {
    /// # Errors
    /// Those of the device, and [`crate::Error::Cancelled`].
    pub fn run(&self, progress: &mut ProgressReporter, clock: &mut Clock) -> Result<Settled> {
        let Self { device, surface, input, options } = *self;
        let vertices = options.vertices;
        let spacing = spacing(surface.area(), vertices);
        let work = LevelWork { sites: vertices, iterations: options.iterations };
        let cost = AttemptCost::new(&[work], surface.triangles.len(), options);
        progress.phase(Phase::Prepare, cost.prepared, 0.0)?;
        let (seeds, disks) = self.seeds(progress)?;
        clock.phase("seed");
        let begin = |progress: &mut ProgressReporter| {
            progress.phase(Phase::LastLevel, cost.levels[0].until, cost.levels[0].after)?;
            if options.iterations > 0 {
                progress.level(0, options.iterations);
            }
            Ok(())
        };
        let (connection, steps) = if options.has_plane_faces() {
            let run = rtf::PlaneFacesRun::new(device, options, surface, &seeds, spacing)?;
            clock.phase("compile");
            begin(progress)?;
            let steps = run.iterate(device, surface, options, progress)?;
            clock.phase("iterate");
            (run.connect(device, surface, input, progress)?, steps)
        } else if options.iterations > 0 {
            let mut run = exact::ExactRun::new(device, options, surface, &seeds, spacing)?;
            clock.phase("compile");
            begin(progress)?;
            let (steps, summary) = run.iterate(surface, progress)?;
            clock.phase("iterate");
            (Connection { exact: Some(summary), ..run.connect(surface, progress)? }, steps)
        } else {
            begin(progress)?;
            (exact::connected(device, surface, seeds, spacing, progress)?, Vec::new())
        };
        // Once they move, they are no disks.
        let disks = disks.filter(|_| options.iterations == 0);
        let connection = Connection { disks, ..connection };
        Ok(Settled { connection, steps, skeleton: None, vertices, attempts: 1 })
    }

    /// Where sites begin.
    fn seeds(&self, progress: &mut ProgressReporter) -> Result<(SitesOnSurface, Option<DiskSummary>)> {
        let Self { surface, options: Options { vertices, seed, .. }, .. } = *self;
        Ok(match self.options.all_at_once.seeding {
            Seeding::Random => (seed::random(surface, *vertices, *seed), None),
            Seeding::Stratified => (seed::stratified(surface, &SizeField::default(), *vertices, *seed), None),
            Seeding::Poisson => {
                let found = progress.during(|progress| disks(surface, *vertices, *seed, progress))?;
                (found.sites, Some(found.summary))
            }
        })
    }
}
