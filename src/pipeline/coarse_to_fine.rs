//! The default pipeline: few sites first, then a new one at the middle of every edge, until there are as many as asked
//! for. Regularity that few sites find cheaply stays, because middles of edges have six neighbours each.

use super::holes::holes;
use super::level::{Level, Moves, Relaxed, Start};
use super::plan::{Extent, LevelPlan, levels};
use super::refine::{Coarser, HeldSites, refine};
use super::{Clock, Connection, SkeletonSummary};
use crate::gpu::{Device, NONE};
use crate::mesh::coarsen::Site;
use crate::mesh::skeleton::{SkeletonOptions, skeleton};
use crate::mesh::topology::{Topology, topology};
use crate::options::Options;
use crate::polish::{FitOptions, PolishOptions, SpotOptions, Target, fit, polish, reach_spots};
use crate::stages::cells::{CellSites, CellSurface, connected_cells};
use crate::stages::connect::{ConnectCounts, connect};
use crate::stages::curve_room::CurveRoom;
use crate::stages::curve_sites::CurveSites;
use crate::stages::face::FlagCounts;
use crate::stages::pins::PinnedSites;
use crate::stages::place::Place;
use crate::stages::records::TriangleRecords;
use crate::stages::seed::{self, Seeds};
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
        let patches = curves.as_ref().map_or_else(Vec::new, |curves| curves.patches.clone());
        let target = target.in_patches(patches);
        Ok(Self { records, target, curves, skeleton })
    }
}

/// A level's mesh in the unit-diagonal frame.
pub(super) struct Found {
    mesh: TriMesh,
    under: Vec<u32>,
    held: Option<Held>,
    counts: ConnectCounts,
    sound: bool,
    open: usize,
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
            let mut found = loop {
                let fresh = coarser.is_none();
                let iterations = self.iterations(plans.len(), l, fresh);
                let (start, held) = self.start(coarser.take(), plan);
                planned = planned.max(total + iterations);
                let mut show = |done: u32, step: f64| {
                    progress(Progress { iteration: total + done, iterations: planned, step });
                };
                let moves = if fresh { Moves::SCATTERED } else { Moves::REFINED };
                let found = self.level(&on, &start, held, (plan.spacing, iterations, moves), &mut show)?;
                clock.phase(if l + 1 == plans.len() { "last level" } else { "coarse levels" });
                total += found.steps.len() as u32;
                // Once more from scattered sites, if it was for those of the coarser level.
                if found.sound || fresh {
                    break found;
                }
            };
            if l + 1 == plans.len() {
                let sites = found.mesh.vertices.iter().zip(&found.under);
                let on_surface = sites.map(|(at, triangle)| Site { at: *at, triangle: *triangle }).collect();
                self.finish(&mut found, clock);
                let flags = FlagCounts { unbounded: found.open, ..Default::default() };
                let curve_sites = found.held.map_or(0, |held| held.sites.positions.len());
                let Found { mesh, counts, .. } = found;
                let connection = Connection { mesh, on_surface, curve_sites, counts, flags, collapsed: 0 };
                return Ok((connection, found.steps));
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

    /// Sites for the next level, with some where the coarser one's mesh ran past the surface.
    fn refined(&self, coarser: &Coarser, plan: &LevelPlan) -> Seeds {
        let seeds = refine(coarser, plan.interior);
        let missed = holes(&seeds, &self.surface.vertices, &self.surface.triangles, plan.spacing);
        if missed.sites.is_empty() {
            return seeds;
        }
        let mut seeds = refine(coarser, plan.interior - missed.sites.len());
        seeds.sites.extend(missed.sites);
        seeds.triangles.extend(missed.triangles);
        seeds.in_space_order()
    }

    /// Iterations of level `l` of `levels`; one that starts from scattered sites takes as many as the coarsest.
    fn iterations(&self, levels: usize, l: usize, fresh: bool) -> u32 {
        let from_end = levels - 1 - l;
        let refined = if from_end == 0 { self.options.iterations } else { self.options.coarse_iterations };
        if fresh { self.options.first_iterations.max(refined) } else { refined }
    }

    /// Better triangles and a closer fit. Vertices on curves stay.
    fn finish(&self, found: &mut Found, clock: &mut Clock) {
        let target = &self.ground.target;
        let fixed = found.held.as_ref().map_or_else(Vec::new, Held::on_curve);
        let patches = self.patches(found, &fixed);
        let mesh = &mut found.mesh;
        let rounds = self.options.polish_rounds;
        let options = PolishOptions { rounds, fixed, patches, ..Default::default() };
        polish(mesh, target, &options);
        clock.phase("polish");
        let PolishOptions { fixed, patches, .. } = options;
        if self.options.fit {
            let options = FitOptions { fixed, patches, ..Default::default() };
            fit(mesh, target, &options);
            clock.phase("fit");
            let FitOptions { fixed, patches, .. } = options;
            let edge = super::spacing(self.surface.area(), mesh.vertices.len());
            reach_spots(mesh, target, edge, &SpotOptions { fixed, patches, ..Default::default() });
            clock.phase("spots");
        }
    }

    /// The patch of every triangle of a mesh, [`NONE`] where all corners are on curves; nothing if there are none.
    fn patches(&self, found: &Found, on_curve: &[bool]) -> Vec<u32> {
        let Some(curves) = &self.ground.curves else { return Vec::new() };
        let of = |triangle: &[u32; 3]| {
            let inner = triangle.iter().find(|v| !on_curve[**v as usize]);
            inner.map_or(NONE, |v| curves.patches[found.under[*v as usize] as usize])
        };
        found.mesh.triangles.iter().map(of).collect()
    }

    /// The sites of a level, from the coarser one if that was sound.
    pub(super) fn start(&self, coarser: Option<Found>, plan: &LevelPlan) -> (Start, Option<Held>) {
        let Some(curves) = &self.ground.curves else {
            let seeds = match &coarser {
                Some(Found { mesh, under, .. }) => self.refined(&Coarser { mesh, under, held: None }, plan),
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
        let Relaxed { mut sites, triangles: under, near, steps, open } =
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
        Ok(Found { mesh, under, held, counts, sound, open, steps })
    }
}
