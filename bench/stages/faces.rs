//! Faces by intervals, their targets, and their polygons.

use crate::check::{known_face, unpack_normal};
use crate::context::{Context, Group, Work};
use crate::iteration::LIST;
use crate::reference::centroid::area_centroid;
use crate::results::Row;
use crate::shapes_of_faces::assert_same_polygon;
use anyhow::{Result, ensure};
use glam::{DVec2, Vec2};
use rtfmesh::gpu::Buffer;
use rtfmesh::stages::planar::{NEAR, PlanarFaces, PlanarInputs, PlanarPolygons};

/// What the default pipeline does, and its polygons for those who want them.
pub const GROUPS: [Group; 2] = [
    Group { kernels: &["face.planar", "face.planar_rest"], most_sites: usize::MAX, run: planar },
    Group { kernels: &["face.polygons"], most_sites: usize::MAX, run: polygons },
];

/// Relaxed sites leave next to nothing to the second round, so it is given every so many sites to be seen at work.
const FORCED: usize = 16;

fn planar(context: &Context) -> Result<Vec<Row>> {
    let (n, it) = (context.len(), &context.iteration);
    let iterations = context.runs + 1;
    let site_bytes = |lines: usize| 16 + 4 + 4 * lines + 8 + 16 + 32;
    let mut rows = Vec::new();
    let away: Vec<Vec2> = it.lists.away.to_vec(context.device)?;
    // The first neighbours of a site decide nothing if the next one may be right beside it.
    let short = away.iter().enumerate().map(|(i, r)| if i % FORCED == 0 { Vec2::new(0.0, r.y) } else { *r });
    let short = Buffer::from_slice(context.device, "bench.short_away", &short.collect::<Vec<_>>())?;
    for away in [&it.lists.away, &short] {
        let faces = PlanarFaces::new(context.device, n, LIST, iterations, false, None)?;
        let inputs = PlanarInputs { away, ..it.inputs() };
        // A counter an iteration: a run counts for itself.
        let mut record = |recorder: &mut _, number| faces.record(recorder, &inputs, &it.planar_move(number));
        context.submit(&mut record, 0)?;
        let insecure = faces.insecure.to_vec(context.device)?;
        let (rest, open) = (insecure[0] as usize, insecure[iterations as usize] as usize);
        let listed = insecure[2 * iterations as usize..].iter().take(rest.min(24)).map(|i| *i as usize);
        check_targets(context, &faces, listed)?;
        let work = if rows.is_empty() {
            let note = format!("leaves {rest} sites undecided, of which the lists leave {open}");
            Work { note, ..Work::new("face.planar", n * site_bytes(NEAR as usize)) }
        } else {
            let note = format!("given {rest} sites");
            Work { note, ..Work::new("face.planar_rest", rest * (4 + site_bytes(LIST as usize))) }
        };
        rows.extend(context.time(&[work], &mut record)?);
    }
    Ok(rows)
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
