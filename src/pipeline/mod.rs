//! A run: prepare the input, remesh it by one of the pipelines, measure the result.

mod all_at_once;
mod anisotropic;
mod bends;
mod cells;
mod clock;
mod coarse_to_fine;
mod cost;
mod curves_of_whole;
mod deviation;
mod face_count;
mod fallback;
mod given_up;
mod intersections;
pub(crate) mod kept;
mod measuring;
mod memory;
mod messages;
mod missing;
mod near_sites;
mod other_count;
mod outcome;
mod pinned;
mod plan;
mod prepare;
mod preview;
pub(crate) mod refined;
mod result;
mod rounding;
mod run_context;
mod shape_warnings;
mod sides;
mod small_angles;
mod submission;
mod symmetric;
mod user_curves;
mod warning;

use crate::gpu::Device;
use crate::grammar::counted;
use crate::mesh::repair::Repaired;
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::mesh::submesh::append;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Length, Options};
use crate::progress::ProgressReporter;
use crate::sites::surface::Surface;
use crate::{Error, Flow, Phase, Progress, ProgressToken, Result, TriMesh};
use all_at_once::AllAtOnce;
use cells::cells_of;
use clock::Clock;
use coarse_to_fine::attempts::Attempts;
use coarse_to_fine::surface_model::SurfaceModel;
use deviation::{Course, make_within};
use face_count::{FaceCount, with_vertices};
use given_up::Searched;
use kept::{Kept, in_units};
use measuring::{MeasureRequest, Measuring, correspondence_of};
use messages::{WarningInput, remarks, warnings};
use other_count::with_other_count;
use outcome::{Fault, Outcome};
use prepare::{Prepared, repaired_for};
use rounding::Rounding;
use shape_warnings::Shapes;
use std::time::Instant;
use symmetric::remesh_symmetric;
use user_curves::may_give_up_fixed;
use warning::Warning;

pub use deviation::DeviationSummary;
pub(crate) use prepare::{compile, compile_later};
pub use preview::{Preview, PreviewKept, PreviewLevel, preview, preview_repaired};
pub use result::{
    ExactSummary, FeatureSummary, MetricQuality, PhaseTime, Remeshed, RunTimings, ShorterEdges, Summary,
};
pub use small_angles::SmallAngleSummary;
#[cfg(feature = "html")]
pub(crate) use user_curves::UserCurves;

pub use warning::WarningCode;

/// Remeshes `mesh` on `device`.
///
/// # Errors
/// [`Error::Usage`] for options out of range, [`Error::Input`] for a mesh without area, and the device's
/// errors.
pub fn remesh(device: &Device, mesh: &TriMesh, options: &Options) -> Result<Remeshed> {
    remesh_with_progress(device, mesh, options, |_| {})
}

/// Like [`remesh`], calling `progress` several times a second on this thread, but more rarely if that is a
/// thread of a rayon pool. It may return nothing, or a [`Flow`] that says what to do next.
///
/// # Errors
/// As [`remesh`], and [`Error::Cancelled`] if `progress` asks for it.
pub fn remesh_with_progress<F: Into<Flow>>(
    device: &Device,
    mesh: &TriMesh,
    options: &Options,
    progress: impl FnMut(Progress) -> F,
) -> Result<Remeshed> {
    remesh_repaired(device, mesh, None, options, progress)
}

/// Like [`remesh_with_progress`], for a mesh that may be repaired already, such as for
/// [`crate::Size::vertices`]: `repaired` is what [`crate::mesh::repair::repair_with`] made of `mesh` with
/// [`Options::repairs`].
///
/// # Errors
/// As [`remesh_with_progress`]; [`Error::Usage`] if `repaired` was made from another mesh.
pub fn remesh_repaired<F: Into<Flow>>(
    device: &Device,
    mesh: &TriMesh,
    repaired: Option<Repaired>,
    options: &Options,
    mut progress: impl FnMut(Progress) -> F,
) -> Result<Remeshed> {
    options.validate()?;
    let mut options = with_vertices(mesh, repaired.as_ref(), options)?;
    let mut repaired = repaired;
    if !options.coarse_to_fine.keep.is_empty() {
        let whole = repaired_for(mesh, repaired, &options, &ProgressToken::default())?;
        options = in_units(&options, &whole.mesh)?;
        repaired = Some(whole);
    }
    let options = &options;
    let mut callback = |now| progress(now).into();
    let mut found = match options.coarse_to_fine.symmetric {
        Some(symmetry) => remesh_symmetric(device, mesh, repaired, (options, symmetry), &mut callback)?,
        None => run(device, mesh, repaired, options, &mut ProgressReporter::new(&mut callback))
            .map_err(|error| with_other_count(error, mesh, options))?,
    };
    found.summary.warn_all(device.warnings().iter().map(|text| (WarningCode::Device, text.clone())));
    Ok(found)
}

