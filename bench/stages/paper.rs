//! The kernels of the paper's preset, and those that `rpf` and `rvc` have in their place.

use crate::check::{known_face, near_list};
use crate::context::{Context, Group, SMALL, Work};
use crate::iteration::LIST;
use crate::moves;
use crate::polygons::{assert_same_polygon, frame};
use crate::reference::best_fit;
use crate::reference::centroid::{area_centroid, corner_mean, weighted_corner_mean};
use crate::reference::face::Face;
use crate::reference::knn::nearest;
use crate::reference::nearest_vertices::distance;
use crate::reference::plane_fit::plane_fit;
use crate::reference::power::power_face;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::{DVec2, DVec3};
use rtfmesh::gpu::Buffer;
use rtfmesh::options::Centroid;
use rtfmesh::sites::surface::SurfaceBuffers;
use rtfmesh::stages::centroid::Centroids;
use rtfmesh::stages::face::cell::{BOX_HALF, CellFaces, CellOptions};
use rtfmesh::stages::face::planar::PlanarOptions;
use rtfmesh::stages::face::polygons::PlanarPolygons;
use rtfmesh::stages::face::power::PowerOptions;
use rtfmesh::stages::neighbours::knn::{Nearest, TileBounds};
use rtfmesh::stages::normals::PlaneFit;
use rtfmesh::stages::project::best_fit::{BestFit, vertex_normals};
use rtfmesh::stages::project::nearest_vertices::NearestVertices;

/// In the order of its iteration.
pub const GROUPS: [Group; 7] = [
    Group { kernels: &["neighbours.tile_bounds", "neighbours.knn"], most_sites: SMALL, run: knn },
    Group { kernels: &["normals.plane_fit"], most_sites: usize::MAX, run: fit },
    Group { kernels: &["face.cell"], most_sites: SMALL, run: cell },
    Group { kernels: &["face.power"], most_sites: SMALL, run: power },
    Group {
        kernels: &["centroid.corners", "centroid.weighted_corners", "centroid.area"],
        most_sites: usize::MAX,
        run: centroids,
    },
    Group { kernels: &["project.nearest_vertices"], most_sites: SMALL, run: nearest_vertices },
    Group { kernels: &["project.best_fit"], most_sites: SMALL, run: best_fit },
];

/// The preset's neighbours for a cell, a normal and a projection.
const K_CLIP: u32 = 32;
const K_NORMAL: u32 = 16;
const K_PROJECT: u32 = 16;
/// The offset of `rpf`, in spacings.
const OFFSET: f64 = 0.5;
/// Sites in a tile.
const TILE: usize = 64;

fn knn(context: &Context) -> Result<Vec<Row>> {
    let (n, k, sites) = (context.len(), K_CLIP, &context.iteration.sites);
    let tiles = TileBounds::new(context.device, "bench.tiles", n)?;
    let search = Nearest::new(context.device, "bench.nearest", n, k, true, None)?;
    let mut record = |recorder: &mut _, _| {
        tiles.record(recorder, sites)?;
        search.record(recorder, sites, sites, &tiles)
    };
    context.submit(&mut record, 0)?;
    let got = search.neighbours.to_vec(context.device)?;
    for (sample, &i) in context.samples.iter().enumerate() {
        near_list(context, sample, &(0..k as usize).map(|s| got[s * n + i]).collect::<Vec<_>>())?;
    }
    let bounds = tiles.bounds.to_vec(context.device)?;
    for (tile, sites) in context.sites.chunks(TILE).enumerate() {
        let low = sites.iter().copied().reduce(|a, b| a.min(b));
        let high = sites.iter().copied().reduce(|a, b| a.max(b));
        let same = low == Some(bounds[2 * tile]) && high == Some(bounds[2 * tile + 1]);
        ensure!(same, "tile {tile} has the wrong box");
    }
    let boxes = 32 * n.div_ceil(TILE);
    let works = [
        Work::new("neighbours.tile_bounds", 16 * n + boxes),
        Work::new("neighbours.knn", n * (16 + 4 * k as usize) + boxes),
    ];
    context.time(&works, &mut record)
}

