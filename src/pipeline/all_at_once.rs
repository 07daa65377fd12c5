//! The pipelines that have all sites from the start.

use super::attempts::Settled;
use super::plan::LevelPlan;
use super::shares::Shares;
use super::{Clock, Connection, exact, rtf};
use crate::gpu::Device;
use crate::mesh::spacing;
use crate::mesh::topology::Topology;
use crate::options::{Method, Options};
use crate::stages::poisson::disks;
use crate::stages::seed;
use crate::stages::surface::Surface;
use crate::watch::Watch;
use crate::{Phase, Result};

/// A run with all sites from the start.
pub(super) struct AllAtOnce<'a> {
    pub device: &'a Device,
    pub surface: &'a Surface,
    /// Topology of the surface.
    pub input: &'a Topology,
    pub options: &'a Options,
}

impl AllAtOnce<'_> {
    /// # Errors
    /// Those of the device, and [`crate::Error::Cancelled`].
    pub fn run(&self, watch: &mut Watch, clock: &mut Clock) -> Result<Settled> {
        let Self { device, surface, input, options } = *self;
        let spacing = spacing(surface.area(), options.vertices);
        if options.method == Method::PoissonDisk {
            return self.poisson_disks(spacing, watch, clock);
        }
        let seeds = seed::random(surface, options.vertices, options.seed);
        clock.phase("seed");
        let (connection, steps) = if options.method == Method::Exact {
            exact::run(device, options, (surface, &seeds, spacing), watch, clock)?
        } else {
            let run = rtf::Run::new(device, options, surface, &seeds, spacing)?;
            clock.phase("compile");
            let steps = run.iterate(device, surface, options, watch)?;
            clock.phase("iterate");
            (run.connect(device, surface, input)?, steps)
        };
        Ok(Settled { connection, steps, skeleton: None, vertices: options.vertices, attempts: 1 })
    }

    /// Random points that keep their distance, connected where they are.
    fn poisson_disks(&self, spacing: f64, watch: &mut Watch, clock: &mut Clock) -> Result<Settled> {
        let Self { device, surface, options, .. } = *self;
        let vertices = options.vertices;
        let plan = LevelPlan { sites: vertices, interior: vertices, spacing };
        let shares = Shares::new(&[plan], &[0], surface.triangles.len(), options);
        watch.phase(Phase::Prepare, shares.prepared, 0.0)?;
        let found = disks(surface, vertices, options.seed, &mut || watch.look())?;
        clock.phase("seed");
        watch.phase(Phase::LastLevel, shares.levels[0].until, shares.levels[0].after)?;
        let under = &found.seeds.triangles;
        let connection = exact::connected(device, surface, found.seeds.sites, under, spacing)?;
        let connection = Connection { disks: Some(found.summary), ..connection };
        Ok(Settled { connection, steps: Vec::new(), skeleton: None, vertices, attempts: 1 })
    }
}
