//! The default pipeline: few sites first, then a new one at the middle of every edge, until there are as many as asked
//! for. Regularity that few sites find cheaply stays, because middles of edges have six neighbours each.

use super::level::{Level, Moves, Relaxed};
use super::refine::{level_counts, refine};
use super::{Clock, Connection};
use crate::gpu::Device;
use crate::mesh::quality::TriangleQuality;
use crate::mesh::topology::{Topology, topology};
use crate::options::Options;
use crate::polish::{FitOptions, PolishOptions, Target, fit, polish, reach_tips};
use crate::stages::cells::{CellSites, CellSurface, connected_cells};
use crate::stages::connect::{ConnectCounts, connect};
use crate::stages::face::FlagCounts;
use crate::stages::place::Place;
use crate::stages::records::TriangleRecords;
use crate::stages::seed::{self, Seeds};
use crate::stages::surface::Surface;
use crate::{Progress, Result, TriMesh};

/// What all levels share.
pub(super) struct CoarseToFine<'a> {
    pub device: &'a Device,
    pub surface: &'a Surface,
    pub ground: &'a Ground,
    pub input: &'a Topology,
    pub options: &'a Options,
}

/// The surface in the forms that the walk and the polish need.
pub(super) struct Ground {
    records: TriangleRecords,
    mesh: TriMesh,
    target: Target,
}

impl Ground {
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if the surface does not fit on the device.
    pub fn new(device: &Device, surface: &Surface) -> Result<Self> {
        let mesh = TriMesh { vertices: surface.vertices.clone(), triangles: surface.triangles.clone() };
        let (records, target) = rayon::join(|| TriangleRecords::new(device, surface), || Target::new(&mesh));
        Ok(Self { records: records?, mesh, target })
    }
}

/// A level's mesh in the unit-diagonal frame.
struct Found {
    mesh: TriMesh,
    under: Vec<u32>,
    counts: ConnectCounts,
    sound: bool,
    insecure: usize,
    steps: Vec<f64>,
}

impl CoarseToFine<'_> {
    /// The connected sites, and the root mean square step of every iteration of the last level, in its spacings.
    pub fn run(
        &self,
        progress: &mut dyn FnMut(Progress),
        clock: &mut Clock,
    ) -> Result<(Connection, Vec<f64>)> {
        let options = self.options;
        let counts = level_counts(options.vertices, self.input.euler, options.coarsest);
        let on = CellSurface::new(&self.surface.vertices, &self.surface.triangles, &self.surface.normals);
        let mut total = 0;
        let mut planned: u32 = (0..counts.len()).map(|l| self.iterations(counts.len(), l, l == 0)).sum();
        let mut coarser: Option<Found> = None;
        for (l, count) in counts.iter().enumerate() {
            let fresh = coarser.is_none();
            let iterations = self.iterations(counts.len(), l, fresh);
            let seeds = match coarser.take() {
                Some(found) => refine(&found.mesh, &found.under, *count),
                None => seed::stratified(self.surface, *count, options.seed),
            };
            planned = planned.max(total + iterations);
            let mut show = |done: u32, step: f64| {
                progress(Progress { iteration: total + done, iterations: planned, step });
            };
            let moves = if fresh { Moves::SCATTERED } else { Moves::REFINED };
            let mut found = self.level(&on, &seeds, (iterations, moves), &mut show)?;
            clock.phase(if l + 1 == counts.len() { "last level" } else { "coarse levels" });
            total += found.steps.len() as u32;
            if l + 1 == counts.len() {
                self.finish(&mut found.mesh, clock);
                let flags = FlagCounts { security_missed: found.insecure, ..Default::default() };
                let TriMesh { vertices: sites, triangles } = found.mesh;
                return Ok((Connection { sites, triangles, counts: found.counts, flags }, found.steps));
            }
            // Too few sites for the thin parts: what they got wrong would stay wrong.
            coarser = found.sound.then_some(found);
            if coarser.is_none() {
                planned +=
                    self.iterations(counts.len(), l + 1, true) - self.iterations(counts.len(), l + 1, false);
            }
        }
        Err(crate::Error::Internal("no level was run".to_owned()))
    }

    /// Iterations of level `l` of `levels`; one that starts from scattered sites takes as many as the coarsest.
    fn iterations(&self, levels: usize, l: usize, fresh: bool) -> u32 {
        let from_end = levels - 1 - l;
        let refined = if from_end == 0 { self.options.iterations } else { self.options.coarse_iterations };
        if fresh { self.options.first_iterations.max(refined) } else { refined }
    }

    /// Better triangles and a closer fit.
    fn finish(&self, mesh: &mut TriMesh, clock: &mut Clock) {
        let target = &self.ground.target;
        let rounds = self.options.polish_rounds;
        polish(mesh, target, &PolishOptions { rounds, ..Default::default() });
        clock.phase("polish");
        let fixed = if rounds > 0 { self.hold_tips(mesh, target) } else { Vec::new() };
        clock.phase("tips");
        if self.options.fit {
            fit(mesh, target, &FitOptions { fixed, ..Default::default() });
            clock.phase("fit");
        }
    }

    /// Puts vertices on tips; says which ones, so that they stay there.
    fn hold_tips(&self, mesh: &mut TriMesh, target: &Target) -> Vec<bool> {
        let edge = super::spacing(self.surface.area(), mesh.vertices.len());
        let mut options = PolishOptions { rounds: TIP_ROUNDS, ..Default::default() };
        options.fixed = vec![false; mesh.vertices.len()];
        for _ in 0..TIP_PASSES {
            let moved = reach_tips(mesh, &self.ground.mesh, edge);
            options.fixed.iter_mut().zip(moved).for_each(|(fixed, moved)| *fixed |= moved);
            polish(mesh, target, &options);
        }
        // Where no room could be made, good triangles are worth more.
        for t in 0..mesh.triangles.len() {
            let shape = TriangleQuality::new(mesh.corners(t));
            if shape.min_angle() < TIP_ANGLE || shape.max_angle() > 90.0 {
                mesh.triangles[t].iter().for_each(|v| options.fixed[*v as usize] = false);
            }
        }
        polish(mesh, target, &options);
        options.fixed
    }

    fn level(
        &self,
        on: &CellSurface,
        seeds: &Seeds,
        (iterations, moves): (u32, Moves),
        progress: &mut dyn FnMut(u32, f64),
    ) -> Result<Found> {
        let spacing = super::spacing(self.surface.area(), seeds.sites.len());
        let level = Level::new(self.device, seeds, spacing, iterations, moves)?;
        let Relaxed { sites, triangles: under, near, steps, insecure } =
            level.relax(self.device, seeds, &self.ground.records, self.options.tolerance, progress)?;
        let places = Place::inside(&under);
        let cells =
            connected_cells(on, &CellSites { positions: &sites, places: &places, near: &near, spacing });
        let (triangles, counts) = connect(&sites, &cells.fans);
        let mesh = TriMesh { vertices: sites, triangles };
        let got = topology(&mesh);
        let sound = (got.euler, got.components) == (self.input.euler, self.input.components)
            && got.vertices == mesh.vertices.len();
        let counts = ConnectCounts { cells: Some(cells.certificate), ..counts };
        Ok(Found { mesh, under, counts, sound, insecure, steps })
    }
}

/// Times that vertices go to tips and the others make room, and the rounds that this takes.
const TIP_PASSES: u32 = 2;
const TIP_ROUNDS: u32 = 3;
/// Angle in degrees that triangles at a tip must have after that.
const TIP_ANGLE: f64 = 38.0;
