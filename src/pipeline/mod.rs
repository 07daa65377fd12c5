//! The run: seed, iterate, connect, measure.

mod coarse_to_fine;
mod holes;
mod level;
mod parts;
mod plan;
mod refine;
#[cfg(test)]
mod relaxing;
mod rtf;
mod spare;

use crate::gpu::kernels::face::cell;
use crate::gpu::{Device, StageTime};
use crate::measure::{Measures, measure_some};
use crate::mesh::coarsen::Site;
use crate::mesh::frame::Frame;
use crate::mesh::intersections::intersecting_faces;
use crate::mesh::repair::{RepairCounts, RepairOptions, Repaired, repair_with};
use crate::mesh::skeleton::{Skeleton, SkeletonOptions, user_edges};
use crate::mesh::spacing;
use crate::mesh::topology::{Topology, topology};
use crate::options::{MeasureDepth, Method, Options};
use crate::stages::connect::ConnectCounts;
use crate::stages::face::FlagCounts;
use crate::stages::seed;
use crate::stages::surface::Surface;
use crate::{Error, Result, TriMesh};
use coarse_to_fine::{CoarseToFine, Ground};
use parts::{Divided, Parts, append, extract};
use serde::Serialize;
use spare::Wish;
use std::time::Instant;

/// Where a run is, for a progress display.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Iterations done.
    pub iteration: u32,
    /// Most iterations.
    pub iterations: u32,
    /// Root mean square step of the last iteration in spacings.
    pub step: f64,
}

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
    /// Faces of the cleaned input that intersect others; `None` if the result's are not measured either.
    pub input_self_intersecting_faces: Option<usize>,
    /// How many components were made by collapsing edges: too few vertices for cells, or cells without their topology.
    pub collapsed_components: usize,
    /// What was odd about the input and what was done about it, in words.
    pub remarks: Vec<String>,
    /// Figures of the result as far as [`Options::measures`] asks for them, distances against the cleaned input.
    pub output: Measures,
    /// Iterations done.
    pub iterations: u32,
    /// Whether the step fell below the tolerance.
    pub converged: bool,
    /// Root mean square step of every iteration, in spacings.
    pub steps: Vec<f64>,
    /// Edge length of a perfect layout in the input's units.
    pub spacing: f64,
    /// Sites with special faces after the last iteration.
    pub flags: FlagCounts,
    /// What connecting met.
    pub connected: ConnectCounts,
    /// What was held of sharp and open edges; `None` with [`Method::Rtf`], which looks for none.
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

