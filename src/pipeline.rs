//! The run: seed, iterate, connect, measure.

use crate::gpu::kernels::face::cell;
use crate::gpu::{Buffer, Device, Recorder, StageTime};
use crate::measure::{Measures, measure};
use crate::mesh::frame::Frame;
use crate::mesh::repair::{RepairCounts, repair};
use crate::mesh::topology::{Topology, topology};
use crate::options::Options;
use crate::stages::cells::{CellSites, CellSurface, connected_cells};
use crate::stages::centroid::Centroids;
use crate::stages::connect::{ConnectCounts, Fans, clustered_fan, connect};
use crate::stages::face::{CellFaces, CellOptions, FlagCounts};
use crate::stages::neighbours::{Nearest, TileBounds};
use crate::stages::normals::PlaneFit;
use crate::stages::project::NearestVertices;
use crate::stages::seed::{self, Seeds};
use crate::stages::step::Step;
use crate::stages::surface::Surface;
use crate::{Error, Result, TriMesh};
use glam::{DVec3, Vec2, Vec4};
use serde::Serialize;
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
    /// Figures of the result, distances against the cleaned input.
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
    /// What could not be done; empty for a valid result.
    pub warnings: Vec<String>,
    /// Where the time went.
    pub timings: RunTimings,
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

/// Iterations between two looks at the step size.
const ITERATIONS_PER_SUBMISSION: u32 = 5;

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
    let repaired = repair(mesh)?;
    let frame = Frame::of(&repaired.mesh)?;
    let input = topology(&repaired.mesh);
    check_memory(device, options)?;
    clock.phase("prepare");
    let surface = Surface::new(device, &repaired.mesh, &frame)?;
    let seeds = seed::random(&surface, options.vertices, options.seed);
    let spacing = (2.0 * surface.area() / (3.0_f64.sqrt() * options.vertices as f64)).sqrt();
    clock.phase("seed");
    let run = Run::new(device, options, &surface, &seeds, spacing)?;
    clock.phase("compile");
    let steps = run.iterate(device, &surface, options, progress)?;
    clock.phase("iterate");
    let Connection { sites, triangles, counts: connected, flags } = run.connect(device, &surface, &input)?;
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
    let output = measure(&result, Some(&repaired.mesh))?;
    clock.phase("measure");
    let summary = Summary {
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
        timings: RunTimings {
            stages: device.take_timings(),
            wall_milliseconds: clock.phases.iter().map(|p| p.milliseconds).sum(),
            phases: clock.phases,
            peak_device_bytes: device.peak_bytes(),
        },
    };
    Ok(Remeshed { mesh: result, summary })
}

