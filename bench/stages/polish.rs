//! Polish and fit of the connected sites, one round each, and the search for triangles that intersect.

use crate::check::landed;
use crate::context::{Context, Group, Work};
use crate::results::Row;
use anyhow::{Context as _, Result, ensure};
use glam::{DVec3, Vec4};
use rtfmesh::gpu::{Buffer, Recorder};
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, FitOptions, PolishOptions, Target, fit, polish};
use rtfmesh::sites::cells::{CellSites, CellSurface, connected_cells};
use rtfmesh::sites::connect::connect;
use rtfmesh::sites::place::Place;
use rtfmesh::stages::fit::equations::Equations;
use rtfmesh::stages::fit::inward::{InwardSamples, SurfacePoint};
use rtfmesh::stages::fit::limit::Limits;
use rtfmesh::stages::fit::mesh::FitMesh;
use rtfmesh::stages::fit::samples::FaceSamples;
use rtfmesh::stages::intersect::IntersectingPairs;
use rtfmesh::stages::polish::flip::{Flips, PASSES};
use rtfmesh::stages::polish::mesh::DeviceMesh;
use rtfmesh::stages::polish::relax::Relaxation;
use rtfmesh::{ProgressToken, TriMesh};

/// A sweep of flips and a relaxation; a round of the fit; the check.
pub const GROUPS: [Group; 3] = [
    Group {
        kernels: &[
            "polish.wanted",
            "polish.advance",
            "polish.claim",
            "polish.win",
            "polish.flip",
            "polish.relax",
            "polish.land",
            "polish.folded",
            "polish.spread",
            "polish.accept",
        ],
        most_sites: usize::MAX,
        run: polished,
    },
    Group {
        kernels: &[
            "fit.vertices",
            "fit.faces",
            "fit.corner_samples",
            "fit.points",
            "fit.face_samples",
            "fit.inward",
            "fit.keys",
            "fit.segments",
            "fit.own",
            "fit.own_edges",
            "fit.own_inward",
            "fit.blocks",
            "fit.blocks_inward",
            "fit.apply",
            "fit.scalars",
            "fit.descend",
            "fit.turn",
            "fit.clamp",
            "fit.extremes",
            "fit.spoiled",
            "fit.shorten",
            "fit.hold",
            "fit.accept",
        ],
        most_sites: usize::MAX,
        run: fitted,
    },
    Group { kernels: &["intersect.pairs"], most_sites: usize::MAX, run: checked },
];

/// Steps of the solver, as in the pipeline.
const STEPS: u32 = 8;
/// Largest difference between the fit on the device and that on the host, over the moves: on rough surfaces,
/// walks from its vertices over the mesh can end elsewhere.
const APART: f64 = 0.15;

/// The relaxed sites, connected by exact cells.
fn connected(context: &Context) -> Result<TriMesh> {
    let surface = &context.model.surface;
    let on = CellSurface::new(&surface.vertices, &surface.triangles, &surface.normals);
    let near = context.iteration.lists.neighbours.to_vec(context.device)?;
    let sites = CellSites {
        positions: &context.points,
        places: &Place::inside(&context.under),
        near: &near,
        spacing: context.spacing,
        lengths: &[],
    };
    let cells = connected_cells(&on, &sites, &ProgressToken::default())?;
    let (triangles, _) = connect(&context.points, &cells.fans);
    Ok(TriMesh { vertices: context.points.clone(), triangles })
}

/// What a mesh on the device is at the beginning of each run.
struct Before {
    positions: Vec<Vec4>,
    lists: [Vec<u32>; 4],
}

impl Before {
    fn of(context: &Context, mesh: &DeviceMesh) -> Result<Self> {
        let read = |list: &Buffer<u32>| list.to_vec(context.device);
        let DeviceMesh { positions, corners, twins, firsts, states } = mesh;
        Ok(Self {
            positions: positions.to_vec(context.device)?,
            lists: [read(corners)?, read(twins)?, read(firsts)?, read(states)?],
        })
    }

    fn restore(&self, recorder: &mut Recorder, mesh: &DeviceMesh) -> rtfmesh::Result<()> {
        let DeviceMesh { positions, corners, twins, firsts, states } = mesh;
        recorder.upload(positions, &self.positions)?;
        for (list, values) in [corners, twins, firsts, states].into_iter().zip(&self.lists) {
            recorder.upload(list, values)?;
        }
        Ok(())
    }
}

fn read(context: &Context, mesh: &DeviceMesh) -> Result<TriMesh> {
    let corners = mesh.corners.to_vec(context.device)?;
    let vertices = mesh.positions.to_vec(context.device)?.iter().map(|p| p.truncate().as_dvec3()).collect();
    Ok(TriMesh { vertices, triangles: corners.as_chunks().0.to_vec() })
}

