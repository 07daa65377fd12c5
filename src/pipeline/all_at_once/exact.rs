//! All sites from the start, with exact faces: restricted Voronoi cells on the surface itself, and Lloyd's
//! iteration with or without momentum, or L-BFGS.

use super::descent::Descent;
use crate::gpu::{Buffer, Device, Recorder};
use crate::mesh::bvh::Bvh;
use crate::mesh::topology::Topology;
use crate::options::Options;
use crate::pipeline::near_sites::{LIST, near_sites};
use crate::pipeline::outcome::{Fault, Outcome};
use crate::pipeline::result::ExactSummary;
use crate::pipeline::submission::require_moves;
use crate::progress::ProgressReporter;
use crate::sites::cells::{CellSites, CellSurface, connected_cells};
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::sites::surface::Surface;
use crate::stages::exact::{Aim, CutTriangles, ExactCells, ExactCounts};
use crate::stages::neighbours::lists::{ListOptions, Lists};
use crate::stages::step::Step;
use crate::{Result, TriMesh};
use glam::{DVec3, Vec2, Vec4};
use rayon::prelude::*;

/// Lists are built again when a site has moved by more than this fraction of its reach. That is cheap
/// compared with a search for every triangle that the lists do not decide.
const MAX_RHO: f32 = 0.03;
/// Longest move with momentum, in spacings. Without momentum, sites move to their centroids.
const LARGEST_MOVE: f64 = 0.5;

/// The stages of a run with their buffers.
pub(crate) struct ExactRun<'a> {
    device: &'a Device,
    options: &'a Options,
    spacing: f64,
    triangles: CutTriangles,
    sites: Buffer<Vec4>,
    lists: Lists,
    cells: ExactCells,
    aim: Aim,
    step: Step,
    /// With L-BFGS, in place of both.
    descent: Option<Descent>,
}

impl<'a> ExactRun<'a> {
    /// # Errors
    /// Those of the device.
    pub fn new(
        device: &'a Device,
        options: &'a Options,
        surface: &Surface,
        seeds: &SitesOnSurface,
        spacing: f64,
    ) -> Result<Self> {
        let n = seeds.len();
        let sites: Vec<Vec4> = seeds.positions.iter().map(|p| p.as_vec3().extend(0.0)).collect();
        let triangles = CutTriangles::new(device, surface, spacing)?;
        Ok(Self {
            cells: ExactCells::new(device, &triangles, &seeds.positions, LIST, None, None)?,
            triangles,
            device,
            options,
            spacing,
            sites: Buffer::from_slice(device, "exact.sites", &sites)?,
            lists: Lists::new(device, n, &ListOptions::new(LIST))?,
            aim: Aim::new(device, n, None)?,
            step: Step::new(device, n, options.iterations, None)?,
            descent: (options.all_at_once.lbfgs > 0)
                .then(|| Descent::new(sites, spacing, options.all_at_once.lbfgs)),
        })
    }

    /// Moves the sites until they rest; returns the root mean square step of each iteration, in spacings, and
    /// figures of the last cells.
    ///
    /// # Errors
    /// Those of the device, and [`crate::Error::Cancelled`].
    pub fn iterate(
        &mut self,
        surface: &Surface,
        progress: &mut ProgressReporter,
    ) -> Result<(Vec<f64>, ExactSummary)> {
        let options = self.options;
        let mut steps = Vec::new();
        let mut summary = ExactSummary::default();
        let mut recorder = Recorder::new(self.device)?;
        self.step.record_begin(&mut recorder)?;
        self.lists.record_build(&mut recorder, &self.sites)?;
        recorder.submit()?;
        for iteration in 0..options.iterations {
            let (counts, step) = self.iteration(iteration)?;
            summary.pairs = counts.pairs;
            summary.crowded += counts.crowded;
            steps.push(step);
            progress.iterated(iteration + 1, options.iterations, step)?;
            let last = iteration + 1 == options.iterations;
            if step < options.tolerance || (!last && progress.leave_out()) {
                break;
            }
        }
        require_moves(self.device, &steps)?;
        if let Some(descent) = &self.descent {
            self.sites.write(self.device, &descent.final_sites())?;
        }
        let cells = self.cells.cells.to_vec(self.device)?;
        if !steps.is_empty() {
            summary.area = cells.iter().map(|c| f64::from(c.w)).sum::<f64>() / surface.area();
            summary.empty_cells = cells.iter().filter(|c| c.w <= 0.0).count();
        }
        Ok((steps, summary))
    }