/// Remeshes `mesh` on `device`; `progress` is called every few iterations.
///
/// # Errors
/// [`Error::Usage`] for options out of range, [`Error::Input`] for a mesh without area, and the device's errors.
pub fn remesh(
    device: &Device,
    mesh: &TriMesh,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Remeshed> {
    options.validate()?;
    // Earlier runs on the same device do not count.
    device.take_timings();
    let mut clock = Clock::new();
    // What the driver makes of the kernels does not depend on the mesh.
    let (compiled, prepared) =
        rayon::join(|| compile(device, options.method), || prepare(device, mesh, options));
    let prepared = prepared?;
    compiled?;
    clock.phase("prepare");
    let (mut connection, steps) = connection(device, &prepared, options, progress, &mut clock)?;
    let Prepared { repaired, frame, input, surface, ground, divided, .. } = prepared;
    let spacing = spacing(surface.area(), divided.left);
    let skeleton = ground.as_ref().map(|ground| ground.skeleton);
    if connection.mesh.triangles.is_empty() {
        return Err(Error::input(
            None,
            format!("{} sites are too few to connect this surface", options.vertices),
            "ask for more vertices",
        ));
    }
    divided.small.iter().for_each(|part| append(&mut connection.mesh, part));
    let Connection { mesh: mut result, curve_sites, counts: connected, flags, collapsed, .. } = connection;
    result.vertices.iter_mut().for_each(|p| *p = frame.from_unit(*p));
    clock.phase("connect");
    let depth = options.measures;
    let reference = (depth >= MeasureDepth::Full).then_some(&repaired.mesh);
    let output = measure_some(&result, reference, depth >= MeasureDepth::Intersections)?;
    let crossing = (depth >= MeasureDepth::Full).then(|| intersecting_faces(&repaired.mesh).len());
    clock.phase("measure");
    let summary = Summary {
        remarks: remarks(&repaired.counts, &input, crossing, collapsed + divided.small.len()),
        input_self_intersecting_faces: crossing,
        collapsed_components: collapsed + divided.small.len(),
        repaired: repaired.counts,
        warnings: warnings(options, &input, &output, &connected, &flags),
        input,
        output,
        iterations: steps.len() as u32,
        converged: steps.last().is_some_and(|s| *s < options.tolerance),
        steps,
        spacing: spacing * frame.scale,
        flags,
        connected,
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

/// The result on the large components, in the unit-diagonal frame.
fn connection(
    device: &Device,
    prepared: &Prepared,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
    clock: &mut Clock,
) -> Result<(Connection, Vec<f64>)> {
    let Prepared { surface, ground, large, large_input, parts, divided, .. } = prepared;
    let Some(ground) = ground else {
        let seeds = seed::random(surface, options.vertices, options.seed);
        clock.phase("seed");
        let run = rtf::Run::new(device, options, surface, &seeds, spacing(surface.area(), options.vertices))?;
        clock.phase("compile");
        let steps = run.iterate(device, surface, options, progress)?;
        clock.phase("iterate");
        return Ok((run.connect(device, surface, large_input)?, steps));
    };
    let wish = Wish { vertices: divided.left, ..Wish::of(options, spacing(surface.area(), divided.left)) };
    let options = Options {
        vertices: divided.left,
        coarsest: options.coarsest.max(divided.coarsest),
        ..options.clone()
    };
    let run = CoarseToFine { device, surface, ground, input: large_input, options: &options };
    match run.run(progress, clock) {
        Ok((mut connection, steps)) => {
            connection.collapsed = parts.mend(large, &mut connection.mesh, &connection.on_surface, &wish)?;
            if connection.collapsed > 0 {
                // They were in those components, since a hole changes the topology.
                connection.counts.unfilled_faces = 0;
            }
            Ok((connection, steps))
        }
        // Sharp edges need more than there are.
        Err(error @ Error::Usage { .. }) if options.features.is_none() => {
            let mesh = parts.whole(large, &wish).map_err(|_| error)?;
            Ok((Connection { mesh, collapsed: parts.count(), ..Connection::default() }, Vec::new()))
        }
        Err(error) => Err(error),
    }
}

/// The input, ready for a run.
struct Prepared {
    repaired: Repaired,
    frame: Frame,
    input: Topology,
    /// What is not too small for cells, in the unit-diagonal frame, with its topology and components.
    large: TriMesh,
    large_input: Topology,
    parts: Parts,
    divided: Divided,
    /// The same for the device.
    surface: Surface,
    /// For [`Method::CoarseToFine`] only.
    ground: Option<Ground>,
}

fn prepare(device: &Device, mesh: &TriMesh, options: &Options) -> Result<Prepared> {
    let wanted = RepairOptions { weld: options.weld, min_component: options.min_component };
    let repaired = repair_with(mesh, &wanted)?;
    let frame = Frame::of(&repaired.mesh)?;
    check_memory(device, options)?;
    let mut unit = repaired.mesh.clone();
    unit.vertices.iter_mut().for_each(|p| *p = frame.to_unit(*p));
    let parts = Parts::new(&unit);
    // The user's lines may be on a small component, and the paper knows none.
    let all = options.method == Method::Rtf || options.features.is_some() || parts.count() == 1;
    let divided = if all {
        Divided {
            large: (0..unit.triangles.len() as u32).collect(),
            small: Vec::new(),
            left: options.vertices,
            coarsest: 0,
        }
    } else {
        parts.divide(&unit, &Wish::of(options, spacing(parts.area(), options.vertices)))?
    };
    let (large, parts, kept) = if divided.small.is_empty() {
        (unit, parts, repaired.mesh.clone())
    } else {
        let large = extract(&unit, &divided.large);
        let parts = Parts::new(&large);
        (large, parts, extract(&repaired.mesh, &divided.large))
    };
    let ((input, large_input), surface) =
        rayon::join(|| (topology(&repaired.mesh), topology(&large)), || Surface::new(device, &kept, &frame));
    let surface = surface?;
    let ground = match options.method {
        Method::CoarseToFine => {
            let user_edges = user_edges_on(&surface, &kept, options)?;
            let spacing = spacing(surface.area(), divided.left);
            let wanted = SkeletonOptions { feature_angle: options.feature_angle, spacing, user_edges };
            Some(Ground::new(device, &surface, &wanted)?)
        }
        Method::Rtf => None,
    };
    Ok(Prepared { repaired, frame, input, large, large_input, parts, divided, surface, ground })
}

/// The user's curves as edges of the surface, which has the mesh's triangles in their order, but not its vertices.
fn user_edges_on(surface: &Surface, mesh: &TriMesh, options: &Options) -> Result<Vec<[u32; 2]>> {
    let Some(features) = &options.features else { return Ok(Vec::new()) };
    let mut place = vec![0; mesh.vertices.len()];
    for (from, to) in mesh.triangles.as_flattened().iter().zip(surface.triangles.as_flattened()) {
        place[*from as usize] = *to;
    }
    let edges = user_edges(mesh, &features.lines).map_err(|e| match &features.file {
        Some(file) => e.in_file(file),
        None => e,
    })?;
    Ok(edges.into_iter().map(|edge| edge.map(|v| place[v as usize])).collect())
}

/// Compiles the kernels of the default pipeline; the other one does so itself.
fn compile(device: &Device, method: Method) -> Result<()> {
    match method {
        Method::CoarseToFine => level::Level::compile(device),
        Method::Rtf => Ok(()),
    }
}

/// Refuses a count whose largest buffers cannot exist, before anything of that size is made.
fn check_memory(device: &Device, options: &Options) -> Result<()> {
    let limits = &device.info().limits;
    let sites = options.vertices as u64;
    // Bytes a site.
    let (in_one, in_all) = match options.method {
        // The list; six vectors, two reaches, eight words, and the boxes.
        Method::CoarseToFine => {
            (4 * u64::from(level::LIST), 4 * u64::from(level::LIST) + 6 * 16 + 2 * 8 + 8 * 4 + 5)
        }
        // Corners of two floats; their fan; both lists; five vectors; triangle, count and flags.
        Method::Rtf => {
            let corners = u64::from(cell::Constants::default().max_corners);
            let k_sites = u64::from(options.k_clip.max(options.k_normal - 1));
            let lists = 4 * (k_sites + u64::from(options.k_project));
            ((8 * corners).max(4 * k_sites), 12 * corners + lists + 5 * 16 + 3 * 4)
        }
    };
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

/// A mesh in the unit-diagonal frame, and how it came about.
#[derive(Default)]
pub(crate) struct Connection {
    mesh: TriMesh,
    /// Where the vertices were on the surface; nothing from the paper's pipeline.
    on_surface: Vec<Site>,
    /// How many sites are on curves.
    curve_sites: usize,
    counts: ConnectCounts,
    flags: FlagCounts,
    /// Components that were made by collapsing edges.
    collapsed: usize,
}

/// What a user should know of the input, and of what it led to.
fn remarks(
    repaired: &RepairCounts,
    input: &Topology,
    crossing: Option<usize>,
    collapsed: usize,
) -> Vec<String> {
    let mut list = repaired.notes();
    let turned = input.inconsistent_edges.saturating_sub(input.nonmanifold_edges);
    let lines = [
        (input.nonmanifold_edges, "edges of the input with more than two faces stay junctions"),
        (input.nonmanifold_vertices, "vertices of the input where parts of the surface only touch"),
        (turned, "edges of the input with faces turned against each other"),
        (crossing.unwrap_or(0), "faces of the input intersect others"),
        (
            collapsed,
            "components made by collapsing edges: smaller, or with smaller details, than cells can keep",
        ),
    ];
    list.extend(lines.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}")));
    list
}

fn warnings(
    options: &Options,
    input: &Topology,
    output: &Measures,
    connected: &ConnectCounts,
    flags: &FlagCounts,
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
        options.method == Method::Rtf && !input.is_closed_manifold(),
        "the input is not a closed manifold; this preset connects closed surfaces only".into(),
    );
    say(
        connected.unfilled_faces > 0,
        format!("{} faces could not be filled and are holes", connected.unfilled_faces),
    );
    say(
        got.vertices != options.vertices,
        format!("the result uses {} of {} vertices", got.vertices, options.vertices),
    );
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