fn run(
    device: &Device,
    mesh: &TriMesh,
    repaired: Option<Repaired>,
    options: &Options,
    progress: &mut ProgressReporter,
) -> Result<Remeshed> {
    // Earlier runs on the same device do not count.
    device.take_timings();
    let mut clock = Clock::new(device);
    let mut make = |input| make_with_faces(device, input, progress, &mut clock);
    let mut found = match make(RunInput::new(mesh, repaired, options)) {
        Err(Error::Usage { problem, field: None, .. }) if may_give_up_fixed(options) => {
            let made = make(RunInput { gives_up_fixed: true, ..RunInput::new(mesh, None, options) })?;
            let mut found = finish(mesh, options, made, clock, progress)?;
            let text = format!("sharp edges were given up: {problem}");
            found.summary.warn(WarningCode::SharpEdges, text);
            found
        }
        made => finish(mesh, options, made?, clock, progress)?,
    };
    face_count::tell(options, &mut found.summary);
    progress.done(1.0)?;
    Ok(found)
}

/// What is made and measured of a mesh in the end.
fn finish(
    mesh: &TriMesh,
    options: &Options,
    (Made { mut prepared, mut outcome }, course): (Made, Course),
    mut clock: Clock,
    progress: &mut ProgressReporter,
) -> Result<Remeshed> {
    let (search, elsewhere) = (prepared.search(options), prepared.other_vertices());
    let (mut result, pinned) = prepared.assemble(&mut outcome)?;
    let Prepared { kept, repaired, frame, input, small, surface, input_intersections, plan, .. } = prepared;
    let (kept, is_whole) = (kept.as_ref(), small.is_empty() && kept.is_none());
    let mut rounding = options.format.and_then(|format| Rounding::apply(&mut result, &frame, format));
    clock.end_phase("connect");
    progress.phase(Phase::Measure, 1.0, 0.0)?;
    let on = progress.during(|p| correspondence_of(&result, mesh, (&repaired, kept), options, search, p))?;
    on.iter().for_each(|_| clock.end_phase("source"));
    let measuring = Measuring {
        request: MeasureRequest::new(options),
        result: &result,
        reference: (&repaired.mesh, plan.refined.undivided.is_some().then_some(&repaired.origin)),
        rounding: rounding.as_mut(),
        intersecting_faces: outcome.intersecting_faces.filter(|_| is_whole),
        input_intersections: input_intersections.count().filter(|_| is_whole),
    };
    let measured = progress.during(|progress| measuring.measure(progress))?;
    let cells = progress.during(|p| cells_of(&mut outcome, (&result, &repaired.mesh), &frame, options, p))?;
    let given_up = progress.during(|p| feature_warnings(&surface, &outcome, elsewhere, options, p))?;
    clock.end_phase("measure");
    let (deviation, metric) = (course.summary(measured.output.distances), outcome.metric);
    let (diagonal, simplified) = (UnitFrame::of(&repaired.mesh)?.scale, outcome.simplified_components);
    let spacing = frame.scale * spacing(surface.area(), outcome.vertices);
    let (before, after) = ((&repaired.mesh, &input), (&result, &measured.output));
    let about = WarningInput {
        expected_vertices: outcome.vertices + elsewhere,
        counts: &outcome.counts,
        flags: &outcome.flags,
        fault: outcome.fault.filter(Fault::is_refused).map(|fault| fault.describe(&frame)),
        given_up,
        input_intersections: measured.input_intersections,
        rounding: rounding.as_ref(),
        repaired: &repaired.counts,
        missed_regions: plan.refined.remarks_on_missed(options, kept)?,
        pinned,
        deviation,
        shapes: Shapes { options, input: before, result: after, kept, metric, spacing, diagonal },
    };
    let warnings = progress.during(|progress| warnings(&about, progress))?;
    let (crossing, smallest) = (measured.input_intersections, measured.output.quality.min_angle);
    let summary = Summary {
        remarks: remarks((&repaired, kept), &input, crossing, simplified, rounding.as_ref()),
        input_self_intersecting_faces: crossing,
        collapsed_components: simplified,
        repaired: repaired.counts,
        warning_codes: warnings.iter().map(|warning| warning.code).collect(),
        warnings: warnings.into_iter().map(|warning| warning.text).collect(),
        input,
        output: measured.output,
        attempts: outcome.attempts,
        iterations: outcome.steps.len() as u32,
        converged: outcome.steps.last().is_some_and(|s| *s < options.tolerance),
        finished_early: progress.is_shortened(),
        steps: outcome.steps,
        spacing,
        edge_lengths: outcome.edge_lengths.map(|range| range.map(|length| length * frame.scale)),
        flags: outcome.flags,
        connected: outcome.counts,
        exact: outcome.exact,
        disks: outcome.disks.map(|disks| disks.scaled(frame.scale)),
        energy: measured.energy,
        features: outcome.features,
        cells: cells.as_ref().map(|cells| cells.summary(repaired.mesh.area())),
        small_angles: SmallAngleSummary::new((&result, kept), smallest, outcome.mended, options),
        metric,
        shorter_edges: outcome.shorter_edges,
        deviation,
        timings: clock.timings(),
    };
    Ok(Remeshed { mesh: result, correspondence: on, cells, summary })
}