fn polished(context: &Context) -> Result<Vec<Row>> {
    let (n, device, records) = (context.len(), context.device, &context.model.records);
    let input = connected(context)?;
    let faces = input.triangles.len();
    let mesh = DeviceMesh::new(device, &input)?;
    let before = Before::of(context, &mesh)?;
    let flips = Flips::new(device, n, faces, None)?;
    let relaxation = Relaxation::new(device, n, None)?;
    let under = Buffer::from_slice(device, "bench.under", &context.under)?;
    let mut record = |recorder: &mut Recorder, _| {
        before.restore(recorder, &mesh)?;
        recorder.upload(&under, &context.under)?;
        flips.record(recorder, &mesh, 1.0, (0, PASSES))?;
        relaxation.record(recorder, &mesh, records, &under)
    };
    context.submit(&mut record, 0)?;
    let after = read(context, &mesh)?;
    ensure!(topology(&after) == topology(&input), "the topology has changed");
    let places: Vec<Vec4> = after.vertices.iter().map(|p| p.as_vec3().extend(0.0)).collect();
    let moved = after.vertices.iter().zip(&input.vertices).filter(|(a, b)| a != b).count();
    ensure!(2 * moved > n, "{moved} of {n} vertices have moved");
    landed(context, &places, &under.to_vec(device)?)?;
    // Of the lists that are worked on here, only what every element must have is counted.
    let half_edges = 3 * faces;
    let works = [
        Work::new("polish.wanted", 8 * half_edges + 16 * n + 4 * n),
        Work::new("polish.advance", 0),
        Work::new("polish.claim", 0),
        Work::new("polish.win", 0),
        Work::new("polish.flip", 0),
        Work::new("polish.relax", 8 * half_edges + (16 + 4 + 4 + 16 + 4) * n),
        Work::new("polish.land", (16 + 4 + 4 + 16 + 16 + 16 + 4) * n),
        Work::new("polish.folded", 4 * half_edges + (16 + 16 + 4) * n),
        Work::new("polish.spread", 0),
        Work::new("polish.accept", (16 + 4 + 16 + 16) * n),
    ];
    context.time(&works, &mut record)
}

fn checked(context: &Context) -> Result<Vec<Row>> {
    let mesh = connected(context)?;
    let pairs = IntersectingPairs::new(context.device, &mesh, 0.0, None)?;
    let mut record = |recorder: &mut Recorder, _| pairs.record(recorder);
    let mut recorder = Recorder::new(context.device)?;
    record(&mut recorder, 0)?;
    let faces = pairs.triangles(context.device, recorder, &mesh)?.context("the list is too short")?;
    ensure!(faces == intersecting_faces(&mesh, &ProgressToken::default())?, "other faces than the host's");
    // The tree is read by each walk, but only once is it counted.
    let bytes = IntersectingPairs::BYTES * mesh.triangles.len();
    context.time(&[Work::new("intersect.pairs", bytes)], &mut record)
}

