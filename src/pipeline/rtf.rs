//! The paper's pipeline: brute-force neighbours, plane-fit normals, cells in space, Lloyd's iteration; and those that it
//! compares with, of which one has other faces and one another surface.

use super::Connection;
use super::exact::under;
use super::pace::Pace;
use super::plan::LevelPlan;
use super::shares::Shares;
use crate::gpu::{Buffer, Device, Recorder};
use crate::mesh::topology::{Topology, topology};
use crate::options::{Method, Options};
use crate::stages::best_fit::BestFit;
use crate::stages::cells::{CellSites, CellSurface, connected_cells};
use crate::stages::centroid::Centroids;
use crate::stages::connect::{ConnectCounts, Fans, clustered_fan, connect};
use crate::stages::face::{CellFaces, CellOptions, FlagCounts, PowerOptions};
use crate::stages::neighbours::{Nearest, TileBounds};
use crate::stages::normals::PlaneFit;
use crate::stages::place::Place;
use crate::stages::project::NearestVertices;
use crate::stages::seed::Seeds;
use crate::stages::step::Step;
use crate::stages::surface::{Surface, SurfaceBuffers};
use crate::watch::Watch;
use crate::{Phase, Result, TriMesh};
use glam::{DVec3, Vec2, Vec4};

/// Iterations between two looks at the step size.
const ITERATIONS_PER_SUBMISSION: u32 = 5;

/// The stages of one run with their buffers.
pub(super) struct Run {
    sites: Buffer<Vec4>,
    site_triangle: Buffer<u32>,
    site_tiles: TileBounds,
    vertex_tiles: TileBounds,
    near_sites: Nearest,
    ground: Ground,
    faces: CellFaces,
    centroids: Centroids,
    near_vertices: Nearest,
    step: Step,
    spacing: f64,
}

/// Where sites live, and where their faces get their planes from.
enum Ground {
    /// The input's triangles; planes fit the sites.
    Triangles(PlaneFit, NearestVertices),
    /// Planes that fit the input's vertices.
    Cloud(BestFit),
}

impl Ground {
    fn normals(&self) -> &Buffer<Vec4> {
        match self {
            Self::Triangles(normals, _) => &normals.normals,
            Self::Cloud(planes) => &planes.normals,
        }
    }

    fn flags(&self) -> &Buffer<u32> {
        match self {
            Self::Triangles(normals, _) => &normals.flags,
            Self::Cloud(planes) => &planes.flags,
        }
    }
}

impl Run {
    pub fn new(
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
        let k = options.k_project;
        let ground = if options.method == Method::PointCloud {
            Ground::Cloud(BestFit::new(device, surface, n, k, None)?)
        } else {
            let normals = PlaneFit::new(device, n, options.k_normal, None)?;
            Ground::Triangles(normals, NearestVertices::new(device, n, k, None)?)
        };
        let faces = if options.method == Method::PowerFaces {
            CellFaces::power(device, n, &PowerOptions::new(k_sites, spacing, options.offset))?
        } else {
            CellFaces::new(device, n, &CellOptions::paper(k_sites, spacing))?
        };
        Ok(Self {
            sites: Buffer::from_slice(device, "rtf.sites", &sites)?,
            site_triangle: Buffer::from_slice(device, "rtf.site_triangle", &seeds.triangles)?,
            site_tiles: TileBounds::new(device, "rtf.neighbours.site_tiles", n)?,
            vertex_tiles: TileBounds::new(device, "rtf.neighbours.vertex_tiles", surface.vertices.len())?,
            near_sites: Nearest::new(device, "rtf.neighbours.sites", n, k_sites, true, None)?,
            ground,
            faces,
            centroids: Centroids::new(device, n, options.centroid, None)?,
            near_vertices: Nearest::new(
                device,
                "rtf.neighbours.vertices",
                n,
                options.k_project,
                false,
                None,
            )?,
            step: Step::new(device, n, options.iterations, None)?,
            spacing,
        })
    }