/// The warnings of a surface's features in an outcome; `elsewhere` more vertices are on other components.
fn feature_warnings(
    surface: &Surface,
    outcome: &Outcome,
    elsewhere: usize,
    options: &Options,
    progress: &ProgressToken,
) -> Result<Vec<Warning>> {
    let Some(found) = outcome.features else { return Ok(Vec::new()) };
    let vertices = outcome.vertices;
    let (on, feature_angle) = (&surface.mesh(), options.coarse_to_fine.feature_angle);
    let searched = Searched { surface: on, area: surface.area(), feature_angle, vertices, elsewhere };
    searched.warnings(&found, progress)
}

/// What a mesh is made from.
struct RunInput<'a> {
    mesh: &'a TriMesh,
    repaired: Option<Repaired>,
    options: &'a Options,
    /// Vertices of the result.
    vertices: usize,
    /// Edge lengths instead of what the options say.
    lengths: Option<GivenLengths<'a>>,
    /// Vertices are inserted where the mesh is farther than this from the surface, in diagonals.
    deviation: Option<f64>,
    /// Attempts made before.
    attempts: u32,
    /// Whether the options' fixed half-edges are given up.
    gives_up_fixed: bool,
}

impl<'a> RunInput<'a> {
    /// As the options have it.
    fn new(mesh: &'a TriMesh, repaired: Option<Repaired>, options: &'a Options) -> Self {
        let (lengths, deviation, attempts) = (None, None, 0);
        let vertices = options.vertices;
        Self { mesh, repaired, options, vertices, lengths, deviation, attempts, gives_up_fixed: false }
    }
}

/// Edge lengths that follow from earlier runs.
#[derive(Clone, Copy)]
struct GivenLengths<'a> {
    /// At the vertices of the repaired mesh, in any unit.
    values: &'a [f64],
    /// The shortest, if the options have none.
    shortest: Length,
}

/// A mesh, with what it was made from.
struct Made {
    prepared: Prepared,
    outcome: Outcome,
}

impl Made {
    /// The whole mesh in the unit-diagonal frame.
    fn unit_mesh(&self) -> TriMesh {
        let mut mesh = self.outcome.mesh.clone();
        self.prepared.small.iter().for_each(|part| append(&mut mesh, part));
        mesh
    }
}