/// The vertices of the surface, each with a triangle of the mesh near it: one at the nearest site of those
/// that are on a triangle there, or at any.
fn surface_points(context: &Context, mesh: &TriMesh) -> Vec<SurfacePoint> {
    let surface = &context.model.surface;
    let mut first = vec![0; mesh.vertices.len()];
    for (t, triangle) in (0..).zip(&mesh.triangles) {
        triangle.iter().for_each(|v| first[*v as usize] = t);
    }
    let mut points: Vec<SurfacePoint> = surface
        .vertices
        .iter()
        .map(|p| SurfacePoint { position: *p, normal: DVec3::ZERO, area: 0.0, near: u32::MAX })
        .collect();
    for ((triangle, normal), area) in surface.triangles.iter().zip(&surface.normals).zip(&surface.areas) {
        for v in triangle {
            points[*v as usize].normal += *normal * *area;
            points[*v as usize].area += area / 3.0;
        }
    }
    for (site, t) in context.under.iter().enumerate() {
        for v in surface.triangles[*t as usize] {
            points[v as usize].near = first[site];
        }
    }
    let near = |p: &SurfacePoint| {
        let far = |v: &usize| mesh.vertices[*v].distance_squared(p.position);
        let nearest = (0..mesh.vertices.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
        nearest.map_or(0, |v| first[v])
    };
    for p in &mut points {
        if p.near == u32::MAX {
            p.near = near(p);
        }
    }
    points
}

fn fitted(context: &Context) -> Result<Vec<Row>> {
    let (n, device, records) = (context.len(), context.device, &context.model.records);
    let mut input: ConstrainedMesh = connected(context)?.into();
    let surface = &context.model.surface;
    let target =
        Target::new(&TriMesh { vertices: surface.vertices.clone(), triangles: surface.triangles.clone() });
    // As in the pipeline: bad triangles would hold back most moves, and small differences decide which.
    polish(&mut input, &target, &PolishOptions::default(), &ProgressToken::default())?;
    let input = input.mesh;
    let faces = input.triangles.len();
    let mesh = DeviceMesh::new(device, &input)?;
    let before = Before::of(context, &mesh)?;
    let on = FitMesh::new(device, &mesh, None)?;
    let (edges, points) = (on.edges.len(), surface_points(context, &input));
    let samples = FaceSamples::new(device, (&on, records), None, None)?;
    let inward = InwardSamples::new(device, &points, faces, None)?;
    let solver = Equations::new(device, n, edges, None)?;
    let limits = Limits::new(device, n, None)?;
    let options = FitOptions { rounds: 1, ..FitOptions::default() };
    let under = Buffer::from_slice(device, "bench.under", &context.under)?;
    // As in the pipeline.
    let far = 0.1 * context.spacing;
    let mut record = |recorder: &mut Recorder, _| {
        before.restore(recorder, &mesh)?;
        recorder.upload(&under, &context.under)?;
        on.record(recorder)?;
        samples.record_tree(recorder, records)?;
        samples.record(recorder, &on, records, &under, far as f32)?;
        inward.record(recorder, &on)?;
        solver.record(recorder, &on, &samples, &inward)?;
        solver.record_solve(recorder, &on, STEPS)?;
        limits.record(recorder, &on, &solver.moves, options.min_angle.to_radians() as f32)
    };
    context.submit(&mut record, 0)?;
    let after = read(context, &mesh)?;
    let mut on_host: ConstrainedMesh = input.clone().into();
    fit(&mut on_host, &target, &options, &ProgressToken::default())?;
    let on_host = on_host.mesh;
    let norm = |a: &TriMesh, b: &TriMesh| {
        let pairs = a.vertices.iter().zip(&b.vertices);
        (pairs.map(|(a, b)| a.distance_squared(*b)).sum::<f64>() / n as f64).sqrt()
    };
    let (moved, apart) = (norm(&on_host, &input), norm(&after, &on_host));
    // Positions are rounded to 6e-8, and so are distances.
    ensure!(apart < APART * moved + 1e-7, "{apart} from the host's after moves of {moved}");
    let half_edges = 3 * faces;
    let (vector, of_points) = (16 * n, points.len());
    let works = [
        Work::new("fit.vertices", 8 * half_edges + vector + 8 * n + 2 * vector),
        Work::new("fit.faces", vector + 4 * half_edges + 8 * faces),
        Work::new("fit.corner_samples", 5 * vector),
        Work::new("fit.points", 2 * vector + 4 * half_edges + 20 * (faces + edges)),
        Work::new("fit.face_samples", vector + 4 * half_edges + 48 * (faces + edges)),
        Work::new("fit.inward", of_points * (16 + 4 + 16 + 4 + 16 + 8)),
        Work::new("fit.keys", of_points * (4 + 16 + 8)),
        Work::new("fit.segments", of_points * 4),
        Work::new("fit.own", 5 * vector + 4 * n + 4 * half_edges + 20 * faces),
        Work::new("fit.own_edges", 6 * vector + 4 * n + 8 * half_edges + 16 * edges),
        Work::new("fit.own_inward", 6 * vector + 4 * n + 4 * half_edges + 8 * faces + 28 * of_points),
        Work::new("fit.blocks", edges * (4 + 4 + 16 + 16 + 8) + 20 * faces),
        Work::new("fit.blocks_inward", edges * (4 + 4 + 48) + 8 * faces + 28 * of_points),
        Work::new("fit.apply", STEPS as usize * (4 * vector + 4 * n + 8 * half_edges + 24 * edges)),
        Work::new("fit.scalars", 0),
        Work::new("fit.descend", (STEPS as usize + 1) * 9 * vector),
        Work::new("fit.turn", STEPS as usize * 3 * vector),
        Work::new("fit.clamp", 3 * vector + 4 * n),
        Work::new("fit.extremes", vector + 4 * half_edges),
        Work::new("fit.spoiled", 2 * vector + 4 * half_edges),
        Work::new("fit.shorten", 0),
        Work::new("fit.hold", 0),
        Work::new("fit.accept", 3 * vector),
    ];
    context.time(&works, &mut record)
}
