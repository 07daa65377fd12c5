//! The run: seed, iterate, connect, measure.

mod attempts;
mod coarse_to_fine;
mod connected;
mod densify;
mod exact;
mod grid;
mod holes;
mod level;
mod pace;
mod plan;
mod preview;
mod refine;
#[cfg(test)]
mod relaxing;
mod rtf;
mod shares;

use crate::gpu::kernels::face::cell;
use crate::gpu::{Device, StageTime};
use crate::measure::{Crossing, Measures, measure_some};
use crate::mesh::frame::Frame;
use crate::mesh::repair::{RepairCounts, Repaired, repair};
use crate::mesh::skeleton::{Skeleton, SkeletonOptions, user_edges};
use crate::mesh::spacing;
use crate::mesh::topology::{Topology, topology};
use crate::mesh::voronoi::{Energy, energy};
use crate::options::{MeasureDepth, Method, Options};
use crate::stages::connect::ConnectCounts;
use crate::stages::face::FlagCounts;
use crate::stages::seed;
use crate::stages::surface::Surface;
use crate::watch::Watch;
use crate::{Error, Flow, Phase, Progress, Result, TriMesh};
use attempts::{Attempts, Settled};
use coarse_to_fine::Ground;
use connected::Fault;
use glam::DVec3;
use serde::Serialize;
use std::time::Instant;

pub use exact::ExactSummary;
pub use preview::{Preview, PreviewLevel, preview};

/// A result with its story.
#[derive(Debug, Clone)]
pub struct Remeshed {
    /// The new mesh, in the input's frame.
    pub mesh: TriMesh,
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
    /// Figures of the result as far as [`Options::measures`] asks for them, distances against the cleaned input.
    pub output: Measures,
    /// Random starts, and counts of vertices, that were tried; more than 1 if the vertices asked for hardly suffice.
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
    /// Sites with special faces after the last iteration.
    pub flags: FlagCounts,
    /// What connecting met.
    pub connected: ConnectCounts,
    /// What the last exact cells were; `None` but with [`Method::Exact`].
    pub exact: Option<ExactSummary>,
    /// How evenly the vertices are spread over the cleaned input, with [`Method::Exact`] if everything is measured.
    pub energy: Option<Energy>,
    /// What was held of sharp and open edges; `None` but with [`Method::CoarseToFine`], which alone looks
    /// for them.
    pub skeleton: Option<SkeletonSummary>,
    /// What could not be done; empty for a valid result.
    pub warnings: Vec<String>,
    /// Where the time went.
    pub timings: RunTimings,
}

/// Sharp and open edges of the input, and the sites that hold them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct SkeletonSummary {
    /// Chains of sharp, open and other edges that are held.
    pub curves: usize,
    /// Vertices where curves end, branch or turn.
    pub corners: usize,
    /// Parts of the surface between the curves.
    pub patches: usize,
    /// Vertices of the result on curves.
    pub curve_sites: usize,
}

