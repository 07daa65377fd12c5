//! Faces by intervals, their targets, and their polygons.

use crate::check::{known_face, unpack_normal};
use crate::context::{Context, Group, Work};
use crate::iteration::LIST;
use crate::polygons::assert_same_polygon;
use crate::reference::centroid::area_centroid;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::{DVec2, Vec2};
use rtfmesh::gpu::Buffer;
use rtfmesh::stages::face::planar::{PlanarFaces, PlanarInputs, PlanarOptions};
use rtfmesh::stages::face::polygons::PlanarPolygons;
use rtfmesh::stages::neighbours::lists::NEAR;

/// The faces of the default pipeline, and their polygons.
pub const GROUPS: [Group; 2] = [
    Group {
        kernels: &["face.planar", "face.planar_rest", "face.planar_exact"],
        most_sites: usize::MAX,
        run: planar,
    },
    Group { kernels: &["face.polygons"], most_sites: usize::MAX, run: polygons },
];

/// Relaxed sites leave almost nothing to the later kernels, so these get one site in so many.
const FORCED: usize = 16;

fn planar(context: &Context) -> Result<Vec<Row>> {
    let (n, it) = (context.len(), &context.iteration);
    let options = PlanarOptions::new(LIST, context.runs + 1);
    let site_bytes = |lines: usize| 16 + 4 + 4 * lines + 8 + 16 + 32;
    let mut rows = Vec::new();
    let away: Vec<Vec2> = it.lists.away.to_vec(context.device)?;
    // Neighbours decide nothing if an unlisted site may be right beside the site.
    let forced = |change: fn(Vec2) -> Vec2| {
        let short = away.iter().enumerate().map(|(i, r)| if i % FORCED == 0 { change(*r) } else { *r });
        Buffer::from_slice(context.device, "bench.short_away", &short.collect::<Vec<_>>())
    };
    let (near, all) = (forced(|r| r.with_x(0.0))?, forced(|_| Vec2::ZERO)?);
    for (away, kernel) in
        [(&it.lists.away, "face.planar"), (&near, "face.planar_rest"), (&all, "face.planar_exact")]
    {
        let faces = PlanarFaces::new(context.device, &it.lists.neighbours.blocks(), &options)?;
        let inputs = PlanarInputs { away, ..it.inputs() };
        // There is a counter for each iteration, so each run has its own.
        let mut record = |recorder: &mut _, number| faces.record(recorder, &inputs, &it.planar_move(number));
        context.submit(&mut record, 0)?;
        let counts = faces.counts(0)?;
        let given = if rows.is_empty() { 0 } else { FORCED };
        check_targets(context, &faces, (0..n).step_by(FORCED).take(given))?;
        let (near, listed, open) = (counts.undecided_by_near, counts.undecided_by_list, counts.open);
        let work = match kernel {
            "face.planar" => Work {
                note: format!("{near} sites undecided, {listed} of them after the whole lists; {open} open"),
                ..Work::new(kernel, n * site_bytes(NEAR as usize))
            },
            "face.planar_rest" => Work {
                note: format!("given {near} sites"),
                ..Work::new(kernel, near * (4 + site_bytes(LIST as usize)))
            },
            _ => Work {
                note: format!("given {listed} sites"),
                ..Work::new(kernel, listed * (8 + site_bytes(LIST as usize)))
            },
        };
        rows.extend(context.time(&[work], &mut record)?);
    }
    Ok(rows)
}

/// Checks that the targets of the samples, and of `listed` sites, are the centroids of their faces.
fn check_targets(context: &Context, faces: &PlanarFaces, listed: impl Iterator<Item = usize>) -> Result<()> {
    let targets = faces.targets.to_vec(context.device)?;
    let normals = context.iteration.normals.normals.to_vec(context.device)?;
    let lists = context.iteration.lists.neighbours.to_vec(context.device)?;
    let own = |i: usize| (0..LIST as usize).map(|s| lists[s * context.len() + i]).collect::<Vec<_>>();
    let extra: Vec<(usize, Vec<u32>)> = listed.map(|i| (i, own(i))).collect();
    let samples = context.samples.iter().copied().zip(&context.near);
    let mut compared = 0;
    for (i, near) in samples.chain(extra.iter().map(|(i, near)| (*i, near))) {
        let normal = unpack_normal(normals[i]);
        let counts = |j: u32| unpack_normal(normals[j as usize]).dot(normal) > -0.2;
        let far = 2.0 * f64::from(context.iteration.widest());
        let Some((face, [u, v])) = known_face(context, i, near, normal, far, &counts) else { continue };
        let middle = area_centroid(&face.corners);
        let wide = face.radius() > 0.44 * f64::from(context.iteration.widest());
        if wide || middle.length() > 0.98 * f64::from(context.iteration.largest_move()) {
            continue;
        }
        let want = context.points[i] + u * middle.x + v * middle.y;
        let off = targets[i].truncate().as_dvec3().distance(want);
        ensure!(off < 1e-3 * context.spacing, "site {i}: the target is {off} off the centroid");
        compared += 1;
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} targets could be compared");
    Ok(())
}

fn polygons(context: &Context) -> Result<Vec<Row>> {
    let (n, it) = (context.len(), &context.iteration);
    let polygons = PlanarPolygons::new(context.device, n, &PlanarOptions::new(LIST, 1))?;
    let mut record = |recorder: &mut _, _| polygons.record(recorder, &it.inputs(), it.widest());
    context.submit(&mut record, 0)?;
    let normals = it.normals.normals.to_vec(context.device)?;
    let count = polygons.corner_count.to_vec(context.device)?;
    let corners = polygons.corners.to_vec(context.device)?;
    let fan = polygons.fan.to_vec(context.device)?;
    let state = polygons.state.to_vec(context.device)?;
    let mut compared = 0;
    for (&i, near) in context.samples.iter().zip(&context.near).filter(|(i, _)| state[**i] == 0) {
        let slots = (0..count[i] as usize).map(|s| s * n + i);
        let got: Vec<DVec2> = slots.clone().map(|s| corners[s].as_dvec2()).collect();
        let normal = unpack_normal(normals[i]);
        let counts = |j: u32| unpack_normal(normals[j as usize]).dot(normal) > -0.2;
        let far = 2.0 * f64::from(it.widest());
        if let Some((want, _)) = known_face(context, i, near, normal, far, &counts) {
            assert_same_polygon(i, &got, &slots.map(|s| fan[s]).collect::<Vec<_>>(), &want);
            compared += 1;
        }
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} polygons could be compared");
    let all: usize = count.iter().map(|c| *c as usize).sum();
    let bytes = n * (16 + 4 + 4 * LIST as usize + 4 + 4) + 12 * all;
    context.time(&[Work::new("face.polygons", bytes)], &mut record)
}
