//! The default pipeline: few sites first, then a new one at the middle of every edge, until there are as many
//! as asked for. Regularity that few sites find cheaply stays, because middles of edges have six neighbours
//! each.

pub(crate) mod attempts;
pub(crate) mod connect;
#[cfg(test)]
pub(crate) mod curve_tests;
pub(crate) mod densify;
pub(crate) mod level;
pub(crate) mod levels;
pub(crate) mod refine;
pub(crate) mod size_field;
pub(crate) mod uncovered;

use super::cost::{AttemptCost, FEW_ITERATIONS, LevelWork};
use super::{Clock, Connection, FeatureSummary};
use crate::gpu::Device;
use crate::mesh::features::{FeatureOptions, find_features};
use crate::mesh::sizing::SizeField;
use crate::mesh::topology::Topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Options;
use crate::polish::Target;
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::cells::CellSurface;
use crate::sites::curve_clearance::CurveClearance;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::seed;
use crate::sites::surface::Surface;
use crate::sites::surface_curves::SurfaceCurves;
use crate::stages::flags::FlagCounts;
use crate::stages::pins::PinnedSites;
use crate::stages::records::TriangleRecords;
use crate::stages::sizing::DeviceSizes;
use crate::{Phase, Result, TriMesh};
use connect::{Found, Held, LevelSites};
use level::{DeviceSurface, Level, Moves, Relaxed, Start};
use levels::{Extent, LevelPlan, levels};
use refine::{Coarser, CoarserCurves, refine};
use std::sync::OnceLock;
use uncovered::sites_for_uncovered;

/// What all levels share.
pub(crate) struct CoarseToFine<'a> {
    pub device: &'a Device,
    pub surface: &'a Surface,
    pub ground: &'a Ground,
    /// The repaired input and what moves it into the unit-diagonal frame of the surface.
    pub mesh: &'a TriMesh,
    pub frame: &'a UnitFrame,
    pub input: &'a Topology,
    /// Faces of the input that run through others, once somebody asked.
    pub crossing: &'a OnceLock<usize>,
    pub options: &'a Options,
}

/// What a level begins with.
pub(crate) enum Origin {
    /// Scattered sites.
    Nothing,
    /// A coarser level, whose edges get sites at their middles.
    Coarser(Found),
    /// The same level, to go on with.
    Level(Found),
}

/// The surface in the forms that the walk and the polish need.
pub(crate) struct Ground {
    pub(crate) records: TriangleRecords,
    pub(crate) target: Target,
    pub(crate) curves: Option<SurfaceCurves>,
    /// How long edges should be.
    pub(crate) sizes: SizeField,
    device_sizes: Option<DeviceSizes>,
    pub skeleton: FeatureSummary,
}

impl Ground {
    /// `options` are for the surface in the unit-diagonal frame; `sized` makes the edge lengths, once the
    /// curves are known.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if the surface does not fit on the device; what [`skeleton`] and `sized`
    /// find wrong; [`crate::Error::Cancelled`].
    pub fn new(
        device: &Device,
        surface: &Surface,
        options: &FeatureOptions,
        sized: impl Fn(Option<&SurfaceCurves>) -> Result<SizeField> + Sync,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let mesh = surface.mesh();
        let held = || -> Result<_> {
            let found = find_features(&mesh, options)?;
            progress.poll()?;
            let curves = SurfaceCurves::new(&mesh.vertices, &mesh.triangles, &found);
            let sizes = sized(curves.as_ref())?;
            progress.poll()?;
            let curves = curves.map(|curves| curves.sized(&sizes));
            let records = TriangleRecords::new(device, surface, curves.as_ref())?;
            let device_sizes = DeviceSizes::new(device, &sizes)?;
            Ok((records, curves, FeatureSummary::of(&found), sizes, device_sizes))
        };
        let (held, target) = rayon::join(held, || Target::new(&mesh));
        let (records, curves, skeleton, sizes, device_sizes) = held?;
        let patches = curves.as_ref().map_or_else(Vec::new, |curves| curves.patches.clone());
        let target = target.in_patches(patches);
        Ok(Self { records, target, curves, sizes, device_sizes, skeleton })
    }

