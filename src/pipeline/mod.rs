//! The run: seed, iterate, connect, measure.

mod all_at_once;
mod coarse_to_fine;
mod collapse;
mod cost;
mod memory;
mod messages;
mod near_sites;
mod prepare;
mod preview;
mod submission;
mod user_curves;

use crate::gpu::{Device, StageTime};
use crate::measure::{Crossing, Measures, measure_some};
use crate::mesh::correspondence::{Correspondence, CorrespondenceRequest, Search, trace};
use crate::mesh::features::Features;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::repair::{RepairCounts, Repaired};
use crate::mesh::spacing;
use crate::mesh::submesh::append;
use crate::mesh::topology::Topology;
use crate::options::{MeasureDepth, Options};
use crate::progress::{ProgressReporter, ProgressToken};
use crate::sites::connect::ConnectCounts;
use crate::sites::poisson::DiskSummary;
use crate::sites::restricted_voronoi::{Energy, energy};
use crate::stages::flags::FlagCounts;
use crate::{Error, Flow, Phase, Progress, Result, TriMesh};
use all_at_once::AllAtOnce;
use coarse_to_fine::attempts::{Attempts, Settled};
use coarse_to_fine::connect::Fault;
use glam::DVec3;
use messages::{remarks, warnings};
use prepare::Prepared;
use serde::Serialize;
use std::sync::OnceLock;
use std::time::Instant;

pub use all_at_once::exact::ExactSummary;
#[cfg(feature = "html")]
pub(crate) use prepare::for_repaired;
pub(crate) use prepare::{compile, compile_later};
pub use preview::{Preview, PreviewLevel, preview, preview_repaired};
#[cfg(feature = "html")]
pub(crate) use user_curves::user_curve_edges;

/// A result with its story.
#[derive(Debug, Clone)]
pub struct Remeshed {
    /// The new mesh, in the input's frame.
    pub mesh: TriMesh,
    /// Where its vertices and faces lie on the input as it was given, if [`Options::correspondence`] asks for
    /// it.
    pub correspondence: Option<Correspondence>,
    /// What happened.
    pub summary: Summary,
}

/// What a run did.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// What cleaning the input found.
    pub repaired: RepairCounts,
    /// Topology of the cleaned input.
    pub input: Topology,
    /// Faces of the cleaned input that intersect others; `None` if the result's are not measured either.
    pub input_self_intersecting_faces: Option<usize>,
    /// How many components were made by collapsing edges: too few vertices for cells, or cells without their
    /// topology.
    pub collapsed_components: usize,
    /// What was odd about the input and what was done about it, in words.
    pub remarks: Vec<String>,
    /// Figures of the result as far as [`Options::measures`] asks for them, distances against the cleaned
    /// input.
    pub output: Measures,
    /// Random starts, and counts of vertices, that were tried; more than 1 if the vertices asked for hardly
    /// suffice.
    pub attempts: u32,
    /// Iterations done.
    pub iterations: u32,
    /// Whether the step fell below the tolerance.
    pub converged: bool,
    /// Whether iterations or rounds were left out because the callback asked the run to finish.
    pub finished_early: bool,
    /// Root mean square step of every iteration, in spacings.
    pub steps: Vec<f64>,
    /// Edge length of a perfect layout in the input's units.
    pub spacing: f64,
    /// The least and the largest edge length wanted anywhere, in the input's units, where they differ.
    pub edge_lengths: Option<[f64; 2]>,
    /// Sites with special faces after the last iteration.
    pub flags: FlagCounts,
    /// What connecting met.
    pub connected: ConnectCounts,
    /// What the last exact cells were; `None` but with exact faces.
    pub exact: Option<ExactSummary>,
    /// How the vertices keep their distance, in the input's units; `None` but with Poisson disks at rest.
    pub disks: Option<DiskSummary>,
    /// How evenly the vertices are spread over the cleaned input, with exact faces if everything is measured.
    pub energy: Option<Energy>,
    /// What was held of sharp and open edges; `None` but with [`crate::Method::CoarseToFine`], which alone
    /// looks for them.
    pub skeleton: Option<FeatureSummary>,
    /// What could not be done; empty for a valid result.
    pub warnings: Vec<String>,
    /// Where the time went.
    pub timings: RunTimings,
}

/// Sharp and open edges of the input, and the sites that hold them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct FeatureSummary {
    /// Chains of sharp, open and other edges that are held.
    pub curves: usize,
    /// Vertices where curves end, branch or turn.
    pub corners: usize,
    /// Parts of the surface between the curves.
    pub patches: usize,
    /// Vertices of the result on curves.
    pub curve_sites: usize,
}

impl FeatureSummary {
    fn of(skeleton: &Features) -> Self {
        Self {
            curves: skeleton.curves.len(),
            corners: skeleton.corners.len(),
            patches: skeleton.patch_count,
            curve_sites: 0,
        }
    }
}