/// Prepares the input and remeshes it, again with other numbers of vertices while the number of triangles is
/// not the one asked for.
fn make_with_faces(
    device: &Device,
    input: RunInput,
    progress: &mut ProgressReporter,
    clock: &mut Clock,
) -> Result<(Made, Course)> {
    let (mesh, options, gives_up_fixed) = (input.mesh, input.options, input.gives_up_fixed);
    let mut tried = vec![input.vertices];
    let mut best = make_as_asked(device, input, progress, clock)?;
    let (Some(mut best_count), mut attempts) = (FaceCount::of(&best.0, options), best.0.outcome.attempts)
    else {
        return Ok(best);
    };
    let mut now = best_count;
    while let Some(vertices) = now.other_vertices(&tried, options).filter(|_| !progress.leave_out()) {
        tried.push(vertices);
        let again = RunInput { vertices, attempts, gives_up_fixed, ..RunInput::new(mesh, None, options) };
        let next = match make_as_asked(device, again, progress, clock) {
            Ok(next) => next,
            // There is a mesh already, if not with as many triangles.
            Err(Error::Usage { .. }) => break,
            Err(error) => return Err(error),
        };
        attempts = next.0.outcome.attempts;
        now = FaceCount::of(&next.0, options).unwrap_or(now);
        if now.is_better_than(best_count) {
            (best, best_count) = (next, now);
        }
    }
    Ok(best)
}

/// Prepares the input and remeshes it, several times if there is a largest deviation.
fn make_as_asked(
    device: &Device,
    input: RunInput,
    progress: &mut ProgressReporter,
    clock: &mut Clock,
) -> Result<(Made, Course)> {
    match input.options.coarse_to_fine.sizing.deviation() {
        Some(most) => make_within(device, input, most, progress, clock),
        None => Ok((make(device, input, progress, clock)?, Course::default())),
    }
}

/// Prepares the input and remeshes it.
fn make(
    device: &Device,
    input: RunInput,
    progress: &mut ProgressReporter,
    clock: &mut Clock,
) -> Result<Made> {
    let (options, attempts_before, deviation) = (input.options, input.attempts, input.deviation);
    let mut prepared = progress.during(|progress| prepare(device, input, progress))?;
    clock.end_phase("prepare");
    let model = prepared.model.take();
    let (context, other_vertices) = (prepared.context(device, options, deviation), prepared.other_vertices());
    let attempts = Attempts { context, other_vertices, attempts_before };
    let outcome = attempt(attempts, model, &prepared.sizes, progress, clock);
    let outcome = outcome.map_err(|error| of_rest(error, prepared.kept.as_ref()))?;
    Ok(Made { prepared, outcome })
}

/// An error about the number of vertices, where some are those of kept triangles.
fn of_rest(error: Error, kept: Option<&Kept>) -> Error {
    match kept {
        Some(kept) => kept.of_rest(error),
        None => error,
    }
}

/// Prepares the input while kernels are compiled, which do not depend on it. Once it is prepared, what is
/// left to compile counts as waiting for the device.
fn prepare(device: &Device, input: RunInput, progress: &ProgressToken) -> Result<Prepared> {
    let method = input.options.method;
    let prepare = || (Prepared::new(device, input, progress), Instant::now());
    let (compiled, (prepared, end)) = rayon::join(|| compile(device, method), prepare);
    device.count_waited(end.elapsed());
    prepared.and_then(|prepared| compiled.map(|()| prepared))
}

/// The mesh of all but the small components.
fn attempt(
    attempts: Attempts,
    model: Option<SurfaceModel>,
    sizes: &SizeField,
    progress: &mut ProgressReporter,
    clock: &mut Clock,
) -> Result<Outcome> {
    let context = attempts.context;
    let (method, vertices) = (context.options.method, context.plan.vertices);
    let outcome = match model {
        None => AllAtOnce { context, sizes }.run(progress, clock)?,
        Some(model) => {
            let mut later = Ok(());
            // In the thread pool of the caller, since a forked process has no threads in the global one.
            let outcome = rayon::in_place_scope(|scope| {
                scope.spawn(|_| later = compile_later(context.device, method, vertices));
                attempts.run(model, progress, clock)
            });
            later?;
            outcome?
        }
    };
    if outcome.mesh.triangles.is_empty() {
        let problem =
            format!("{} too few to connect this surface", counted(vertices, ["vertex is", "vertices are"]));
        return Err(Error::input(None, problem, "ask for more vertices"));
    }
    Ok(outcome)
}