fn fit(context: &Context) -> Result<Vec<Row>> {
    let (n, k, it) = (context.len(), K_NORMAL as usize, &context.iteration);
    let on = &SurfaceBuffers::new(context.device, &context.model.surface)?;
    let fit = PlaneFit::new(context.device, n, k as u32, None)?;
    let mut record = |recorder: &mut _, _| {
        fit.record(recorder, &it.sites, it.lists.neighbours.whole()?, &it.site_triangle, &on.normals)
    };
    context.submit(&mut record, 0)?;
    let (normals, flags) = (fit.normals.to_vec(context.device)?, fit.flags.to_vec(context.device)?);
    let mut compared = 0;
    for (sample, &i) in context.samples.iter().enumerate() {
        let near = context.near[sample].iter().take(k - 1).map(|j| context.points[*j as usize]);
        let points: Vec<DVec3> = std::iter::once(context.points[i]).chain(near).collect();
        let want = plane_fit(&points);
        let [low, middle, high] = want.eigenvalues;
        let gap = (middle - low) / high;
        if gap > 0.05 && flags[i] == 0 {
            let sine = normals[i].truncate().as_dvec3().cross(want.normal).length();
            // Of two sites at the same distance, the lists may contain either.
            ensure!(sine <= 1e-3, "site {i}: the normal is {sine} off");
            compared += 1;
        }
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} fits could be compared");
    let triangles = 16 * n.min(context.model.records.len());
    context
        .time(&[Work::new("normals.plane_fit", n * (16 + 4 * (k - 1) + 4 + 16 + 4) + triangles)], &mut record)
}

fn cell(context: &Context) -> Result<Vec<Row>> {
    let faces = CellFaces::new(context.device, context.len(), &CellOptions::paper(K_CLIP, context.spacing))?;
    let half = BOX_HALF * context.spacing;
    let want = |sample: usize, i: usize, normals: &[DVec3]| {
        known_face(context, i, &context.near[sample], normals[i], half, &|_| true).map(|(face, _)| face)
    };
    clipped(context, "face.cell", &faces, want)
}

fn power(context: &Context) -> Result<Vec<Row>> {
    let options = PowerOptions::new(K_CLIP, context.spacing, OFFSET);
    let faces = CellFaces::power(context.device, context.len(), &options)?;
    let [half, offset] = [BOX_HALF, OFFSET].map(|spacings| spacings * context.spacing);
    let want = |sample: usize, i: usize, normals: &[DVec3]| {
        let near = &context.near[sample];
        let known: Vec<usize> = std::iter::once(i).chain(near.iter().map(|j| *j as usize)).collect();
        let of = |list: &[DVec3]| known.iter().map(|j| list[*j]).collect::<Vec<_>>();
        let (sites, unit) = (of(&context.points), of(normals));
        let mut face = power_face((&sites, &unit), 0, frame(normals[i]), offset, half);
        face.behind.iter_mut().flatten().for_each(|j| *j = known[*j as usize] as u32);
        // Neither the sites beyond the known ones nor their shadows may reach the face.
        let farthest = sites.last().map_or(0.0, |p| p.distance(sites[0]));
        let radius = face.radius();
        let is_closed = !face.corners.is_empty()
            && farthest - offset - radius > offset.hypot(radius)
            && farthest > 2.0 * radius;
        is_closed.then_some(face)
    };
    clipped(context, "face.power", &faces, want)
}

/// Times the faces of a kernel that clips; `want` gives that of a sample by its number, the site and all
/// normals, where it is known.
fn clipped(
    context: &Context,
    kernel: &'static str,
    faces: &CellFaces,
    want: impl Fn(usize, usize, &[DVec3]) -> Option<Face>,
) -> Result<Vec<Row>> {
    let (n, device, it) = (context.len(), context.device, &context.iteration);
    let tiles = TileBounds::new(device, "bench.tiles", n)?;
    let search = Nearest::new(device, "bench.nearest", n, K_CLIP, true, None)?;
    let fit = PlaneFit::new(device, n, K_NORMAL, None)?;
    let (found, on) = (&search.neighbours, &SurfaceBuffers::new(context.device, &context.model.surface)?);
    let mut record = |recorder: &mut _, _| {
        tiles.record(recorder, &it.sites)?;
        search.record(recorder, &it.sites, &it.sites, &tiles)?;
        fit.record(recorder, &it.sites, found, &it.site_triangle, &on.normals)?;
        faces.record(recorder, &it.sites, &fit.normals, found, &tiles, &fit.flags)
    };
    context.submit(&mut record, 0)?;
    let normals: Vec<DVec3> =
        fit.normals.to_vec(device)?.iter().map(|normal| normal.truncate().as_dvec3()).collect();
    let counts = faces.corner_count.to_vec(device)?;
    let (corners, fan) = (faces.corners.to_vec(device)?, faces.fan.to_vec(device)?);
    let mut compared = 0;
    for (sample, &i) in context.samples.iter().enumerate() {
        if let (Some(want), true) = (want(sample, i, &normals), counts[i] > 0) {
            let slots = (0..counts[i] as usize).map(|s| s * n + i);
            let got: Vec<DVec2> = slots.clone().map(|s| corners[s].as_dvec2()).collect();
            assert_same_polygon(i, &got, &slots.map(|s| fan[s]).collect::<Vec<_>>(), &want);
            compared += 1;
        }
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} faces could be compared");
    let all: usize = counts.iter().map(|c| *c as usize).sum();
    let bytes = n * (32 + 4 * K_CLIP as usize + 4 + 8) + 12 * all;
    context.time(&[Work::new(kernel, bytes)], &mut record)
}

