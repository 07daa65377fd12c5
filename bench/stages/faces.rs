//! Faces by intervals, their targets, and their polygons.

use crate::check::{known_face, unpack_normal};
use crate::context::{Context, Group, Work};
use crate::iteration::LIST;
use crate::reference::centroid::area_centroid;
use crate::results::Row;
use crate::shapes_of_faces::assert_same_polygon;
use anyhow::{Result, ensure};
use glam::DVec2;
use rtfmesh::stages::planar::{NEAR, PlanarFaces, PlanarPolygons};

/// What the default pipeline does, and its polygons for those who want them.
pub const GROUPS: [Group; 2] = [
    Group { kernels: &["face.planar", "face.planar_rest"], most_sites: usize::MAX, run: planar },
    Group { kernels: &["face.polygons"], most_sites: usize::MAX, run: polygons },
];

fn planar(context: &Context) -> Result<Vec<Row>> {
    let (n, it) = (context.len(), &context.iteration);
    let iterations = context.runs + 1;
    let faces = PlanarFaces::new(context.device, n, LIST, iterations, None)?;
    // A counter an iteration: a run counts for itself.
    let mut record = |recorder: &mut _, number| faces.record(recorder, &it.inputs(), &it.planar_move(number));
    let mut first = |recorder: &mut _, _| faces.record(recorder, &it.inputs(), &it.planar_move(0));
    context.submit(&mut first, 0)?;
    let insecure = faces.insecure.to_vec(context.device)?;
    let (rest, open) = (insecure[0] as usize, insecure[iterations as usize] as usize);
    let listed = insecure[2 * iterations as usize..].iter().take(rest.min(24)).map(|i| *i as usize);
    check_targets(context, &faces, listed)?;
    let near = n * (16 + 4 + 4 * NEAR as usize + 8 + 16 + 32);
    let share = 100.0 * rest as f64 / n as f64;
    let works = [
        Work::new("face.planar", near),
        Work {
            kernel: "face.planar_rest",
            bytes: rest * (4 + 16 + 4 + 4 * LIST as usize + 8 + 16 + 32),
            note: format!("{rest} sites ({share:.2} %), {open} left open"),
        },
    ];
    context.time(&works, &mut record)
}

/// The targets of the samples, and of `listed` sites, are the centroids of their faces.
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
        let cautious = face.radius() > 0.99 * f64::from(context.iteration.widest());
        if cautious || middle.length() > 0.49 * context.spacing {
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
    let polygons = PlanarPolygons::new(context.device, n, LIST, None)?;
    let mut record = |recorder: &mut _, _| polygons.record(recorder, &it.inputs(), it.widest());
    context.submit(&mut record, 0)?;
    let normals = it.normals.normals.to_vec(context.device)?;
    let count = polygons.corner_count.to_vec(context.device)?;
    let corners = polygons.corners.to_vec(context.device)?;
    let fan = polygons.fan.to_vec(context.device)?;
    let secure = polygons.secure.to_vec(context.device)?;
    let mut compared = 0;
    for (&i, near) in context.samples.iter().zip(&context.near).filter(|(i, _)| secure[**i] == 1) {
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
    let bytes = n * (16 + 4 + 4 * LIST as usize + 8 + 4 + 4) + 12 * all;
    context.time(&[Work::new("face.polygons", bytes)], &mut record)
}
