//! Attempts with different random starts and, if the vertices do not suffice, with simplified components or
//! more vertices.

use super::levels::{enough, more_vertices};
use super::shared::CoarseToFine;
use super::surface_model::{FeaturedSurface, ModelRequest, SurfaceModel, feature_options, surface_vertices};
use crate::mesh::sizing::SizeField;
use crate::options::{Options, Shortage, Sizing};
use crate::pipeline::anisotropic::anisotropic;
use crate::pipeline::clock::Clock;
use crate::pipeline::fallback::faulty::{Fallback, better};
use crate::pipeline::outcome::{FaultKind, Outcome};
use crate::pipeline::plan::Plan;
use crate::pipeline::result::FeatureSummary;
use crate::pipeline::run_context::RunContext;
use crate::progress::ProgressReporter;
use crate::{Error, Result};

/// Where local operations fail, this many other random starts are tried.
const OTHER_STARTS: u64 = 2;
/// So many are, where edges are to stay whole: everything else would lose them.
const STARTS_FOR_WHOLE: u64 = 4;
/// Multiples of a number of vertices that are tried where it is too small for curves of the user.
const MORE: [usize; 3] = [1, 2, 4];
/// Each further attempt has this many times the vertices of the last.
const GROWTH: f64 = 1.5;
/// Attempts have at most this many times the given number of vertices, or [`FEW`] if that is more.
const MOST_GROWTH: usize = 4;
/// Attempts may have this many vertices, however few are asked for.
const FEW: usize = 5000;

/// What all attempts share.
pub(crate) struct Attempts<'a> {
    pub context: RunContext<'a>,
    /// Vertices of what is not part of the surface: small components and kept triangles.
    pub other_vertices: usize,
    /// Attempts that other runs have made.
    pub attempts_before: u32,
}

/// Runs attempts and counts them.
pub(super) struct Runner<'a, 'p> {
    pub shared: &'a Attempts<'a>,
    pub attempts: u32,
    pub progress: &'a mut ProgressReporter<'p>,
    /// Features are those of edges this many times as long as the vertices give.
    pub coarseness: f64,
    /// The surface of the last model.
    featured: Option<FeaturedSurface>,
    clock: &'a mut Clock,
}

impl Runner<'_, '_> {
    /// An attempt on the model of a surface for this number of vertices.
    pub fn attempt(&mut self, model: &SurfaceModel, vertices: usize, seed: u64) -> Result<Outcome> {
        self.attempts += 1;
        self.progress.attempt(self.attempts);
        let run = CoarseToFine { context: self.shared.context, vertices, seed, model };
        Ok(Outcome { attempts: self.attempts, ..run.run(self.progress, self.clock)? })
    }

    /// The surface for another number of vertices.
    pub fn model_for(&mut self, vertices: usize) -> Result<SurfaceModel> {
        self.model(&ModelRequest { vertices, ..ModelRequest::of(self.shared.context.plan) })
    }

    /// The surface for a request.
    pub fn model(&mut self, request: &ModelRequest) -> Result<SurfaceModel> {
        let context = &self.shared.context;
        let request = ModelRequest { coarseness: self.coarseness, ..*request };
        let known = self.featured.take();
        let model = self.progress.during(|progress| SurfaceModel::new(context, &request, known, progress))?;
        self.featured = Some(model.featured());
        Ok(model)
    }

    /// The surface for this number of vertices without creases between narrow facets.
    pub fn model_of_round_facets(&mut self, vertices: usize) -> Result<SurfaceModel> {
        let plan = self.shared.context.plan;
        self.model(&ModelRequest { vertices, round_facets: true, ..ModelRequest::of(plan) })
    }

    /// As many vertices, or more if curves leave too few of them. What counts as a curve depends on their
    /// number.
    fn with_enough_vertices(
        &mut self,
        mut model: SurfaceModel,
        mut vertices: usize,
    ) -> Result<(SurfaceModel, usize)> {
        while let Some(curves) = &model.curves {
            let enough = enough(curves, self.shared.context.surface.area(), vertices);
            if enough <= vertices {
                break;
            }
            vertices = enough;
            model = self.model_for(vertices)?;
        }
        Ok((model, vertices))
    }

    /// The outcome, or a better one from another random start.
    fn with_other_starts(&mut self, mut best: Outcome, vertices: usize, seed: u64) -> Result<Outcome> {
        for start in 1..=OTHER_STARTS {
            if !best.is_bad_all_over() || self.progress.leave_out() {
                break;
            }
            let model = self.model_for(vertices)?;
            let other = self.attempt(&model, vertices, seed.wrapping_add(start))?;
            best = better(best, other);
        }
        Ok(Outcome { attempts: self.attempts, ..best })
    }