    /// Lloyd's iteration until the step is small; gives the root mean square steps in spacings.
    pub fn iterate(
        &self,
        device: &Device,
        surface: &Surface,
        options: &Options,
        watch: &mut Watch,
    ) -> Result<Vec<f64>> {
        let sites = options.vertices;
        let plan = LevelPlan { sites, interior: sites, spacing: self.spacing };
        let shares = Shares::new(&[plan], &[options.iterations], surface.triangles.len(), options);
        watch.phase(Phase::Prepare, shares.prepared, 0.0)?;
        watch.phase(Phase::LastLevel, shares.levels[0].until, shares.levels[0].after)?;
        watch.level(0, options.iterations);
        let mut pace = Pace::new(sites, ITERATIONS_PER_SUBMISSION);
        let mut steps = Vec::new();
        let mut recorder = device.recorder()?;
        self.vertex_tiles.record(&mut recorder, &surface.device.vertices)?;
        recorder.submit()?;
        if let Ground::Cloud(planes) = &self.ground {
            // The start is on the triangles, and the first faces need planes.
            let mut recorder = device.recorder()?;
            self.record_projection(&mut recorder, &surface.device, &self.sites)?;
            recorder.submit()?;
            let pulled: Vec<Vec4> =
                planes.projected.to_vec(device)?.iter().map(|p| p.truncate().extend(0.0)).collect();
            let mut recorder = device.recorder()?;
            recorder.upload(&self.sites, &pulled)?;
            recorder.submit()?;
        }
        while (steps.len() as u32) < options.iterations {
            let begin = steps.len() as u32;
            let look = (begin / ITERATIONS_PER_SUBMISSION + 1) * ITERATIONS_PER_SUBMISSION;
            let end = (begin + pace.iterations).min(look).min(options.iterations);
            pace.begin();
            let mut recorder = device.recorder()?;
            for iteration in begin..end {
                self.record_iteration(&mut recorder, surface, iteration)?;
            }
            let history = recorder.download(&self.step.history)?;
            let history: Vec<Vec2> = recorder.submit()?.read(&history)?;
            pace.end(end - begin);
            let new = &history[begin as usize..end as usize];
            steps.extend(new.iter().map(|s| f64::from(s.x) / self.spacing));
            let step = steps.last().copied().unwrap_or(0.0);
            watch.iterated(end, options.iterations, step)?;
            let converged = end == look && step < options.tolerance;
            if converged || (end < options.iterations && watch.leave_out()) {
                break;
            }
        }
        Ok(steps)
    }

    /// Neighbours → normals → face → centroid → project → step.
    fn record_iteration(&self, recorder: &mut Recorder, surface: &Surface, iteration: u32) -> Result<()> {
        let on = &surface.device;
        self.record_faces(recorder, surface)?;
        self.centroids.record(recorder, &self.sites, self.ground.normals(), &self.faces)?;
        let projected = self.record_projection(recorder, on, &self.centroids.targets)?;
        self.step.record(recorder, projected, &self.sites, iteration)
    }

    /// Nearest vertices → project.
    fn record_projection(
        &self,
        recorder: &mut Recorder,
        on: &SurfaceBuffers,
        targets: &Buffer<Vec4>,
    ) -> Result<&Buffer<Vec4>> {
        self.near_vertices.record(recorder, targets, &on.vertices, &self.vertex_tiles)?;
        let found = &self.near_vertices.neighbours;
        match &self.ground {
            Ground::Triangles(_, project) => {
                project.record(recorder, targets, found, on, &self.site_triangle)?;
                Ok(&project.projected)
            }
            Ground::Cloud(planes) => {
                planes.record(recorder, targets, found, &on.vertices)?;
                Ok(&planes.projected)
            }
        }
    }

    /// Neighbours → normals → face.
    fn record_faces(&self, recorder: &mut Recorder, surface: &Surface) -> Result<()> {
        let found = &self.near_sites.neighbours;
        self.site_tiles.record(recorder, &self.sites)?;
        self.near_sites.record(recorder, &self.sites, &self.sites, &self.site_tiles)?;
        // Those of a cloud come with the projection.
        if let Ground::Triangles(normals, _) = &self.ground {
            normals.record(recorder, &self.sites, found, &self.site_triangle, &surface.device.normals)?;
        }
        let (normals, flags) = (self.ground.normals(), self.ground.flags());
        self.faces.record(recorder, &self.sites, normals, found, &self.site_tiles, flags)
    }

    /// Connects the sites by the fans of their faces. Where that leaves a wrong topology, as it may at creases, which no
    /// tangent plane describes, exact connected cells decide, and the connection nearer to the input's topology is taken.
    pub fn connect(&self, device: &Device, surface: &Surface, input: &Topology) -> Result<Connection> {
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
                places: &Place::inside(&found.triangles),
                near: &found.near,
                spacing: self.spacing,
                lengths: &[],
            };
            let cells = connected_cells(&on, &sites);
            let (by_cells, cell_counts) = connect(&found.sites, &cells.fans);
            if wrong(&by_cells, &cell_counts) < wrong_by_fans {
                triangles = by_cells;
                counts = ConnectCounts { cells: Some(cells.certificate), ..cell_counts };
            }
        }
        let mesh = TriMesh { vertices: found.sites, triangles };
        Ok(Connection { mesh, counts, flags: found.flags, ..Connection::default() })
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
        let flags = recorder.download(self.ground.flags())?;
        let done = recorder.submit()?;
        let (counts, corners, fan) = (done.read(&counts)?, done.read(&corners)?, done.read(&fan)?);
        let n = counts.len();
        let slots = |i: usize| (0..counts[i] as usize).map(move |slot| slot * n + i);
        let fans = Fans::from_lists((0..n).map(|i| {
            let corners: Vec<Vec2> = slots(i).map(|s| corners[s]).collect();
            let fan: Vec<u32> = slots(i).map(|s| fan[s]).collect();
            clustered_fan(&corners, &fan)
        }));
        let sites: Vec<DVec3> = done.read(&sites)?.iter().map(|s: &Vec4| s.truncate().as_dvec3()).collect();
        Ok(FoundFaces {
            triangles: match self.ground {
                Ground::Triangles(..) => done.read(&triangles)?,
                Ground::Cloud(_) => under(surface, &sites),
            },
            sites,
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
