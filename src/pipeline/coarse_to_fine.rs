//! The default pipeline: few sites first, then a new one at the middle of every edge, until there are as many as asked
//! for. Regularity that few sites find cheaply stays, because middles of edges have six neighbours each.

use super::level::{Level, Moves, Relaxed, Start};
use super::plan::{Extent, LevelPlan, levels};
use super::refine::{Coarser, HeldSites, refine};
use super::{Clock, Connection, SkeletonSummary};
use crate::gpu::{Device, NONE};
use crate::mesh::quality::TriangleQuality;
use crate::mesh::skeleton::{SkeletonOptions, skeleton};
use crate::mesh::topology::{Topology, topology};
use crate::options::Options;
use crate::polish::{FitOptions, PolishOptions, Target, fit, polish, reach_tips};
use crate::stages::cells::{CellSites, CellSurface, connected_cells};
use crate::stages::connect::{ConnectCounts, connect};
use crate::stages::curve_room::CurveRoom;
use crate::stages::curve_sites::CurveSites;
use crate::stages::face::FlagCounts;
use crate::stages::pins::PinnedSites;
use crate::stages::place::Place;
use crate::stages::records::TriangleRecords;
use crate::stages::seed;
use crate::stages::surface::Surface;
use crate::stages::surface_curves::SurfaceCurves;
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
    pub(super) records: TriangleRecords,
    mesh: TriMesh,
    target: Target,
    pub(super) curves: Option<SurfaceCurves>,
    pub skeleton: SkeletonSummary,
}

impl Ground {
    /// `options` are for the surface in the unit-diagonal frame.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if the surface does not fit on the device; what [`skeleton`] finds wrong.
    pub fn new(device: &Device, surface: &Surface, options: &SkeletonOptions) -> Result<Self> {
        let mesh = TriMesh { vertices: surface.vertices.clone(), triangles: surface.triangles.clone() };
        let held = || -> Result<_> {
            let found = skeleton(&mesh, options)?;
            let curves = SurfaceCurves::new(&mesh.vertices, &mesh.triangles, &found);
            Ok((TriangleRecords::new(device, surface, curves.as_ref())?, curves, SkeletonSummary::of(&found)))
        };
        let (held, target) = rayon::join(held, || Target::new(&mesh));
        let (records, curves, skeleton) = held?;
        Ok(Self { records, mesh, target, curves, skeleton })
    }
}

/// A level's mesh in the unit-diagonal frame.
pub(super) struct Found {
    mesh: TriMesh,
    under: Vec<u32>,
    held: Option<Held>,
    counts: ConnectCounts,
    sound: bool,
    insecure: usize,
    steps: Vec<f64>,
}

/// The curve sites of a level.
pub(super) struct Held {
    sites: CurveSites,
    /// Which of them each site is, [`NONE`] for an interior one.
    pub pins: Vec<u32>,
}

impl Held {
    /// Of each site, whether it is on a curve.
    fn on_curve(&self) -> Vec<bool> {
        self.pins.iter().map(|pin| *pin != NONE).collect()
    }
}

