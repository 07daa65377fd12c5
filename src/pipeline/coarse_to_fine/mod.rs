//! The default pipeline: few sites first, then a new one at the midpoint of every edge, until there are as
//! many as asked for. The regularity that few sites reach quickly is kept, because midpoints of edges have
//! six neighbours each.

pub(crate) mod attempts;
mod bend_lengths;
mod closer_shape;
mod coarser_features;
mod connect;
mod constraints;
#[cfg(test)]
mod curve_tests;
mod densify;
pub(crate) mod device_polish;
mod even_lengths;
mod improve;
mod insert;
pub(crate) mod level;
mod level_mesh;
pub(crate) mod levels;
mod mend;
mod near_points;
mod refine;
mod refined_lengths;
mod ridges;
mod round_facets;
mod score;
mod shared;
mod shared_edges;
mod shorter;
pub(crate) mod size_field;
pub(crate) mod surface_model;
mod uncovered;

use super::clock::Clock;
use super::cost::{AttemptCost, FEW_ITERATIONS, LevelWork};
use super::outcome::Outcome;
use super::result::FeatureSummary;
use super::small_angles::MendingCounts;
use crate::progress::ProgressReporter;
use crate::sites::cells::CellSurface;
use crate::sites::curve_clearance::CurveClearance;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::seed;
use crate::stages::pins::PinnedSites;
use crate::{Error, Phase, Result};
use improve::{Improved, Reporting};
use level::{Level, LevelOptions, Moves, Relaxed, Start};
use level_mesh::{LevelCurves, LevelMesh, LevelSites};
use levels::{Extent, LevelPlan, levels};
use refine::{Coarser, CoarserCurves, refine};
use shared::CoarseToFine;
use uncovered::sites_for_uncovered;

/// Iterations that the last level has more if there are points of the user's.
const MAKING_ROOM: u32 = 50;

/// Where the sites of a level come from.
pub(crate) enum Origin {
    /// From nowhere: they are scattered.
    Scattered,
    /// From a coarser level, whose edges get sites at their midpoints.
    Coarser(LevelMesh),
    /// From the same level, which is continued.
    Same(LevelMesh),
}

