//! Attempts with different random starts and, if the vertices do not suffice, with simplified components or
//! more vertices.

use super::levels::enough;
use super::shared::CoarseToFine;
use super::surface_model::{ModelInput, SurfaceModel};
use crate::gpu::Device;
use crate::mesh::sizing::SizeField;
use crate::mesh::topology::Topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Options, Shortage};
use crate::pipeline::clock::Clock;
use crate::pipeline::fallback::faulty::{Fallback, better};
use crate::pipeline::intersections::InputIntersections;
use crate::pipeline::outcome::{Fault, FaultKind, Outcome};
use crate::pipeline::user_curves::{has_user_curves, may_simplify};
use crate::progress::ProgressReporter;
use crate::sites::surface::Surface;
use crate::{Error, Result, TriMesh};

/// Each further attempt has this many times the vertices of the last,
const GROWTH: f64 = 1.5;
/// up to so many times the given number,
const MOST_GROWTH: usize = 4;
/// or up to this number.
const FEW: usize = 5000;

/// What all attempts share.
pub(crate) struct Attempts<'a> {
    pub device: &'a Device,
    /// The repaired input.
    pub mesh: &'a TriMesh,
    pub frame: &'a UnitFrame,
    pub surface: &'a Surface,
    pub input: &'a Topology,
    /// Vertices of the small components, which are not part of the surface.
    pub small_vertices: usize,
    pub options: &'a Options,
    /// Faces of the repaired input that intersect others.
    pub input_intersections: &'a InputIntersections,
    /// As [`CoarseToFine::deviation`].
    pub deviation: Option<f64>,
    /// Attempts that other runs have made.
    pub attempts_before: u32,
}

/// Runs attempts and counts them.
pub(super) struct Runner<'a, 'p> {
    pub shared: &'a Attempts<'a>,
    pub attempts: u32,
    pub progress: &'a mut ProgressReporter<'p>,
    clock: &'a mut Clock,
}

impl Runner<'_, '_> {
    /// An attempt on the model of a surface for this number of vertices.
    pub fn attempt(&mut self, model: &SurfaceModel, vertices: usize, seed: u64) -> Result<Outcome> {
        self.attempts += 1;
        self.progress.attempt(self.attempts);
        let options = &Options { vertices, seed, ..self.shared.options.clone() };
        let Attempts { device, mesh, frame, surface, input, input_intersections, deviation, .. } =
            *self.shared;
        let run = CoarseToFine {
            device,
            surface,
            model,
            mesh,
            frame,
            input,
            input_intersections,
            options,
            deviation,
        };
        Ok(Outcome { attempts: self.attempts, ..run.run(self.progress, self.clock)? })
    }

    /// The surface for another number of vertices.
    fn model_for(&mut self, vertices: usize) -> Result<SurfaceModel> {
        self.model(Options { vertices, ..self.shared.options.clone() })
    }

    /// The surface for other options.
    pub fn model(&mut self, options: Options) -> Result<SurfaceModel> {
        let Attempts { device, mesh, frame, surface, .. } = *self.shared;
        let input = ModelInput { device, mesh, frame, surface };
        self.progress.during(|progress| SurfaceModel::new(input, &options, progress))
    }

    /// As many vertices, or more if curves leave too few of them. What counts as a curve depends on their
    /// number.
    fn with_enough_vertices(
        &mut self,
        mut model: SurfaceModel,
        mut vertices: usize,
    ) -> Result<(SurfaceModel, usize)> {
        while let Some(curves) = &model.curves {
            let enough = enough(curves, self.shared.surface.area(), vertices);
            if enough <= vertices {
                break;
            }
            vertices = enough;
            model = self.model_for(vertices)?;
        }
        Ok((model, vertices))
    }