    /// What sites move over.
    pub(crate) fn on_device(&self) -> DeviceSurface<'_> {
        DeviceSurface { records: &self.records, sizes: self.device_sizes.as_ref() }
    }
}

impl CoarseToFine<'_> {
    /// The connected sites, and the root mean square step of every iteration of the last level, in its
    /// spacings.
    pub fn run(&self, progress: &mut ProgressReporter, clock: &mut Clock) -> Result<(Connection, Vec<f64>)> {
        let options = self.options;
        let curves = self.ground.curves.as_ref();
        let extent = Extent { area: self.surface.area(), euler: self.input.euler, curves };
        let plans = levels(&extent, options.vertices, options.coarse_to_fine.coarsest)?;
        let mut on = CellSurface::new(&self.surface.vertices, &self.surface.triangles, &self.surface.normals);
        if let Some(curves) = curves {
            on = on.cut_along(&curves.on_curve, &curves.patches);
        }
        let mut total = 0;
        let iterations = |l: usize| self.iterations(plans.len(), l, l == 0);
        let work =
            |(l, plan): (usize, &LevelPlan)| LevelWork { sites: plan.sites, iterations: iterations(l) };
        let work: Vec<LevelWork> = plans.iter().enumerate().map(work).collect();
        let cost = AttemptCost::new(&work, self.surface.triangles.len(), options);
        progress.phase(Phase::Prepare, cost.prepared, 0.0)?;
        let mut planned: u32 = work.iter().map(|level| level.iterations).sum();
        let mut from = Origin::Nothing;
        for (l, plan) in plans.iter().enumerate() {
            let phase = if l + 1 == plans.len() { Phase::LastLevel } else { Phase::CoarseLevels };
            let found = loop {
                let fresh = matches!(from, Origin::Nothing);
                let further = matches!(from, Origin::Level(_));
                progress.phase(phase, cost.levels[l].until, cost.levels[l].after)?;
                let iterations = progress.at_most(FEW_ITERATIONS, self.iterations(plans.len(), l, fresh));
                let (start, held) = self.start(from, plan);
                planned = planned.max(total + iterations);
                progress.level(total, planned);
                let moves = if fresh { Moves::SCATTERED } else { Moves::REFINED };
                let found = self.level(&on, &start, held, (plan.spacing, iterations, moves), progress)?;
                clock.phase(phase.name());
                total += found.steps.len() as u32;
                if found.sound || fresh {
                    break found;
                }
                // In some fold a few iterations more often help, and cost less than to begin anew.
                from = if further { Origin::Nothing } else { Origin::Level(found) };
            };
            if l + 1 == plans.len() {
                let steps = found.steps.clone();
                let flags = FlagCounts { unbounded: found.open, ..Default::default() };
                let (found, fault) = self.finished(&on, found, plan.spacing, (&cost, progress, clock))?;
                let curve_sites = found.held.map_or(0, |held| held.sites.positions.len());
                let Found { mesh, rested, under, counts, crossing, .. } = found;
                let rested = rested.vertices;
                let connection = Connection {
                    mesh,
                    rested,
                    under,
                    curve_sites,
                    counts,
                    flags,
                    fault,
                    crossing,
                    edge_lengths: self.edge_lengths(plan.spacing),
                    ..Connection::default()
                };
                return Ok((connection, steps));
            }
            // Too few sites for the thin parts: what they got wrong would stay wrong.
            from = if found.sound { Origin::Coarser(found) } else { Origin::Nothing };
            if matches!(from, Origin::Nothing) {
                planned +=
                    self.iterations(plans.len(), l + 1, true) - self.iterations(plans.len(), l + 1, false);
            }
        }
        Err(crate::Error::Internal("no level was run".to_owned()))
    }

    /// The least and the largest that are wanted at this spacing, where they differ.
    fn edge_lengths(&self, spacing: f64) -> Option<[f64; 2]> {
        let sizes = &self.ground.sizes;
        (!sizes.is_uniform()).then(|| sizes.range().map(|length| length * spacing))
    }

    /// Sites for the next level, with some where the coarser one's mesh ran past the surface.
    fn refined(&self, coarser: &Coarser, plan: &LevelPlan) -> SitesOnSurface {
        let sites = refine(coarser, plan.interior);
        let more = sites_for_uncovered(&sites, self.surface, &self.ground.sizes, plan.spacing);
        if more.is_empty() {
            return sites;
        }
        let mut sites = refine(coarser, plan.interior - more.len());
        sites.append(more);
        sites.in_morton_order()
    }

    /// Iterations of level `l` of `levels`; one that starts from scattered sites takes as many as the
    /// coarsest.
    fn iterations(&self, levels: usize, l: usize, fresh: bool) -> u32 {
        let from_end = levels - 1 - l;
        let refined = if from_end == 0 {
            self.options.iterations
        } else {
            self.options.coarse_to_fine.coarse_iterations
        };
        if fresh { self.options.coarse_to_fine.first_iterations.max(refined) } else { refined }
    }

    /// The sites that a level begins with.
    pub(crate) fn start(&self, from: Origin, plan: &LevelPlan) -> (Start, Option<Held>) {
        let sizes = &self.ground.sizes;
        let Some(curves) = &self.ground.curves else {
            let seeds = match &from {
                Origin::Coarser(Found { mesh, under, .. }) => {
                    let lengths = sizes.at_all(&mesh.vertices, under);
                    self.refined(&Coarser { mesh, triangles: under, lengths, on_curves: None }, plan)
                }
                Origin::Level(found) => found.moving(),
                Origin::Nothing => seed::stratified(self.surface, sizes, plan.interior, self.options.seed),
            };
            return (Start { sites: seeds, pinned: None }, None);
        };
        // They stand anew at every level: where the coarser ones were is no place for the finer.
        let sites = curves.sites(plan.spacing);
        let clearance = CurveClearance::new(curves, &sites, plan.spacing);
        let seeds = match &from {
            Origin::Coarser(Found { mesh, under, held: Some(held), .. }) => {
                let on_curves =
                    CoarserCurves { curves, sites: &held.sites, pins: &held.pins, clearance: &clearance };
                let lengths = sizes.at_all(&mesh.vertices, under);
                let coarser = Coarser { mesh, triangles: under, lengths, on_curves: Some(on_curves) };
                refine(&coarser, plan.interior)
            }
            Origin::Level(found) => found.moving(),
            _ => clearance.scattered(self.surface, sizes, plan.interior, self.options.seed),
        };
        let (seeds, pins) = sites.merge(curves, seeds);
        let spacing = plan.spacing;
        let pinned = PinnedSites::new(curves, &self.surface.normals, &seeds, (&sites, &pins), spacing);
        (Start { sites: seeds, pinned: Some(pinned) }, Some(Held { sites, pins }))
    }

    fn level(
        &self,
        on: &CellSurface,
        start: &Start,
        held: Option<Held>,
        (spacing, iterations, moves): (f64, u32, Moves),
        progress: &mut ProgressReporter,
    ) -> Result<Found> {
        progress.poll()?;
        let level =
            Level::new(self.device, start, (spacing, !self.ground.sizes.is_uniform()), iterations, moves)?;
        let Relaxed { mut sites, near, steps, open } =
            level.relax(self.device, start, &self.ground.on_device(), self.options.tolerance, progress)?;
        if let Some(held) = &held {
            // Exactly where they were put, and not where the nearest numbers of 32 bits are.
            held.put(&mut sites.positions);
        }
        let sites = LevelSites { sites, held, near };
        Ok(Found { steps, open, ..self.connected(on, sites, spacing, progress)? })
    }
}