/// Time and memory of a run.
#[derive(Debug, Clone, Serialize)]
pub struct RunTimings {
    /// Device time by kernel and kind of copy.
    pub stages: Vec<StageTime>,
    /// Host time by phase.
    pub phases: Vec<PhaseTime>,
    /// Wall time of all phases in milliseconds.
    pub wall_milliseconds: f64,
    /// Most device memory in use at once, in bytes.
    pub peak_device_bytes: u64,
}

/// Wall time of a phase of the run.
#[derive(Debug, Clone, Serialize)]
pub struct PhaseTime {
    /// Name of the phase.
    pub name: &'static str,
    /// Its wall time in milliseconds, waiting for the device included.
    pub milliseconds: f64,
}

/// Remeshes `mesh` on `device`.
///
/// # Errors
/// [`Error::Usage`] for options out of range, [`Error::Input`] for a mesh without area, and the device's
/// errors.
pub fn remesh(device: &Device, mesh: &TriMesh, options: &Options) -> Result<Remeshed> {
    remesh_with_progress(device, mesh, options, |_| {})
}

/// As [`remesh`], calling `progress` several times a second on this thread, but more rarely if that is a
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

/// As [`remesh_with_progress`] for a mesh that may be repaired already, such as for [`crate::Size::vertices`]:
/// `repaired` is what [`crate::mesh::repair::repair_with`] made of `mesh` with [`Options::repairs`].
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
    let mut callback = |now| progress(now).into();
    run(device, mesh, repaired, options, &mut ProgressReporter::new(&mut callback))
}

fn run(
    device: &Device,
    mesh: &TriMesh,
    repaired: Option<Repaired>,
    options: &Options,
    progress: &mut ProgressReporter,
) -> Result<Remeshed> {
    progress.poll()?;
    // Earlier runs on the same device do not count.
    device.take_timings();
    let mut clock = Clock::new();
    // What the driver makes of the kernels does not depend on the mesh.
    let mut prepared = progress.during(|progress| {
        let prepared = || Prepared::new(device, (mesh, repaired), options, progress);
        let (compiled, prepared) = rayon::join(|| compile(device, options.method), prepared);
        let prepared = prepared?;
        compiled.map(|()| prepared)
    })?;
    clock.phase("prepare");
    let traced = (options.correspondence, prepared.searched());
    let known = OnceLock::new();
    let settled = settled(device, &mut prepared, &known, (progress, &mut clock))?;
    let Settled { connection, steps, skeleton, vertices, attempts } = settled;
    let wanted = vertices + prepared.done();
    let Prepared { repaired, frame, input, small, surface, .. } = prepared;
    let spacing = spacing(surface.area(), vertices);
    let Connection { mesh: mut result, curve_sites, counts, flags, fault, crossing, .. } = connection;
    small.iter().for_each(|part| append(&mut result, part));
    result.vertices.iter_mut().for_each(|p| *p = frame.from_unit(*p));
    // Those of the small ones were not looked at.
    let crossing = crossing.filter(|_| small.is_empty());
    let known = known.into_inner().filter(|_| small.is_empty());
    let collapsed = connection.collapsed + small.len();
    clock.phase("connect");
    progress.phase(Phase::Measure, 1.0, 0.0)?;
    let correspondence =
        progress.during(|progress| correspondence_of(&result, (mesh, &repaired), traced, progress))?;
    if correspondence.is_some() {
        clock.phase("source");
    }
    let reference = (options.measures >= MeasureDepth::Full).then_some(&repaired.mesh);
    let (output, energy, crossing) = progress.during(|progress| {
        let (output, energy) = measured(&result, reference, (options, crossing), progress)?;
        let found = |input| Ok(intersecting_faces(input, progress)?.len());
        let of_input = reference.map(|input| known.map_or_else(|| found(input), Ok));
        Ok((output, energy, of_input.transpose()?))
    })?;
    clock.phase("measure");
    progress.done(1.0)?;
    let summary = Summary {
        remarks: remarks(&repaired.counts, &input, crossing, collapsed),
        input_self_intersecting_faces: crossing,
        collapsed_components: collapsed,
        repaired: repaired.counts,
        warnings: warnings(
            options,
            wanted,
            &input,
            &output,
            &counts,
            &flags,
            fault.map(|f| f.in_words(&frame)),
        ),
        input,
        output,
        attempts,
        iterations: steps.len() as u32,
        converged: steps.last().is_some_and(|s| *s < options.tolerance),
        finished_early: progress.is_shortened(),
        steps,
        spacing: spacing * frame.scale,
        edge_lengths: connection.edge_lengths.map(|range| range.map(|length| length * frame.scale)),
        flags,
        connected: counts,
        exact: connection.exact,
        disks: connection.disks.map(|found| found.scaled(frame.scale)),
        energy,
        skeleton: skeleton.map(|found| FeatureSummary { curve_sites, ..found }),
        timings: clock.timings(device),
    };
    Ok(Remeshed { mesh: result, correspondence, summary })
}

