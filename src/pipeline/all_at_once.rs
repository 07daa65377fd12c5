//! The pipelines that have all sites from the start.

use super::attempts::Settled;
use super::{Clock, exact, rtf};
use crate::Result;
use crate::gpu::Device;
use crate::mesh::spacing;
use crate::mesh::topology::Topology;
use crate::options::{Method, Options};
use crate::stages::seed;
use crate::stages::surface::Surface;
use crate::watch::Watch;

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
}