impl CoarseToFine<'_> {
    /// Runs all levels, and improves the mesh of the last one.
    ///
    /// # Errors
    /// [`Error::Usage`] if there are too few vertices for the curves, those of the device, and
    /// [`Error::Cancelled`].
    pub fn run(&self, progress: &mut ProgressReporter, clock: &mut Clock) -> Result<Outcome> {
        let options = self.context.options;
        let curves = self.model.curves.as_deref();
        let extent = Extent { area: self.context.surface.area(), euler: self.context.input.euler, curves };
        let plans = levels(&extent, self.vertices, self.context.plan.coarsest)
            .map_err(|error| self.context.plan.curves.name_borders(error))?;
        let Some(last) = plans.last() else { return Err(Error::Internal("no levels".to_owned())) };
        let mut on = CellSurface::new(
            &self.context.surface.vertices,
            &self.context.surface.triangles,
            &self.context.surface.normals,
        );
        if let Some(curves) = curves {
            on = on.cut_along(&curves.on_curve, &curves.patches);
        }
        let work = |(l, plan): (usize, &LevelPlan)| LevelWork {
            sites: plan.sites,
            iterations: self.iterations(plans.len(), l, l == 0),
        };
        let work: Vec<LevelWork> = plans.iter().enumerate().map(work).collect();
        let cost = &AttemptCost::new(&work, self.context.surface.triangles.len(), options, self.vertices);
        progress.phase(Phase::Prepare, cost.prepared, 0.0)?;
        let mut reporting = Reporting { cost, progress, clock };
        let mut level = self.run_levels(&on, &plans, &mut reporting)?;
        let steps = std::mem::take(&mut level.steps);
        let flags = level.flags;
        let ridged = self.ridged(&level);
        let mut improved = self.improve(&on, level, last.spacing, &mut reporting)?;
        if let Some(ridged) = &ridged {
            improved = self.closer(&on, (improved, ridged), last.spacing, &mut reporting)?;
        }
        let curve_sites = self.vertices_on_curves(&improved);
        let Improved { mesh, level, outliers, intersecting_faces, mended, fault, .. } = improved;
        let mesh = mesh.mesh;
        let vertices = if self.context.deviation.is_some() { mesh.vertices.len() } else { self.vertices };
        Ok(Outcome {
            mesh,
            sites: level.sites,
            counts: level.counts,
            flags,
            fault,
            intersecting_faces,
            edge_lengths: self.edge_lengths(last.spacing),
            steps,
            features: Some(FeatureSummary { curve_sites, ..self.model.features }),
            vertices,
            attempts: 1,
            outliers,
            mended: mended.as_ref().map_or_else(MendingCounts::default, MendingCounts::of),
            ..Outcome::default()
        })
    }

    /// The mesh of the last level.
    fn run_levels(
        &self,
        on: &CellSurface,
        plans: &[LevelPlan],
        reporting: &mut Reporting,
    ) -> Result<LevelMesh> {
        let Reporting { cost, progress, clock } = reporting;
        let mut total = 0;
        let mut planned: u32 = (0..plans.len()).map(|l| self.iterations(plans.len(), l, l == 0)).sum();
        let mut origin = Origin::Scattered;
        for (l, plan) in plans.iter().enumerate() {
            let is_last = l + 1 == plans.len();
            let phase = if is_last { Phase::LastLevel } else { Phase::CoarseLevels };
            let level = loop {
                let is_scattered = matches!(origin, Origin::Scattered);
                let is_continued = matches!(origin, Origin::Same(_));
                progress.phase(phase, cost.levels[l].until, cost.levels[l].after)?;
                let iterations =
                    progress.at_most(FEW_ITERATIONS, self.iterations(plans.len(), l, is_scattered));
                let (start, on_curves) = self.start(origin, plan);
                planned = planned.max(total + iterations);
                progress.level(total, planned);
                let options = LevelOptions {
                    spacing: plan.spacing,
                    has_sizes: !self.model.sizes.is_uniform(),
                    iterations,
                    moves: if is_scattered { Moves::SCATTERED } else { Moves::REFINED },
                    is_last,
                };
                let level = self.level(on, &start, on_curves, &options, progress)?;
                clock.end_phase(phase.name());
                total += level.steps.len() as u32;
                if level.is_sound || is_scattered {
                    break level;
                }
                // In folds a few more iterations often help, and cost less than a new start.
                origin = if is_continued { Origin::Scattered } else { Origin::Same(level) };
            };
            if is_last {
                return Ok(level);
            }
            // Without the input's topology there were too few sites for thin parts, and finer levels would
            // keep the errors.
            origin = if level.is_sound { Origin::Coarser(level) } else { Origin::Scattered };
            if matches!(origin, Origin::Scattered) {
                planned +=
                    self.iterations(plans.len(), l + 1, true) - self.iterations(plans.len(), l + 1, false);
            }
        }
        Err(Error::Internal("no level was run".to_owned()))
    }

    /// The smallest and the largest edge length in the size field at this spacing; `None` if all are equal.
    fn edge_lengths(&self, spacing: f64) -> Option<[f64; 2]> {
        let sizes = &self.model.sizes;
        (!sizes.is_uniform()).then(|| sizes.range().map(|length| length * spacing))
    }

    /// Sites for the next level, with some where the coarser level left the surface uncovered.
    fn refined(&self, coarser: &Coarser, plan: &LevelPlan) -> SitesOnSurface {
        let sites = refine(coarser, plan.interior);
        let more = sites_for_uncovered(&sites, self.context.surface, &self.model.sizes, plan.spacing);
        if more.is_empty() {
            return sites;
        }
        let mut sites = refine(coarser, plan.interior - more.len());
        sites.append(more);
        sites.in_morton_order()
    }

    /// Iterations of level `l` of `levels`; one with scattered sites takes as many as the coarsest.
    fn iterations(&self, levels: usize, l: usize, is_scattered: bool) -> u32 {
        let method = &self.context.options.coarse_to_fine;
        let from_end = levels - 1 - l;
        let last = self.context.options.iterations + self.more_iterations();
        let refined = if from_end == 0 { last } else { method.coarse_iterations };
        if is_scattered { method.first_iterations.max(refined) } else { refined }
    }

    /// Further iterations of the last level, where sites make room for points.
    fn more_iterations(&self) -> u32 {
        let has_points = self.model.curves.as_deref().is_some_and(|curves| !curves.points.is_empty());
        if has_points { MAKING_ROOM } else { 0 }
    }

    /// The initial sites of a level.
    pub(crate) fn start(&self, origin: Origin, plan: &LevelPlan) -> (Start, Option<LevelCurves>) {
        let sizes = &self.model.sizes;
        let lengths = |sites: &SitesOnSurface| sizes.at_all(&sites.positions, &sites.triangles);
        let Some(curves) = self.model.curves.as_deref() else {
            let sites = match &origin {
                Origin::Coarser(LevelMesh { mesh, sites, .. }) => {
                    let triangles = &sites.triangles;
                    self.refined(&Coarser { mesh, triangles, lengths: lengths(sites), on_curves: None }, plan)
                }
                Origin::Same(level) => level.interior_sites(),
                Origin::Scattered => seed::stratified(self.context.surface, sizes, plan.interior, self.seed),
            };
            return (Start { sites, pinned: None }, None);
        };
        // Curve sites are placed anew on every level, since their spacing differs.
        let (curves, curve_sites) = match plan.is_finest {
            true => (curves, curves.sites_and_points(plan.spacing)),
            false => (curves.coarse(), curves.coarse().sites(plan.spacing)),
        };
        let clearance = CurveClearance::new(curves, &curve_sites, plan.spacing);
        let interior = match &origin {
            Origin::Coarser(LevelMesh { mesh, sites, on_curves: Some(coarser), .. }) => {
                let on_curves = CoarserCurves {
                    curves: curves.coarse(),
                    sites: &coarser.sites,
                    pins: &coarser.pins,
                    clearance: &clearance,
                };
                let triangles = &sites.triangles;
                let coarser =
                    Coarser { mesh, triangles, lengths: lengths(sites), on_curves: Some(on_curves) };
                refine(&coarser, plan.interior)
            }
            Origin::Same(level) => level.interior_sites(),
            _ => clearance.scattered(self.context.surface, sizes, plan.interior, self.seed),
        };
        let (sites, pins) = curve_sites.merge(curves, interior);
        let pinned = (&curve_sites, pins.as_slice());
        let pinned = PinnedSites::new(curves, &self.context.surface.normals, &sites, pinned, plan.spacing);
        (Start { sites, pinned: Some(pinned) }, Some(LevelCurves { sites: curve_sites, pins }))
    }

    /// Relaxes and connects the sites of a level.
    fn level(
        &self,
        on: &CellSurface,
        start: &Start,
        on_curves: Option<LevelCurves>,
        options: &LevelOptions,
        progress: &mut ProgressReporter,
    ) -> Result<LevelMesh> {
        progress.poll()?;
        let level = Level::new(self.context.device, start, options)?;
        let tolerance = self.context.options.tolerance;
        let Relaxed { mut sites, near, steps, flags } =
            level.relax(self.context.device, start, &self.model.on_device(), tolerance, progress)?;
        if let Some(on_curves) = &on_curves {
            // In f64, not rounded to f32 as on the device.
            on_curves.restore(&mut sites.positions);
        }
        let sites = LevelSites { sites, on_curves, near };
        let mesh = match options.is_last {
            true => self.connect(on, sites, options.spacing, progress)?,
            false => self.connect_coarse(on, sites, options.spacing, progress)?,
        };
        Ok(LevelMesh { steps, flags, ..mesh })
    }
}
