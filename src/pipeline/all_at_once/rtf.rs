//! All sites from the start, with faces in tangent planes: the paper's pipeline, and its variants with other
//! stages.

use super::projection::SiteProjection;
use super::unused::place_unused;
use crate::gpu::{Buffer, Device, Recorder};
use crate::mesh::sizing::SizeField;
use crate::mesh::topology::{Topology, topology};
use crate::mesh::triangle::{closest_on_triangle, doubled_normal};
use crate::options::Options;
use crate::options::{Face, Neighbours};
use crate::pipeline::near_sites::near_sites;
use crate::pipeline::outcome::{Fault, Outcome};
use crate::pipeline::submission::{Pace, require_moves};
use crate::progress::ProgressReporter;
use crate::sites::cells::{CellSites, CellSurface, connected_cells};
use crate::sites::connect::{ConnectCounts, connect};
use crate::sites::fans::{Fans, clustered_fan};
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::place::Place;
use crate::sites::surface::Surface;
use crate::stages::centroid::Centroids;
use crate::stages::face::cell::{CellFaces, CellOptions, CellWeights};
use crate::stages::face::power::PowerOptions;
use crate::stages::flags::FlagCounts;
use crate::stages::neighbours::knn::{Nearest, TileBounds};
use crate::stages::neighbours::lists::{ListOptions, Lists};
use crate::stages::sizing::{AttachedLengths, DeviceSizes};
use crate::stages::step::Step;
use crate::{Result, TriMesh};
use glam::{DVec3, Vec2, Vec4};

/// Iterations between two checks of the step size.
const ITERATIONS_PER_SUBMISSION: u32 = 5;
/// Straight across a bend, edge lengths change faster than along the surface.
const STEEPER: f64 = 1.5;

/// The stages of one run with their buffers.
pub(crate) struct PlaneFacesRun {
    sites: Buffer<Vec4>,
    site_tiles: TileBounds,
    near_sites: Search,
    projection: SiteProjection,
    faces: CellFaces,
    centroids: Centroids,
    step: Step,
    spacing: f64,
    /// The edge lengths by which sites are weighted; `None` if they are equal.
    lengths: Option<AttachedLengths>,
    /// Whether the faces themselves are part of the outcome.
    gives_faces: bool,
}

/// How the nearest sites are found.
enum Search {
    Brute(Nearest),
    Lists(Box<Lists>),
}

impl Search {
    fn new(device: &Device, options: &Options) -> Result<Self> {
        let (n, k) = (options.vertices, options.all_at_once.neighbour_count());
        Ok(match options.all_at_once.neighbours {
            Neighbours::Brute => Self::Brute(Nearest::new(device, "rtf.neighbours.sites", n, k, true, None)?),
            Neighbours::Lists => Self::Lists(Box::new(Lists::new(device, n, &ListOptions::new(k))?)),
        })
    }

    /// Lists are built again each time, since cells need the nearest sites in order.
    fn record(&self, recorder: &mut Recorder, sites: &Buffer<Vec4>, tiles: &TileBounds) -> Result<()> {
        match self {
            Self::Brute(nearest) => nearest.record(recorder, sites, sites, tiles),
            Self::Lists(lists) => lists.record_build(recorder, sites),
        }
    }

    fn neighbours(&self) -> Result<&Buffer<u32>> {
        match self {
            Self::Brute(nearest) => Ok(&nearest.neighbours),
            Self::Lists(lists) => lists.neighbours.whole(),
        }
    }
}

impl PlaneFacesRun {
    pub fn new(
        device: &Device,
        options: &Options,
        surface: &Surface,
        seeds: &SitesOnSurface,
        (spacing, sizes): (f64, &SizeField),
    ) -> Result<Self> {
        let n = options.vertices;
        let sites: Vec<Vec4> = seeds.positions.iter().map(|p| p.as_vec3().extend(0.0)).collect();
        let (k_sites, growth) = (options.all_at_once.neighbour_count(), options.coarse_to_fine.growth);
        let faces = if options.all_at_once.face == Face::Power {
            CellFaces::power(device, n, &PowerOptions::new(k_sites, spacing, options.all_at_once.offset))?
        } else {
            let weights = CellWeights::balanced(options.all_at_once.centroid, STEEPER * growth);
            let weights = (!sizes.is_uniform()).then_some(weights);
            CellFaces::new(device, n, &CellOptions { weights, ..CellOptions::paper(k_sites, spacing) })?
        };
        let lengths = DeviceSizes::new(device, sizes)?;
        let lengths = lengths.map(|lengths| AttachedLengths::new(device, lengths, None)).transpose()?;
        Ok(Self {
            sites: Buffer::from_slice(device, "rtf.sites", &sites)?,
            site_tiles: TileBounds::new(device, "rtf.neighbours.site_tiles", n)?,
            near_sites: Search::new(device, options)?,
            projection: SiteProjection::new(device, options, surface, seeds)?,
            faces,
            centroids: Centroids::new(device, n, options.all_at_once.centroid, None)?,
            step: Step::new(device, n, options.iterations, None)?,
            spacing,
            lengths,
            gives_faces: options.cells,
        })
    }