    /// The first outcome without a fault with more than so many vertices, if any, and the number tried last.
    fn with_more_vertices(&mut self, vertices: usize, seed: u64) -> Result<(Option<Outcome>, usize)> {
        let mut more = vertices;
        loop {
            more = (GROWTH * more as f64).ceil() as usize;
            if more > (MOST_GROWTH * vertices).max(FEW) {
                return Ok((None, more));
            }
            let model = self.model_for(more)?;
            let outcome = self.attempt(&model, more, seed)?;
            if !outcome.is_refused() {
                return Ok((Some(outcome), more));
            }
        }
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
        let (seed, shortage) = (self.options.seed, self.options.shortage);
        let mut runner = Runner { shared: self, attempts: self.attempts_before, progress, clock };
        let (model, vertices) = match shortage {
            Shortage::AddVertices => runner.with_enough_vertices(model, self.options.vertices)?,
            Shortage::Refuse | Shortage::BestEffort => (model, self.options.vertices),
        };
        let sizes = model.sizes.clone();
        let fallback = self.fallback(&sizes);
        let features = model.features;
        let whole = |runner: &mut Runner| {
            runner.progress.during(|progress| fallback.whole(features, vertices, progress))
        };
        if self.options.coarse_to_fine.local {
            let lost = Fault { kind: FaultKind::Topology, at: None };
            let whole = whole(&mut runner)?.ok_or_else(|| self.refusal(&lost, None));
            return whole.and_then(|whole| self.accepted(whole));
        }
        let first = match runner.attempt(&model, vertices, seed) {
            // There are too few vertices for the curves.
            Err(error @ Error::Usage { .. }) if may_simplify(self.options) => {
                return whole(&mut runner)?.ok_or(error).and_then(|whole| self.accepted(whole));
            }
            first => first?,
        };
        // It takes memory on the device, as the next one does.
        drop(model);
        let first = runner.with_shorter_edges(first, vertices)?;
        let Some(fault) = first.fault.clone() else { return Ok(first) };
        // If vertices may be added, even triangles come first.
        if shortage == Shortage::AddVertices && first.is_refused() {
            let (larger, tried) = runner.with_more_vertices(vertices, seed)?;
            let repair = |runner: &mut Runner| runner.progress.during(|p| fallback.repaired(&first, p));
            return match larger {
                Some(larger) => Ok(larger),
                None => repair(&mut runner)?
                    .filter(|repaired| !repaired.is_refused())
                    .ok_or_else(|| self.refusal(&fault, Some(tried))),
            };
        }
        // Local operations do not know the user's curves, but another start may do.
        if has_user_curves(self.options) {
            let model = runner.model_for(vertices)?;
            let other = runner.attempt(&model, vertices, seed.wrapping_add(1))?;
            if !other.is_refused() {
                return Ok(other);
            }
        }
        let attempts = runner.attempts;
        let mut best = runner.progress.during(|progress| fallback.repaired(&first, progress))?;
        // Where all components were faulty, the whole would be the same once more.
        let is_whole = |repaired: &Outcome| repaired.simplified_components == fallback.components();
        if best.as_ref().is_none_or(|repaired| repaired.fault.is_some() && !is_whole(repaired))
            && may_simplify(self.options)
            && fault.kind != FaultKind::Slivers
        {
            best = better(best, whole(&mut runner)?);
        }
        let best = better(Some(first), best).map(|best| Outcome { attempts, ..best });
        best.ok_or_else(|| self.refusal(&fault, None)).and_then(|best| self.accepted(best))
    }

    /// An outcome with a fault, unless the options refuse it.
    fn accepted(&self, outcome: Outcome) -> Result<Outcome> {
        match &outcome.fault {
            Some(fault) if outcome.is_refused() && self.options.shortage == Shortage::Refuse => {
                Err(self.refusal(fault, None))
            }
            _ => Ok(outcome),
        }
    }

    fn fallback<'f>(&'f self, sizes: &'f SizeField) -> Fallback<'f> {
        let Self { mesh, frame, surface, options, input_intersections, .. } = *self;
        Fallback { mesh, frame, surface, options, input_intersections, sizes }
    }

    /// The error for a faulty result; `tried` is the largest number of vertices tried.
    fn refusal(&self, fault: &Fault, tried: Option<usize>) -> Error {
        let vertices = self.options.vertices + self.small_vertices;
        let more = tried.map_or(vertices, |tried| tried + self.small_vertices);
        fault.refusal([vertices, more], self.input, self.frame)
    }
}