/// Both kinds of centroid, of the faces of the default pipeline, because cells take too long for so many
/// sites.
fn centroids(context: &Context) -> Result<Vec<Row>> {
    let (n, device, it) = (context.len(), context.device, &context.iteration);
    let faces = CellFaces::new(device, n, &CellOptions::paper(LIST, context.spacing))?;
    let polygons = PlanarPolygons::new(device, n, &PlanarOptions::new(LIST, 1))?;
    context.submit(&mut |recorder, _| polygons.record(recorder, &it.inputs(), it.widest()), 0)?;
    let (count, corners) = (polygons.corner_count.to_vec(device)?, polygons.corners.to_vec(device)?);
    drop(polygons);
    let unpacked: Vec<_> =
        it.normals.normals.to_vec(device)?.into_iter().map(crate::check::unpack_normal).collect();
    let normals: Vec<_> = unpacked.iter().map(|n| n.as_vec3().extend(0.0)).collect();
    let normals = Buffer::from_slice(device, "bench.normals", &normals)?;
    context.submit(
        &mut |recorder, _| {
            recorder.upload(&faces.corner_count, &count)?;
            recorder.upload(&faces.corners, &corners)
        },
        0,
    )?;
    let stage = |kind| Centroids::new(device, n, kind, None);
    let stages = [
        ("centroid.corners", corner_mean as fn(&[DVec2]) -> DVec2, stage(Centroid::Corners)?),
        ("centroid.weighted_corners", weighted_corner_mean, stage(Centroid::WeightedCorners)?),
        ("centroid.area", area_centroid, stage(Centroid::Area)?),
    ];
    let mut record = |recorder: &mut _, _| {
        stages.iter().try_for_each(|(_, _, stage)| stage.record(recorder, &it.sites, &normals, &faces))
    };
    context.submit(&mut record, 0)?;
    for (name, middle, stage) in &stages {
        let targets = stage.targets.to_vec(device)?;
        let mut off_count = 0;
        for &i in context.samples.iter().filter(|i| count[**i] > 2) {
            let own: Vec<DVec2> = (0..count[i] as usize).map(|s| corners[s * n + i].as_dvec2()).collect();
            let ((u, v), middle) = (frame(unpacked[i]), middle(&own));
            let want = context.points[i] + u * middle.x + v * middle.y;
            let off = targets[i].truncate().as_dvec3().distance(want);
            off_count += usize::from(off > 1e-3 * context.spacing);
        }
        // The weight of close corners has a threshold, which rounding may cross.
        ensure!(
            off_count <= usize::from(*name == "centroid.weighted_corners"),
            "{off_count} of {name} are off"
        );
    }
    let bytes = n * (16 + 16 + 4 + 16) + 8 * count.iter().map(|c| *c as usize).sum::<usize>();
    let work = stages.each_ref().map(|(name, ..)| Work::new(name, bytes));
    context.time(&work, &mut record)
}

/// The search for the surface's vertices near each site, as [`nearest_vertices`] and [`best_fit`] need it.
fn vertex_search(context: &Context) -> Result<(TileBounds, Nearest)> {
    let vertices = context.model.surface.vertices.len();
    Ok((
        TileBounds::new(context.device, "bench.vertex_tiles", vertices)?,
        Nearest::new(context.device, "bench.near_vertices", context.len(), K_PROJECT, false, None)?,
    ))
}