/// What is to be done about faces that run through others, if their number is `known` or not.
fn crossing_for(depth: MeasureDepth, known: Option<usize>) -> Crossing {
    match known {
        Some(known) => Crossing::Known(known),
        None if depth >= MeasureDepth::Intersections => Crossing::Find,
        None => Crossing::Skip,
    }
}

/// Where the result lies on the input, which `repaired` was made from, as far as it is asked for.
fn correspondence_of(
    result: &TriMesh,
    (input, repaired): (&TriMesh, &Repaired),
    (asked, searched): (CorrespondenceRequest, Option<Search>),
    progress: &ProgressToken,
) -> Result<Option<Correspondence>> {
    let found = || trace(input, repaired, result, asked, searched, progress);
    (asked != CorrespondenceRequest::NONE).then(found).transpose()
}

/// The figures of a result; how evenly its vertices are spread over the reference, if there is one and that
/// is of interest.
fn measured(
    result: &TriMesh,
    reference: Option<&TriMesh>,
    (options, crossing): (&Options, Option<usize>),
    progress: &ProgressToken,
) -> Result<(Measures, Option<Energy>)> {
    let crossing = crossing_for(options.measures, crossing);
    let spread = reference.filter(|_| options.has_exact_faces() && options.iterations > 0);
    let energy = spread.map(|input| energy(input, &result.vertices)).transpose()?;
    Ok((measure_some(result, reference, crossing, progress)?, energy))
}

/// The result on all but the small components; `crossing` learns how many faces of these run through others,
/// if that is asked.
fn settled(
    device: &Device,
    prepared: &mut Prepared,
    crossing: &OnceLock<usize>,
    (progress, clock): (&mut ProgressReporter, &mut Clock),
) -> Result<Settled> {
    let ground = prepared.ground.take();
    let (mesh, input) = prepared.large();
    let Prepared { frame, surface, options, .. } = &*prepared;
    let done = prepared.done();
    let settled = match ground {
        None => AllAtOnce { device, surface, input, options }.run(progress, clock)?,
        Some(ground) => std::thread::scope(|scope| {
            let later = scope.spawn(|| compile_later(device, options.method));
            let settled = Attempts { device, mesh, frame, surface, input, done, options, crossing }
                .run(ground, progress, clock);
            later.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
            settled
        })?,
    };
    if settled.connection.mesh.triangles.is_empty() {
        let problem = format!("{} vertices are too few to connect this surface", options.vertices);
        return Err(Error::input(None, problem, "ask for more vertices"));
    }
    Ok(settled)
}

/// A mesh in the unit-diagonal frame, and how it came about.
#[derive(Default)]
pub(crate) struct Connection {
    mesh: TriMesh,
    /// Where the vertices were on the surface before the polish; nothing from pipelines that have all sites
    /// from the start.
    rested: Vec<DVec3>,
    /// The triangle under each of these.
    under: Vec<u32>,
    /// How many sites are on curves.
    curve_sites: usize,
    counts: ConnectCounts,
    flags: FlagCounts,
    fault: Option<Fault>,
    /// Faces that run through others, where that is known.
    crossing: Option<usize>,
    /// Components that were made by collapsing edges.
    collapsed: usize,
    /// The least and the largest edge length wanted, where they differ.
    edge_lengths: Option<[f64; 2]>,
    /// The last exact cells.
    exact: Option<ExactSummary>,
    /// How sites keep their distance that were made so.
    disks: Option<DiskSummary>,
}

struct Clock {
    last: Instant,
    phases: Vec<PhaseTime>,
}

impl Clock {
    /// All phases, and what the device took for them.
    fn timings(self, device: &Device) -> RunTimings {
        RunTimings {
            stages: device.take_timings(),
            wall_milliseconds: self.phases.iter().map(|p| p.milliseconds).sum(),
            phases: self.phases,
            peak_device_bytes: device.peak_bytes(),
        }
    }

    fn new() -> Self {
        Self { last: Instant::now(), phases: Vec::new() }
    }

    fn phase(&mut self, name: &'static str) {
        let now = Instant::now();
        let milliseconds = (now - self.last).as_secs_f64() * 1e3;
        match self.phases.last_mut().filter(|p| p.name == name) {
            // Another level of the same kind.
            Some(phase) => phase.milliseconds += milliseconds,
            None => self.phases.push(PhaseTime { name, milliseconds }),
        }
        self.last = now;
    }
}