impl CoarseToFine<'_> {
    /// The connected sites, and the root mean square step of every iteration of the last level, in its spacings.
    pub fn run(
        &self,
        progress: &mut dyn FnMut(Progress),
        clock: &mut Clock,
    ) -> Result<(Connection, Vec<f64>)> {
        let options = self.options;
        let curves = self.ground.curves.as_ref();
        let extent = Extent { area: self.surface.area(), euler: self.input.euler, curves };
        let plans = levels(&extent, options.vertices, options.coarsest)?;
        let mut on = CellSurface::new(&self.surface.vertices, &self.surface.triangles, &self.surface.normals);
        if let Some(curves) = curves {
            on = on.cut_along(&curves.on_curve, &curves.patches);
        }
        let mut total = 0;
        let mut planned: u32 = (0..plans.len()).map(|l| self.iterations(plans.len(), l, l == 0)).sum();
        let mut coarser: Option<Found> = None;
        for (l, plan) in plans.iter().enumerate() {
            let fresh = coarser.is_none();
            let iterations = self.iterations(plans.len(), l, fresh);
            let (start, held) = self.start(coarser.take(), plan);
            planned = planned.max(total + iterations);
            let mut show = |done: u32, step: f64| {
                progress(Progress { iteration: total + done, iterations: planned, step });
            };
            let moves = if fresh { Moves::SCATTERED } else { Moves::REFINED };
            let mut found = self.level(&on, &start, held, (plan.spacing, iterations, moves), &mut show)?;
            clock.phase(if l + 1 == plans.len() { "last level" } else { "coarse levels" });
            total += found.steps.len() as u32;
            if l + 1 == plans.len() {
                let on_curve = found.held.as_ref().map_or_else(Vec::new, Held::on_curve);
                self.finish(&mut found.mesh, &on_curve, clock);
                let flags = FlagCounts { security_missed: found.insecure, ..Default::default() };
                let TriMesh { vertices: sites, triangles } = found.mesh;
                let curve_sites = found.held.map_or(0, |held| held.sites.positions.len());
                let counts = found.counts;
                return Ok((Connection { sites, triangles, curve_sites, counts, flags }, found.steps));
            }
            // Too few sites for the thin parts: what they got wrong would stay wrong.
            coarser = found.sound.then_some(found);
            if coarser.is_none() {
                planned +=
                    self.iterations(plans.len(), l + 1, true) - self.iterations(plans.len(), l + 1, false);
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

    /// Better triangles and a closer fit. Vertices `on_curve` stay; beyond the end of the list none is.
    fn finish(&self, mesh: &mut TriMesh, on_curve: &[bool], clock: &mut Clock) {
        let target = &self.ground.target;
        let rounds = self.options.polish_rounds;
        polish(mesh, target, &PolishOptions { rounds, fixed: on_curve.to_vec(), ..Default::default() });
        clock.phase("polish");
        let fixed = if rounds > 0 { self.hold_tips(mesh, on_curve, target) } else { on_curve.to_vec() };
        clock.phase("tips");
        if self.options.fit {
            fit(mesh, target, &FitOptions { fixed, ..Default::default() });
            clock.phase("fit");
        }
    }

    /// Puts vertices on tips; says which ones, so that they stay there.
    fn hold_tips(&self, mesh: &mut TriMesh, on_curve: &[bool], target: &Target) -> Vec<bool> {
        let edge = super::spacing(self.surface.area(), mesh.vertices.len());
        let mut options = PolishOptions { rounds: TIP_ROUNDS, ..Default::default() };
        options.fixed = on_curve.to_vec();
        options.fixed.resize(mesh.vertices.len(), false);
        let held = |v: usize| on_curve.get(v).copied().unwrap_or(false);
        for _ in 0..TIP_PASSES {
            let before = mesh.vertices.clone();
            let moved = reach_tips(mesh, &self.ground.mesh, edge);
            (0..before.len()).filter(|v| held(*v)).for_each(|v| mesh.vertices[v] = before[v]);
            options.fixed.iter_mut().zip(moved).for_each(|(fixed, moved)| *fixed |= moved);
            polish(mesh, target, &options);
        }
        // Where no room could be made, good triangles are worth more.
        for t in 0..mesh.triangles.len() {
            let shape = TriangleQuality::new(mesh.corners(t));
            if shape.min_angle() < TIP_ANGLE || shape.max_angle() > 90.0 {
                mesh.triangles[t].iter().for_each(|v| options.fixed[*v as usize] = held(*v as usize));
            }
        }
        polish(mesh, target, &options);
        options.fixed
    }

    /// The sites of a level, from the coarser one if that was sound.
    pub(super) fn start(&self, coarser: Option<Found>, plan: &LevelPlan) -> (Start, Option<Held>) {
        let Some(curves) = &self.ground.curves else {
            let seeds = match &coarser {
                Some(Found { mesh, under, .. }) => {
                    refine(&Coarser { mesh, under, held: None }, plan.interior)
                }
                None => seed::stratified(self.surface, plan.interior, self.options.seed),
            };
            return (Start { seeds, pinned: None }, None);
        };
        // They stand anew at every level: where the coarser ones were is no place for the finer.
        let sites = curves.sites(plan.spacing);
        let room = CurveRoom::new(curves, &sites, plan.spacing);
        let seeds = match &coarser {
            Some(Found { mesh, under, held: Some(held), .. }) => {
                let held = HeldSites { curves, sites: &held.sites, pins: &held.pins, room: &room };
                refine(&Coarser { mesh, under, held: Some(held) }, plan.interior)
            }
            _ => room.scattered(self.surface, plan.interior, self.options.seed),
        };
        let (seeds, pins) = sites.merge(curves, seeds);
        let spacing = plan.spacing;
        let pinned = PinnedSites::new(curves, &self.surface.normals, &seeds, (&sites, &pins), spacing);
        (Start { seeds, pinned: Some(pinned) }, Some(Held { sites, pins }))
    }

    fn level(
        &self,
        on: &CellSurface,
        start: &Start,
        held: Option<Held>,
        (spacing, iterations, moves): (f64, u32, Moves),
        progress: &mut dyn FnMut(u32, f64),
    ) -> Result<Found> {
        let level = Level::new(self.device, start, spacing, iterations, moves)?;
        let Relaxed { mut sites, triangles: under, near, steps, insecure } =
            level.relax(self.device, start, &self.ground.records, self.options.tolerance, progress)?;
        let mut places = Place::inside(&under);
        if let Some(Held { sites: on_curves, pins }) = &held {
            for (i, pin) in pins.iter().enumerate().filter(|(_, pin)| **pin != NONE) {
                places[i] = on_curves.places[*pin as usize];
                // Exactly where it was put, and not where the nearest number of 32 bits is.
                sites[i] = on_curves.positions[*pin as usize];
            }
        }
        let cells =
            connected_cells(on, &CellSites { positions: &sites, places: &places, near: &near, spacing });
        let (triangles, counts) = connect(&sites, &cells.fans);
        let mesh = TriMesh { vertices: sites, triangles };
        let got = topology(&mesh);
        let is = |t: &Topology| (t.euler, t.components, t.boundary_loops);
        let sound = is(&got) == is(self.input) && got.vertices == mesh.vertices.len();
        let counts = ConnectCounts { cells: Some(cells.certificate), ..counts };
        Ok(Found { mesh, under, held, counts, sound, insecure, steps })
    }
}

/// Times that vertices go to tips and the others make room, and the rounds that this takes.
const TIP_PASSES: u32 = 2;
const TIP_ROUNDS: u32 = 3;
/// Angle in degrees that triangles at a tip must have after that.
const TIP_ANGLE: f64 = 38.0;