    /// Lloyd's iteration until the step is small; returns the root mean square step of each iteration, in
    /// spacings.
    pub fn iterate(
        &self,
        device: &Device,
        options: &Options,
        progress: &mut ProgressReporter,
    ) -> Result<Vec<f64>> {
        let mut pace = Pace::new(options.vertices, ITERATIONS_PER_SUBMISSION);
        let mut steps = Vec::new();
        self.projection.begin(device, &self.sites)?;
        while (steps.len() as u32) < options.iterations {
            let begin = steps.len() as u32;
            let check = (begin / ITERATIONS_PER_SUBMISSION + 1) * ITERATIONS_PER_SUBMISSION;
            let end = (begin + pace.iterations).min(check).min(options.iterations);
            pace.begin();
            let mut recorder = Recorder::new(device)?;
            if begin == 0 {
                self.step.record_begin(&mut recorder)?;
            }
            for iteration in begin..end {
                self.record_iteration(&mut recorder, iteration)?;
            }
            let history = recorder.download(&self.step.history)?;
            let history: Vec<Vec2> = recorder.submit()?.read(&history)?;
            pace.end(end - begin);
            let new = &history[begin as usize..end as usize];
            steps.extend(new.iter().map(|s| f64::from(s.x) / self.spacing));
            let step = steps.last().copied().unwrap_or(0.0);
            progress.iterated(end, options.iterations, step)?;
            let converged = end == check && step < options.tolerance;
            if converged || (end < options.iterations && progress.leave_out()) {
                break;
            }
        }
        require_moves(device, &steps)?;
        Ok(steps)
    }

    /// Neighbours → normals → face → centroid → project → step.
    fn record_iteration(&self, recorder: &mut Recorder, iteration: u32) -> Result<()> {
        self.record_faces(recorder)?;
        self.centroids.record(recorder, &self.sites, self.projection.normals(), &self.faces)?;
        let projected = self.projection.record(recorder, &self.centroids.targets)?;
        self.step.record(recorder, projected, &self.sites, iteration)
    }

    /// Neighbours → normals → face.
    fn record_faces(&self, recorder: &mut Recorder) -> Result<()> {
        if let Some(lengths) = &self.lengths {
            lengths.record(recorder, &self.sites, self.projection.site_triangle())?;
        }
        self.site_tiles.record(recorder, &self.sites)?;
        self.near_sites.record(recorder, &self.sites, &self.site_tiles)?;
        let neighbours = self.near_sites.neighbours()?;
        self.projection.record_planes(recorder, &self.sites, neighbours)?;
        let (normals, flags) = (self.projection.normals(), self.projection.flags());
        self.faces.record(recorder, &self.sites, normals, neighbours, &self.site_tiles, flags)
    }

    /// Connects the sites by the fans of their faces. If that gives a wrong topology or folds, as it may at
    /// creases, which tangent planes do not describe, exact connected cells are tried, and the result with
    /// fewer errors is taken.
    pub fn connect(
        &self,
        device: &Device,
        (surface, sizes): (&Surface, &SizeField),
        input: &Topology,
        progress: &mut ProgressReporter,
    ) -> Result<Outcome> {
        let faces = self.faces(device, surface)?;
        let errors = |triangles: &[[u32; 3]], counts: &ConnectCounts| {
            let mesh = TriMesh { vertices: faces.sites.positions.clone(), triangles: triangles.to_vec() };
            let got = topology(&mesh);
            let of_topology = (got.euler - input.euler).unsigned_abs() as usize
                + got.components.abs_diff(input.components)
                + got.boundary_loops.abs_diff(input.boundary_loops)
                + got.nonmanifold_edges
                + got.nonmanifold_vertices
                + counts.unconnected_sites;
            // Compared in this order.
            (of_topology, folded_triangles(&mesh, surface, &faces.sites.triangles))
        };
        let (mut triangles, mut counts) = connect(&faces.sites.positions, &faces.fans);
        let mut faulty_place = None;
        let errors_by_fans = errors(&triangles, &counts);
        if errors_by_fans > (0, 0) {
            let on = CellSurface::new(&surface.vertices, &surface.triangles, &surface.normals);
            // Sites on planes may be so far from the surface that another one is nearer to the point under
            // them; their cells would be empty, and they would be lost.
            let positions = &on_triangles(surface, &faces.sites);
            let sites = CellSites {
                positions,
                places: &Place::inside(&faces.sites.triangles),
                near: &near_sites(device, positions)?,
                spacing: self.spacing,
                lengths: &sizes.at_all(positions, &faces.sites.triangles),
            };
            let cells = progress.during(|progress| connected_cells(&on, &sites, progress))?;
            faulty_place = cells.broken.first().map(|broken| broken.farthest.0);
            let (by_cells, cell_counts) = cells.connect(&faces.sites.positions);
            if errors(&by_cells, &cell_counts) <= errors_by_fans {
                (triangles, counts) = (by_cells, cell_counts);
            }
        }
        let mut mesh = TriMesh { vertices: faces.sites.positions, triangles };
        if counts.unconnected_sites > 0 {
            place_unused(&mut mesh, &surface.mesh(), &surface.normals);
        }
        let fault = Fault::topology(&mesh, input, faulty_place);
        let (flags, tangent_faces) = (faces.flags, self.gives_faces.then_some(faces.polygons));
        Ok(Outcome { mesh, fault, counts, flags, tangent_faces, ..Outcome::default() })
    }