impl SkeletonSummary {
    fn of(skeleton: &Skeleton) -> Self {
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

/// Remeshes `mesh` on `device`; `progress` is called several times a second, but not while the input is prepared. It may
/// give nothing, or what to do next as a [`Flow`].
///
/// # Errors
/// [`Error::Usage`] for options out of range, [`Error::Input`] for a mesh without area, [`Error::Cancelled`] if
/// `progress` asks for it, and the device's errors.
pub fn remesh<F: Into<Flow>>(
    device: &Device,
    mesh: &TriMesh,
    options: &Options,
    progress: &mut dyn FnMut(Progress) -> F,
) -> Result<Remeshed> {
    options.validate()?;
    watched(device, mesh, options, &mut Watch::new(&mut |now| progress(now).into()))
}

fn watched(device: &Device, mesh: &TriMesh, options: &Options, watch: &mut Watch) -> Result<Remeshed> {
    watch.look()?;
    // Earlier runs on the same device do not count.
    device.take_timings();
    let mut clock = Clock::new();
    // What the driver makes of the kernels does not depend on the mesh.
    let (compiled, prepared) =
        rayon::join(|| compile(device, options.method), || prepare(device, mesh, options));
    let Prepared { repaired, frame, input, surface, ground } = prepared?;
    compiled?;
    clock.phase("prepare");
    let spacing = spacing(surface.area(), options.vertices);
    let mut exact = None;
    let Settled { connection, steps, skeleton, vertices: wanted, attempts } = match ground {
        None => {
            let on = (&surface, &input, spacing);
            let (connection, steps, last) = all_at_once(device, options, on, watch, &mut clock)?;
            exact = last;
            Settled { connection, steps, skeleton: None, vertices: options.vertices, attempts: 1 }
        }
        Some(ground) => {
            let (mesh, surface) = (&repaired.mesh, &surface);
            Attempts { device, mesh, frame: &frame, surface, input: &input, options }
                .run(ground, watch, &mut clock)?
        }
    };
    let Connection { sites, triangles, curve_sites, counts: connected, flags, fault, crossing } = connection;
    if triangles.is_empty() {
        return Err(Error::input(
            None,
            format!("{} sites are too few to connect this surface", options.vertices),
            "ask for more vertices",
        ));
    }
    let vertices = sites.into_iter().map(|p| frame.from_unit(p)).collect();
    let result = TriMesh { vertices, triangles };
    clock.phase("connect");
    watch.phase(Phase::Measure, 1.0, 0.0)?;
    let (output, energy) = measured(&result, &repaired.mesh, options, crossing, exact.is_some())?;
    clock.phase("measure");
    watch.done(1.0)?;
    let summary = Summary {
        repaired: repaired.counts,
        warnings: warnings(
            options,
            wanted,
            &input,
            &output,
            &connected,
            &flags,
            fault.map(|f| f.in_words(&frame)),
        ),
        input,
        output,
        attempts,
        iterations: steps.len() as u32,
        converged: steps.last().is_some_and(|s| *s < options.tolerance),
        finished_early: watch.is_cut(),
        steps,
        spacing: spacing * frame.scale,
        flags,
        connected,
        exact,
        energy,
        skeleton: skeleton.map(|found| SkeletonSummary { curve_sites, ..found }),
        timings: RunTimings {
            stages: device.take_timings(),
            wall_milliseconds: clock.phases.iter().map(|p| p.milliseconds).sum(),
            phases: clock.phases,
            peak_device_bytes: device.peak_bytes(),
        },
    };
    Ok(Remeshed { mesh: result, summary })
}

/// The pipelines that have all sites from the start, at random: the connected sites, the steps, and the last exact cells.
fn all_at_once(
    device: &Device,
    options: &Options,
    (surface, input, spacing): (&Surface, &Topology, f64),
    watch: &mut Watch,
    clock: &mut Clock,
) -> Result<(Connection, Vec<f64>, Option<ExactSummary>)> {
    let seeds = seed::random(surface, options.vertices, options.seed);
    clock.phase("seed");
    if options.method == Method::Exact {
        let on = (surface, &seeds, spacing);
        let (connection, steps, last) = exact::run(device, options, on, watch, clock)?;
        return Ok((connection, steps, Some(last)));
    }
    let run = rtf::Run::new(device, options, surface, &seeds, spacing)?;
    clock.phase("compile");
    let steps = run.iterate(device, surface, options, watch)?;
    clock.phase("iterate");
    Ok((run.connect(device, surface, input)?, steps, None))
}

/// The figures of a result; how evenly its vertices are spread over the input, if that is `wanted` and all is measured.
fn measured(
    result: &TriMesh,
    input: &TriMesh,
    options: &Options,
    crossing: Option<usize>,
    wanted: bool,
) -> Result<(Measures, Option<Energy>)> {
    let depth = options.measures;
    let reference = (depth >= MeasureDepth::Full).then_some(input);
    let crossing = match crossing {
        Some(known) => Crossing::Known(known),
        None if depth >= MeasureDepth::Intersections => Crossing::Find,
        None => Crossing::Skip,
    };
    let spread = reference.filter(|_| wanted).map(|reference| energy(reference, &result.vertices));
    Ok((measure_some(result, reference, crossing)?, spread.transpose()?))
}

/// The input, ready for a run.
struct Prepared {
    repaired: Repaired,
    frame: Frame,
    input: Topology,
    surface: Surface,
    /// For [`Method::CoarseToFine`] only.
    ground: Option<Ground>,
}

fn prepare(device: &Device, mesh: &TriMesh, options: &Options) -> Result<Prepared> {
    let repaired = repair(mesh)?;
    let frame = Frame::of(&repaired.mesh)?;
    check_memory(device, options)?;
    let (input, surface) =
        rayon::join(|| topology(&repaired.mesh), || Surface::new(device, &repaired.mesh, &frame));
    let surface = surface?;
    let ground = match options.method {
        Method::CoarseToFine => Some(ground(device, &repaired.mesh, &surface, options)?),
        Method::Rtf | Method::Exact => None,
    };
    Ok(Prepared { repaired, frame, input, surface, ground })
}

/// What the default pipeline needs of a surface, which is that of `mesh`, for as many vertices.
fn ground(device: &Device, mesh: &TriMesh, surface: &Surface, options: &Options) -> Result<Ground> {
    let user_edges = user_edges_on(surface, mesh, options)?;
    let spacing = spacing(surface.area(), options.vertices);
    let wanted = SkeletonOptions { feature_angle: options.feature_angle, spacing, user_edges };
    Ground::new(device, surface, &wanted)
}

/// The user's curves as edges of the surface, which has the mesh's triangles in their order, but not its vertices.
fn user_edges_on(surface: &Surface, mesh: &TriMesh, options: &Options) -> Result<Vec<[u32; 2]>> {
    let mut place = vec![0; mesh.vertices.len()];
    for (from, to) in mesh.triangles.as_flattened().iter().zip(surface.triangles.as_flattened()) {
        place[*from as usize] = *to;
    }
    Ok(wanted_edges(mesh, options)?.into_iter().map(|edge| edge.map(|v| place[v as usize])).collect())
}

/// The edges of `mesh` that the user's curves run along.
fn wanted_edges(mesh: &TriMesh, options: &Options) -> Result<Vec<[u32; 2]>> {
    let Some(features) = &options.features else { return Ok(Vec::new()) };
    user_edges(mesh, &features.lines).map_err(|error| match &features.file {
        Some(file) => error.in_file(file),
        None => error,
    })
}

/// Compiles the kernels of the default pipeline; the others do so themselves.
fn compile(device: &Device, method: Method) -> Result<()> {
    match method {
        Method::CoarseToFine => level::Level::compile(device),
        Method::Rtf | Method::Exact => Ok(()),
    }
}

/// Device bytes that a site takes in the largest buffer, and in all.
fn device_bytes_per_site(options: &Options) -> (u64, u64) {
    match options.method {
        // The list; six vectors, two reaches, eight words, and the boxes.
        Method::CoarseToFine => {
            (4 * u64::from(level::LIST), 4 * u64::from(level::LIST) + 6 * 16 + 2 * 8 + 8 * 4 + 5)
        }
        // Parts of triangles, some ten a site; the list; vectors, reaches, words and boxes.
        Method::Exact => {
            let list = 4 * u64::from(level::LIST);
            (10 * 16, 10 * 44 + list + 6 * 16 + 2 * 8 + 8 * 4 + 5)
        }
        // Corners of two floats; their fan; both lists; five vectors; triangle, count and flags.
        Method::Rtf => {
            let corners = u64::from(cell::Constants::default().max_corners);
            let k_sites = u64::from(options.k_clip.max(options.k_normal - 1));
            let lists = 4 * (k_sites + u64::from(options.k_project));
            ((8 * corners).max(4 * k_sites), 12 * corners + lists + 5 * 16 + 3 * 4)
        }
    }
}

/// Refuses a count whose largest buffers cannot exist, before anything of that size is made.
fn check_memory(device: &Device, options: &Options) -> Result<()> {
    let limits = &device.info().limits;
    let sites = options.vertices as u64;
    let (in_one, in_all) = device_bytes_per_site(options);
    let (largest, total) = (sites * in_one, sites * in_all);
    let refuse = |what: &str, bytes: u64, limit: u64, of: &str| {
        Err(Error::OutOfMemory {
            what: what.to_owned(),
            bytes,
            problem: format!("but device '{}' has {limit} {of}", device.info().name),
            remedy: format!("ask for at most {} vertices, or use a larger device", sites * limit / bytes),
        })
    };
    if largest > limits.storage_buffer_bytes {
        return refuse("one list of all sites", largest, limits.storage_buffer_bytes, "in one buffer");
    }
    if total > limits.memory_bytes {
        return refuse("the run", total, limits.memory_bytes, "in all");
    }
    Ok(())
}

/// Sites, in the unit-diagonal frame, and the triangles over them.
pub(crate) struct Connection {
    sites: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// How many sites are on curves.
    curve_sites: usize,
    counts: ConnectCounts,
    flags: FlagCounts,
    fault: Option<Fault>,
    /// Faces that run through others, where that is known.
    crossing: Option<usize>,
}

fn warnings(
    options: &Options,
    wanted: usize,
    input: &Topology,
    output: &Measures,
    connected: &ConnectCounts,
    flags: &FlagCounts,
    fault: Option<String>,
) -> Vec<String> {
    let got = &output.topology;
    let mut list = Vec::new();
    let mut say = |bad: bool, text: String| {
        if bad {
            list.push(text);
        }
    };
    let lost = flags.triangle_overflow + flags.plane_overflow + flags.corner_overflow + flags.badly_closed;
    say(lost > 0, format!("{lost} sites have no face (see flags in the report)"));
    say(
        options.method != Method::CoarseToFine && !input.is_closed_manifold(),
        "the input is not a closed manifold; this preset connects closed surfaces only".into(),
    );
    say(
        connected.unfilled_faces > 0,
        format!("{} faces could not be filled and are holes", connected.unfilled_faces),
    );
    say(got.vertices != wanted, format!("the result uses {} of {wanted} vertices", got.vertices));
    say(
        input.is_closed_manifold() && !got.is_closed_manifold(),
        "the result is not a closed manifold".into(),
    );
    say(
        (got.components, got.euler, got.boundary_loops)
            != (input.components, input.euler, input.boundary_loops),
        format!(
            "topology differs: {} components, Euler characteristic {}, {} boundary loops instead of {}, {}, {}",
            got.components,
            got.euler,
            got.boundary_loops,
            input.components,
            input.euler,
            input.boundary_loops
        ),
    );
    list.extend(fault);
    list
}

struct Clock {
    last: Instant,
    phases: Vec<PhaseTime>,
}

impl Clock {
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