    /// Lists → parts → cells → aim → step, or L-BFGS in place of the last two; returns the root mean square
    /// step.
    fn iteration(&mut self, iteration: u32) -> Result<(ExactCounts, f64)> {
        let mut recorder = Recorder::new(self.device)?;
        self.lists.record_refresh(&mut recorder, &self.sites, MAX_RHO)?;
        let parts = self.cells.record_parts(&mut recorder, &self.triangles, &self.sites, &self.lists)?;
        let downloads = recorder.submit()?;
        let mut recorder = Recorder::new(self.device)?;
        let (on, sites) = (&self.triangles, &self.sites);
        let counts = self.cells.record_cells(self.device, &mut recorder, on, sites, (&downloads, &parts))?;
        if self.descent.is_some() {
            return Ok((counts, self.descend(recorder)?));
        }
        let (momentum, largest) = self.motion(iteration);
        self.aim.record(&mut recorder, sites, &self.cells, momentum, largest)?;
        self.step.record(&mut recorder, &self.aim.targets, sites, iteration)?;
        let history = recorder.download(&self.step.history)?;
        let history: Vec<Vec2> = recorder.submit()?.read(&history)?;
        Ok((counts, f64::from(history[iteration as usize].x) / self.spacing))
    }

    /// The rest of an iteration with L-BFGS; returns the root mean square distance to the centroids.
    fn descend(&mut self, mut recorder: Recorder) -> Result<f64> {
        let cells = recorder.download(&self.cells.cells)?;
        let energies = recorder.download(&self.cells.energies)?;
        let downloads = recorder.submit()?;
        let (cells, energies): (Vec<Vec4>, Vec<f32>) = (downloads.read(&cells)?, downloads.read(&energies)?);
        let Some(descent) = &mut self.descent else { return Ok(0.0) };
        let trial = descent.next_trial(&cells, &energies).to_vec();
        let distance = descent.distance_to_centroids() / self.spacing;
        self.sites.write(self.device, &trial)?;
        Ok(distance)
    }

    /// The momentum of an iteration, and its longest move.
    fn motion(&self, iteration: u32) -> (f32, f32) {
        if self.options.all_at_once.momentum == 0.0 {
            // The surface's diagonal is 1.
            return (0.0, 1.0);
        }
        // Nesterov's sequence; the last iteration is a plain one, so that sites end in their centroids.
        let share = f64::from(iteration) / (f64::from(iteration) + 3.0);
        let last = iteration + 1 == self.options.iterations;
        let momentum = if last { 0.0 } else { share.min(self.options.all_at_once.momentum) };
        (momentum as f32, (LARGEST_MOVE * self.spacing) as f32)
    }

    /// The dual of the connected cells. The vertices are the sites, which are slightly off the surface; the
    /// cells start at the closest points.
    ///
    /// # Errors
    /// Those of the device.
    pub fn connect(
        &self,
        surface: &Surface,
        input: &Topology,
        progress: &mut ProgressReporter,
    ) -> Result<Outcome> {
        let positions: Vec<DVec3> =
            self.sites.to_vec(self.device)?.iter().map(|s: &Vec4| s.truncate().as_dvec3()).collect();
        let triangles = closest_triangles(surface, &positions);
        let sites = SitesOnSurface { positions, triangles };
        connect_exact_cells(self.device, surface, input, sites, self.spacing, progress)
    }
}

/// The triangles closest to `sites`.
fn closest_triangles(surface: &Surface, sites: &[DVec3]) -> Vec<u32> {
    let bvh = Bvh::new(&surface.mesh());
    let closest = |rank: &mut _, p: &DVec3| bvh.closest_from(*p, rank).map_or(0, |closest| closest.triangle);
    sites.par_iter().map_init(|| 0, closest).collect()
}

/// The dual of the exact connected cells of `sites`, compared with the topology of the input.
pub(crate) fn connect_exact_cells(
    device: &Device,
    surface: &Surface,
    input: &Topology,
    sites: SitesOnSurface,
    spacing: f64,
    progress: &mut ProgressReporter,
) -> Result<Outcome> {
    let near = near_sites(device, &sites.positions)?;
    let on = CellSurface::new(&surface.vertices, &surface.triangles, &surface.normals);
    let places = Place::inside(&sites.triangles);
    let of = CellSites { positions: &sites.positions, places: &places, near: &near, spacing, lengths: &[] };
    let cells = progress.during(|progress| connected_cells(&on, &of, progress))?;
    let (triangles, counts) = cells.connect(&sites.positions);
    let mesh = TriMesh { vertices: sites.positions, triangles };
    Ok(Outcome {
        fault: Fault::topology(&mesh, input, cells.broken.first().map(|broken| broken.farthest.0)),
        mesh,
        counts,
        ..Outcome::default()
    })
}