    /// The first outcome that is not refused with more vertices than this one has; or, if there is none, the
    /// first of all of them that is not refused once it is repaired or made by local operations; or this
    /// one.
    fn with_more_vertices(
        &mut self,
        first: Outcome,
        fallback: &Fallback,
        (features, seed): (FeatureSummary, u64),
    ) -> Result<Outcome> {
        let (vertices, mut more) = (first.vertices, first.vertices);
        let mut refused = vec![first];
        loop {
            more = (GROWTH * more as f64).ceil() as usize;
            if more > (MOST_GROWTH * vertices).max(FEW) || self.progress.leave_out() {
                break;
            }
            let attempted = self.model_for(more).and_then(|model| self.attempt(&model, more, seed));
            match attempted {
                Ok(outcome) if !outcome.is_refused() => return Ok(outcome),
                Ok(outcome) => refused.push(outcome),
                // Finer edges may show more curves, for which these are too few vertices again.
                Err(Error::Usage { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        for outcome in &refused {
            if self.progress.leave_out() {
                break;
            }
            let repaired = self.progress.during(|progress| fallback.repaired(outcome, progress))?;
            if let Some(repaired) = repaired.filter(|repaired| !repaired.is_refused()) {
                return Ok(repaired);
            }
            if !self.shared.context.may_simplify() {
                continue;
            }
            let whole = |progress: &_| fallback.whole(features, outcome.vertices, progress);
            match self.progress.during(whole) {
                Ok(whole) if !whole.is_refused() => return Ok(whole),
                // Others have more vertices.
                Ok(_) | Err(Error::Usage { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(refused.swap_remove(0))
    }

    /// The outcome, which has a fault, or one with a lesser fault by local operations: in its faulty
    /// components, or everywhere.
    fn with_local_operations(
        &mut self,
        first: Outcome,
        fallback: &Fallback,
        (features, vertices): (FeatureSummary, usize),
    ) -> Result<Outcome> {
        let attempts = self.attempts;
        let kind = first.fault.as_ref().map(|fault| fault.kind);
        let repaired = self.progress.during(|progress| fallback.repaired(&first, progress))?;
        // Where all components were faulty, the whole would be the same once more.
        let is_enough = repaired.as_ref().is_some_and(|repaired| {
            let is_whole = repaired.simplified_components == fallback.components();
            repaired.fault.is_none() || is_whole || self.progress.leave_out()
        });
        let best = match repaired {
            Some(repaired) => better(first, repaired),
            None => first,
        };
        if is_enough || !self.shared.context.may_simplify() || matches!(kind, Some(FaultKind::Slivers(_))) {
            return Ok(Outcome { attempts, ..best });
        }
        let whole = self.progress.during(|progress| fallback.whole(features, vertices, progress));
        let best = match whole {
            // Its topology needs more vertices than any mesh of so few has.
            Err(error @ Error::Usage { .. }) if kind == Some(FaultKind::Topology) => return Err(error),
            Err(Error::Usage { .. }) => best,
            whole => better(best, whole?),
        };
        Ok(Outcome { attempts, ..best })
    }
}

impl Attempts<'_> {
    /// The first outcome without a fault; or that with the least one, if the options allow it.
    ///
    /// # Errors
    /// [`Error::Input`] if there is none with the given number of vertices and the options allow no other;
    /// [`Error::Usage`] if there are too few vertices for the curves.
    pub fn run(
        &self,
        model: SurfaceModel,
        progress: &mut ProgressReporter,
        clock: &mut Clock,
    ) -> Result<Outcome> {
        let (seed, shortage) = (self.context.options.seed, self.context.options.shortage);
        let (attempts, featured) = (self.attempts_before, Some(model.featured()));
        let mut runner = Runner { shared: self, attempts, progress, coarseness: 1.0, featured, clock };
        let (model, vertices) = match shortage {
            Shortage::AddVertices => runner.with_enough_vertices(model, self.context.plan.vertices)?,
            Shortage::Refuse | Shortage::BestEffort => (model, self.context.plan.vertices),
        };
        // Local operations come closer to the surface with equal edges.
        let sizes = match self.context.plan.sizing {
            Sizing::Automatic => SizeField::default(),
            _ => model.sizes.clone(),
        };
        let fallback = Fallback { context: self.context, sizes: &sizes };
        let features = model.features;
        let whole = |runner: &mut Runner| {
            runner.progress.during(|progress| fallback.whole(features, vertices, progress))
        };
        if self.context.options.coarse_to_fine.sizing.aspect().is_some() {
            let outcome =
                runner.progress.during(|progress| anisotropic(&self.context, features, progress))?;
            return self.accepted(outcome);
        }
        if self.context.options.coarse_to_fine.local {
            let made = match self.context.plan.curves.is_empty() {
                true => None,
                false => self.with_all_features(&mut runner, &fallback, (features, vertices), &MORE)?,
            };
            return made.map_or_else(|| whole(&mut runner), Ok).and_then(|made| self.accepted(made));
        }
        // For too few vertices.
        let with_local_operations = |runner: &mut Runner| {
            let whole = whole(runner)?;
            let outcome = runner.with_round_facets(whole, vertices)?;
            let outcome = runner.with_coarser_features(outcome, vertices)?;
            self.accepted(outcome)
        };
        if self.is_little_for_topology(vertices) {
            drop(model);
            return with_local_operations(&mut runner);
        }
        let first = match runner.attempt(&model, vertices, seed) {
            // There are too few vertices for the curves.
            Err(Error::Usage { .. }) if self.context.may_simplify() => {
                drop(model);
                return with_local_operations(&mut runner);
            }
            Err(error @ Error::Usage { .. }) if self.context.plan.pinned.is_empty() => {
                drop(model);
                let made = self.with_all_features(&mut runner, &fallback, (features, vertices), &[1])?;
                return self.accepted(made.ok_or(error)?);
            }
            first => first?,
        };
        // Its edge lengths take memory on the device, as those of the next one do.
        drop(model);
        let first = runner.with_refined_lengths(first, vertices)?;
        let first = runner.with_shorter_edges(first, vertices)?;
        let first = runner.with_round_facets(first, vertices)?;
        let first = self.without_fault(first, &mut runner, &fallback, (features, vertices))?;
        let first = runner.with_even_lengths(first, vertices)?;
        let outcome = match runner.closer(&first, &fallback, (features, vertices))? {
            Some(closer) => closer,
            None => runner.with_coarser_features(first, vertices)?,
        };
        self.accepted(outcome)
    }

    /// The surface with all its features by local operations; `None` if none of these multiples of the number
    /// of vertices is enough.
    ///
    /// # Errors
    /// [`Error::Usage`] with a multiple that is enough, unless vertices may be added.
    fn with_all_features(
        &self,
        runner: &mut Runner,
        fallback: &Fallback,
        (features, vertices): (FeatureSummary, usize),
        multiples: &[usize],
    ) -> Result<Option<Outcome>> {
        let RunContext { surface, mesh, plan, options, .. } = self.context;
        let on_surface = surface_vertices(surface, mesh);
        for more in multiples.iter().map(|factor| factor * vertices) {
            let request = ModelRequest { vertices: more, ..ModelRequest::of(plan) };
            let found_by = feature_options(&self.context, &request, &on_surface)?;
            let made = |progress: &_| fallback.with_all_features((features, &found_by), more, progress);
            match runner.progress.during(made)? {
                Some(made) if more == vertices || options.shortage == Shortage::AddVertices => {
                    return Ok(Some(Outcome { attempts: runner.attempts, ..made }));
                }
                Some(_) => {
                    let problem = format!(
                        "{vertices} vertices are too few for the surface with its sharp edges and boundaries"
                    );
                    return Err(plan.curves.name_borders(Error::usage(problem, more_vertices(more))));
                }
                None if runner.progress.leave_out() => break,
                None => {}
            }
        }
        Ok(None)
    }

    /// Whether cells would fail; local operations say how many vertices are needed.
    fn is_little_for_topology(&self, vertices: usize) -> bool {
        self.context.may_simplify() && self.context.input.is_much_for(vertices)
    }

    /// The outcome, or one with a lesser fault from other starts, more vertices, or local operations.
    fn without_fault(
        &self,
        first: Outcome,
        runner: &mut Runner,
        fallback: &Fallback,
        (features, vertices): (FeatureSummary, usize),
    ) -> Result<Outcome> {
        let Options { seed, shortage, .. } = *self.context.options;
        // If vertices may be added, even triangles come first.
        let first = match shortage {
            Shortage::AddVertices if first.is_refused() => {
                let outcome = runner.with_more_vertices(first, fallback, (features, seed))?;
                Outcome { attempts: runner.attempts, ..outcome }
            }
            _ => first,
        };
        if first.fault.is_none()
            || fallback.has_usual_slivers(&first)
            || (!first.is_refused() && runner.progress.leave_out())
        {
            return Ok(first);
        }
        // Local operations in single components do not know the user's curves, but another start may do.
        let starts = match (self.context.plan.has_kept(), self.context.plan.pinned.whole.is_empty()) {
            (false, _) => 0,
            (true, true) => 1,
            (true, false) => STARTS_FOR_WHOLE,
        };
        for start in 1..=starts {
            if runner.progress.leave_out() {
                break;
            }
            let model = runner.model_for(vertices)?;
            let other = runner.attempt(&model, vertices, seed.wrapping_add(start))?;
            if !other.is_refused() {
                return Ok(other);
            }
        }
        let Plan { curves, pinned, .. } = self.context.plan;
        if first.is_refused() && !curves.is_empty() && pinned.is_empty() {
            let made = self.with_all_features(runner, fallback, (features, vertices), &MORE)?;
            return Ok(made.unwrap_or(first));
        }
        let best = runner.with_local_operations(first, fallback, (features, vertices))?;
        if best.is_bad_all_over() { runner.with_other_starts(best, vertices, seed) } else { Ok(best) }
    }

    /// An outcome with a fault, unless the options refuse it.
    fn accepted(&self, outcome: Outcome) -> Result<Outcome> {
        match &outcome.fault {
            Some(fault) if outcome.is_refused() && self.context.options.shortage == Shortage::Refuse => {
                let vertices = self.context.plan.vertices + self.other_vertices;
                Err(fault.refusal(vertices, self.context.input, self.context.frame))
            }
            _ => Ok(outcome),
        }
    }
}