    /// The faces of the sites as they are now.
    fn faces(&self, device: &Device, surface: &Surface) -> Result<SiteFaces> {
        let mut recorder = Recorder::new(device)?;
        self.record_faces(&mut recorder)?;
        let positions = recorder.download(&self.sites)?;
        let counts = recorder.download(&self.faces.corner_count)?;
        let corners = recorder.download(&self.faces.corners)?;
        let fan = recorder.download(&self.faces.fan)?;
        let flags = recorder.download(self.projection.flags())?;
        let normals = recorder.download(self.projection.normals())?;
        let downloads = recorder.submit()?;
        let (counts, corners, fan) =
            (downloads.read(&counts)?, downloads.read(&corners)?, downloads.read(&fan)?);
        let n = counts.len();
        let slots = |i: usize| (0..counts[i] as usize).map(move |slot| slot * n + i);
        let fans = Fans::from_lists((0..n).map(|i| {
            let corners: Vec<Vec2> = slots(i).map(|s| corners[s]).collect();
            let fan: Vec<u32> = slots(i).map(|s| fan[s]).collect();
            clustered_fan(&corners, &fan)
        }));
        let positions: Vec<DVec3> =
            downloads.read(&positions)?.iter().map(|s: &Vec4| s.truncate().as_dvec3()).collect();
        let normals: Vec<Vec4> = downloads.read(&normals)?;
        let polygon = |i: usize| {
            let (u, v) = tangent_frame(normals[i].truncate().as_dvec3());
            let place =
                |slot: usize| positions[i] + u * f64::from(corners[slot].x) + v * f64::from(corners[slot].y);
            slots(i).map(place).collect()
        };
        let polygons = if self.gives_faces { (0..n).map(polygon).collect() } else { Vec::new() };
        let triangles = self.projection.triangles(device, surface, &positions)?;
        Ok(SiteFaces {
            sites: SitesOnSurface { positions, triangles },
            fans,
            polygons,
            flags: FlagCounts {
                walk_stopped: self.projection.stopped_walks(device)?,
                ..FlagCounts::of(&downloads.read(&flags)?)
            },
        })
    }
}

/// The triangles of a mesh of sites that face away from the surface's triangle under one of their corners.
fn folded_triangles(mesh: &TriMesh, surface: &Surface, under: &[u32]) -> usize {
    let is_folded = |t: &usize| {
        let normal = doubled_normal(mesh.corners(*t));
        mesh.triangles[*t].iter().any(|v| normal.dot(surface.normals[under[*v as usize] as usize]) < 0.0)
    };
    (0..mesh.triangles.len()).filter(is_folded).count()
}

/// The points of the sites' triangles closest to them.
fn on_triangles(surface: &Surface, sites: &SitesOnSurface) -> Vec<DVec3> {
    let corners = |t: u32| surface.triangles[t as usize].map(|v| surface.vertices[v as usize]);
    let closest = |(p, t): (&DVec3, &u32)| closest_on_triangle(*p, corners(*t)).point;
    sites.positions.iter().zip(&sites.triangles).map(closest).collect()
}

/// The sites with their faces, to be connected.
struct SiteFaces {
    sites: SitesOnSurface,
    fans: Fans,
    /// The faces themselves.
    polygons: Vec<Vec<DVec3>>,
    flags: FlagCounts,
}

/// The frame of `glsl/common/tangent.glsl`.
fn tangent_frame(n: DVec3) -> (DVec3, DVec3) {
    let s = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), DVec3::new(b, s + n.y * n.y * a, -n.y))
}