/// Refuses a count whose largest buffers cannot exist, before anything of that size is made.
fn check_memory(device: &Device, options: &Options) -> Result<()> {
    let limits = &device.info().limits;
    let sites = options.vertices as u64;
    let corners = u64::from(cell::Constants::default().max_corners);
    let k_sites = u64::from(options.k_clip.max(options.k_normal - 1));
    // Bytes a site: corners of two floats; their fan; both lists; five vectors; triangle, count and flags.
    let largest = sites * (8 * corners).max(4 * k_sites);
    let total = sites * (12 * corners + 4 * (k_sites + u64::from(options.k_project)) + 5 * 16 + 3 * 4);
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
struct Connection {
    sites: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    counts: ConnectCounts,
    flags: FlagCounts,
}

/// The stages of one run with their buffers.
struct Run {
    sites: Buffer<Vec4>,
    site_triangle: Buffer<u32>,
    site_tiles: TileBounds,
    vertex_tiles: TileBounds,
    near_sites: Nearest,
    normals: PlaneFit,
    faces: CellFaces,
    centroids: Centroids,
    near_vertices: Nearest,
    project: NearestVertices,
    step: Step,
    spacing: f64,
}

impl Run {
    fn new(
        device: &Device,
        options: &Options,
        surface: &Surface,
        seeds: &Seeds,
        spacing: f64,
    ) -> Result<Self> {
        let n = options.vertices;
        let sites: Vec<Vec4> = seeds.sites.iter().map(|p| p.as_vec3().extend(0.0)).collect();
        // One search serves normals and cells; the fit counts the site itself.
        let k_sites = options.k_clip.max(options.k_normal - 1);
        Ok(Self {
            sites: Buffer::from_slice(device, "rtf.sites", &sites)?,
            site_triangle: Buffer::from_slice(device, "rtf.site_triangle", &seeds.triangles)?,
            site_tiles: TileBounds::new(device, "rtf.neighbours.site_tiles", n)?,
            vertex_tiles: TileBounds::new(device, "rtf.neighbours.vertex_tiles", surface.vertices.len())?,
            near_sites: Nearest::new(device, "rtf.neighbours.sites", n, k_sites, true, None)?,
            normals: PlaneFit::new(device, n, options.k_normal, None)?,
            faces: CellFaces::new(device, n, &CellOptions::paper(k_sites, spacing))?,
            centroids: Centroids::new(device, n, options.centroid, None)?,
            near_vertices: Nearest::new(
                device,
                "rtf.neighbours.vertices",
                n,
                options.k_project,
                false,
                None,
            )?,
            project: NearestVertices::new(device, n, options.k_project, None)?,
            step: Step::new(device, n, options.iterations, None)?,
            spacing,
        })
    }

    /// Lloyd's iteration until the step is small; gives the root mean square steps in spacings.
    fn iterate(
        &self,
        device: &Device,
        surface: &Surface,
        options: &Options,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Vec<f64>> {
        let mut steps = Vec::new();
        let mut recorder = device.recorder()?;
        self.vertex_tiles.record(&mut recorder, &surface.device.vertices)?;
        recorder.submit()?;
        while (steps.len() as u32) < options.iterations {
            let begin = steps.len() as u32;
            let end = (begin + ITERATIONS_PER_SUBMISSION).min(options.iterations);
            let mut recorder = device.recorder()?;
            for iteration in begin..end {
                self.record_iteration(&mut recorder, surface, iteration)?;
            }
            let history = recorder.download(&self.step.history)?;
            let history: Vec<Vec2> = recorder.submit()?.read(&history)?;
            let new = &history[begin as usize..end as usize];
            steps.extend(new.iter().map(|s| f64::from(s.x) / self.spacing));
            let step = steps.last().copied().unwrap_or(0.0);
            progress(Progress { iteration: end, iterations: options.iterations, step });
            if step < options.tolerance {
                break;
            }
        }
        Ok(steps)
    }

    /// Neighbours → normals → face → centroid → project → step.
    fn record_iteration(&self, recorder: &mut Recorder, surface: &Surface, iteration: u32) -> Result<()> {
        let on = &surface.device;
        self.record_faces(recorder, surface)?;
        self.centroids.record(recorder, &self.sites, &self.normals.normals, &self.faces)?;
        self.near_vertices.record(recorder, &self.centroids.targets, &on.vertices, &self.vertex_tiles)?;
        let found = &self.near_vertices.neighbours;
        self.project.record(recorder, &self.centroids.targets, found, on, &self.site_triangle)?;
        self.step.record(recorder, &self.project.projected, &self.sites, iteration)
    }

    /// Neighbours → normals → face.
    fn record_faces(&self, recorder: &mut Recorder, surface: &Surface) -> Result<()> {
        let found = &self.near_sites.neighbours;
        self.site_tiles.record(recorder, &self.sites)?;
        self.near_sites.record(recorder, &self.sites, &self.sites, &self.site_tiles)?;
        self.normals.record(recorder, &self.sites, found, &self.site_triangle, &surface.device.normals)?;
        self.faces.record(
            recorder,
            &self.sites,
            &self.normals.normals,
            found,
            &self.site_tiles,
            &self.normals.flags,
        )
    }

    /// Connects the sites by the fans of their faces. Where that leaves a wrong topology, as it may at creases, which no
    /// tangent plane describes, exact connected cells decide, and the connection nearer to the input's topology is taken.
    fn connect(&self, device: &Device, surface: &Surface, input: &Topology) -> Result<Connection> {
        let found = self.faces(device, surface)?;
        let wrong = |triangles: &[[u32; 3]], counts: &ConnectCounts| {
            let got = topology(&TriMesh { vertices: found.sites.clone(), triangles: triangles.to_vec() });
            (got.euler - input.euler).unsigned_abs() as usize
                + got.components.abs_diff(input.components)
                + got.boundary_loops.abs_diff(input.boundary_loops)
                + got.nonmanifold_edges
                + got.nonmanifold_vertices
                + counts.unconnected_sites
        };
        let (mut triangles, mut counts) = connect(&found.sites, &found.fans);
        let wrong_by_fans = wrong(&triangles, &counts);
        if wrong_by_fans > 0 {
            let on = CellSurface::new(&surface.vertices, &surface.triangles, &surface.normals);
            let sites = CellSites {
                positions: &found.sites,
                triangles: &found.triangles,
                near: &found.near,
                spacing: self.spacing,
            };
            let cells = connected_cells(&on, &sites);
            let (by_cells, cell_counts) = connect(&found.sites, &cells.fans);
            if wrong(&by_cells, &cell_counts) < wrong_by_fans {
                triangles = by_cells;
                counts = ConnectCounts { cells: Some(cells.certificate), ..cell_counts };
            }
        }
        Ok(Connection { sites: found.sites, triangles, counts, flags: found.flags })
    }

    /// The faces of the sites as they are now.
    fn faces(&self, device: &Device, surface: &Surface) -> Result<FoundFaces> {
        let mut recorder = device.recorder()?;
        self.record_faces(&mut recorder, surface)?;
        let sites = recorder.download(&self.sites)?;
        let triangles = recorder.download(&self.site_triangle)?;
        let near = recorder.download(&self.near_sites.neighbours)?;
        let counts = recorder.download(&self.faces.corner_count)?;
        let corners = recorder.download(&self.faces.corners)?;
        let fan = recorder.download(&self.faces.fan)?;
        let flags = recorder.download(&self.normals.flags)?;
        let done = recorder.submit()?;
        let (counts, corners, fan) = (done.read(&counts)?, done.read(&corners)?, done.read(&fan)?);
        let n = counts.len();
        let slots = |i: usize| (0..counts[i] as usize).map(move |slot| slot * n + i);
        let fans = Fans::from_lists((0..n).map(|i| {
            let corners: Vec<Vec2> = slots(i).map(|s| corners[s]).collect();
            let fan: Vec<u32> = slots(i).map(|s| fan[s]).collect();
            clustered_fan(&corners, &fan)
        }));
        Ok(FoundFaces {
            sites: done.read(&sites)?.iter().map(|s: &Vec4| s.truncate().as_dvec3()).collect(),
            triangles: done.read(&triangles)?,
            near: done.read(&near)?,
            fans,
            flags: FlagCounts::of(&done.read(&flags)?),
        })
    }
}

/// What connecting starts from.
struct FoundFaces {
    sites: Vec<DVec3>,
    triangles: Vec<u32>,
    near: Vec<u32>,
    fans: Fans,
    flags: FlagCounts,
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
        !input.is_closed_manifold(),
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
        self.phases.push(PhaseTime { name, milliseconds: (now - self.last).as_secs_f64() * 1e3 });
        self.last = now;
    }
}
