//! The kernels of the paper's preset.

use crate::check::{known_face, near_list};
use crate::context::{Context, Group, SMALL, Work};
use crate::iteration::LIST;
use crate::moves;
use crate::polygons::{assert_same_polygon, frame};
use crate::reference::centroid::{area_centroid, corner_mean, weighted_corner_mean};
use crate::reference::knn::nearest;
use crate::reference::nearest_vertices::distance;
use crate::reference::plane_fit::plane_fit;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::{DVec2, DVec3};
use rtfmesh::Centroid;
use rtfmesh::gpu::Buffer;
use rtfmesh::sites::surface::SurfaceBuffers;
use rtfmesh::stages::centroid::Centroids;
use rtfmesh::stages::face::cell::{BOX_HALF, CellFaces, CellOptions};
use rtfmesh::stages::face::planar::PlanarOptions;
use rtfmesh::stages::face::polygons::PlanarPolygons;
use rtfmesh::stages::neighbours::knn::{Nearest, TileBounds};
use rtfmesh::stages::normals::PlaneFit;
use rtfmesh::stages::project::nearest_vertices::NearestVertices;

/// In the order of its iteration.
pub const GROUPS: [Group; 5] = [
    Group { kernels: &["neighbours.tile_bounds", "neighbours.knn"], most_sites: SMALL, run: knn },
    Group { kernels: &["normals.plane_fit"], most_sites: usize::MAX, run: fit },
    Group { kernels: &["face.cell"], most_sites: SMALL, run: cell },
    Group {
        kernels: &["centroid.corners", "centroid.weighted_corners", "centroid.area"],
        most_sites: usize::MAX,
        run: centroids,
    },
    Group { kernels: &["project.nearest_vertices"], most_sites: SMALL, run: nearest_vertices },
];

/// The preset's neighbours for a cell, a normal and a projection.
const K_CLIP: u32 = 32;
const K_NORMAL: u32 = 16;
const K_PROJECT: u32 = 16;
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
    let (n, device, it) = (context.len(), context.device, &context.iteration);
    let options = CellOptions::paper(K_CLIP, context.spacing);
    let tiles = TileBounds::new(device, "bench.tiles", n)?;
    let search = Nearest::new(device, "bench.nearest", n, options.k, true, None)?;
    let fit = PlaneFit::new(device, n, K_NORMAL, None)?;
    let faces = CellFaces::new(device, n, &options)?;
    let (found, on) = (&search.neighbours, &SurfaceBuffers::new(context.device, &context.model.surface)?);
    let mut record = |recorder: &mut _, _| {
        tiles.record(recorder, &it.sites)?;
        search.record(recorder, &it.sites, &it.sites, &tiles)?;
        fit.record(recorder, &it.sites, found, &it.site_triangle, &on.normals)?;
        faces.record(recorder, &it.sites, &fit.normals, found, &tiles, &fit.flags)
    };
    context.submit(&mut record, 0)?;
    let (normals, counts) = (fit.normals.to_vec(device)?, faces.corner_count.to_vec(device)?);
    let (corners, fan) = (faces.corners.to_vec(device)?, faces.fan.to_vec(device)?);
    let mut compared = 0;
    for (sample, &i) in context.samples.iter().enumerate() {
        let normal = normals[i].truncate().as_dvec3();
        let (near, half) = (&context.near[sample], BOX_HALF * context.spacing);
        let known = known_face(context, i, near, normal, half, &|_| true);
        if let (Some((want, _)), true) = (known, counts[i] > 0) {
            let slots = (0..counts[i] as usize).map(|s| s * n + i);
            let got: Vec<DVec2> = slots.clone().map(|s| corners[s].as_dvec2()).collect();
            assert_same_polygon(i, &got, &slots.map(|s| fan[s]).collect::<Vec<_>>(), &want);
            compared += 1;
        }
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} faces could be compared");
    let all: usize = counts.iter().map(|c| *c as usize).sum();
    let bytes = n * (32 + 4 * options.k as usize + 4 + 8) + 12 * all;
    context.time(&[Work::new("face.cell", bytes)], &mut record)
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

fn nearest_vertices(context: &Context) -> Result<Vec<Row>> {
    let (n, device, k) = (context.len(), context.device, K_PROJECT);
    let surface = &context.model.surface;
    let wanted = moves::targets(context)?;
    let targets = &context.iteration.faces.targets;
    let tiles = TileBounds::new(device, "bench.vertex_tiles", surface.vertices.len())?;
    let search = Nearest::new(device, "bench.near_vertices", n, k, false, None)?;
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