fn nearest_vertices(context: &Context) -> Result<Vec<Row>> {
    let (n, device, k) = (context.len(), context.device, K_PROJECT);
    let surface = &context.model.surface;
    let wanted = moves::targets(context)?;
    let targets = &context.iteration.faces.targets;
    let (tiles, search) = vertex_search(context)?;
    let project = NearestVertices::new(device, n, k, None)?;
    let under = Buffer::<u32>::new(device, "bench.under", n)?;
    let on = &SurfaceBuffers::new(device, surface)?;
    let mut record = |recorder: &mut _, _| {
        tiles.record(recorder, &on.vertices)?;
        search.record(recorder, targets, &on.vertices, &tiles)?;
        project.record(recorder, targets, &search.neighbours, on, &under)
    };
    context.submit(&mut record, 0)?;
    let vertices: Vec<DVec3> = surface.vertices.iter().map(|v| v.as_vec3().as_dvec3()).collect();
    let queries: Vec<DVec3> = context.samples.iter().map(|i| wanted[*i].truncate().as_dvec3()).collect();
    let near = nearest(&queries, &vertices, k as usize, false);
    let got = project.projected.to_vec(device)?;
    for ((&i, near), at) in context.samples.iter().zip(&near).zip(queries) {
        let want = distance(at, near, &vertices, &surface.triangles);
        let far = got[i].truncate().as_dvec3().distance(at);
        ensure!((far - want).abs() < 2e-6, "site {i}: {far} away instead of {want}");
    }
    let (v, t) = (surface.vertices.len(), surface.triangles.len());
    // With sites everywhere, vertices, triangles and stars are each read at least once.
    let seen = (16 * v + 16 * t + 4 * v + 12 * t) * n.min(v) / v;
    let bytes = n * (16 + 4 * k as usize + 16 + 4) + seen;
    context.time(&[Work::new("project.nearest_vertices", bytes)], &mut record)
}

fn best_fit(context: &Context) -> Result<Vec<Row>> {
    let (n, device, k) = (context.len(), context.device, K_PROJECT);
    let surface = &context.model.surface;
    let wanted = moves::targets(context)?;
    let targets = &context.iteration.faces.targets;
    let (tiles, search) = vertex_search(context)?;
    let side = |[a, b, c]: &[DVec3; 3]| a.distance(*b).max(b.distance(*c)).max(c.distance(*a));
    let longest = context.model.corners.iter().map(side).fold(0.0, f64::max);
    let project = BestFit::new(device, surface, n, (k, longest), None)?;
    let on = &SurfaceBuffers::new(device, surface)?;
    let mut record = |recorder: &mut _, _| {
        tiles.record(recorder, &on.vertices)?;
        search.record(recorder, targets, &on.vertices, &tiles)?;
        project.record(recorder, targets, &search.neighbours, on)
    };
    context.submit(&mut record, 0)?;
    let vertices: Vec<DVec3> = surface.vertices.iter().map(|v| v.as_vec3().as_dvec3()).collect();
    let outward = vertex_normals(surface);
    let lists = search.neighbours.to_vec(device)?;
    let (got, normals) = (project.projected.to_vec(device)?, project.normals.to_vec(device)?);
    let mut compared = 0;
    for &i in &context.samples {
        // The kernel's own lists: which of two equally far vertices is nearer decides a plane.
        let near: Vec<usize> = (0..k as usize).map(|s| lists[s * n + i] as usize).collect();
        let of = |list: &[DVec3]| near.iter().map(|v| list[*v]).collect::<Vec<_>>();
        let at = wanted[i].truncate().as_dvec3();
        let want = best_fit::best_fit(at, &of(&vertices), &of(&outward), longest / 3_f64.sqrt());
        let Some(want) = want else { continue };
        let off = got[i].truncate().as_dvec3().distance(want.to);
        ensure!(off < 1e-3 * at.distance(want.to) + 2e-6, "site {i}: {off} off its plane");
        let off = normals[i].truncate().as_dvec3().distance(want.normal);
        ensure!(off < 2e-3, "site {i}: the normal is {off} off");
        compared += 1;
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} planes could be compared");
    let v = surface.vertices.len();
    let bytes = n * (16 + 4 * k as usize + 16 + 16 + 4) + 2 * 16 * n.min(v);
    context.time(&[Work::new("project.best_fit", bytes)], &mut record)
}
