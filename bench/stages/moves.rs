//! Projection onto the surface, and the move itself.

use crate::check::{ROUNDING, landed, unpack_normal};
use crate::context::{Context, Group, Work};
use crate::reference::closest::{distance_facing, normal_at, onto_triangle};
use crate::reference::keep_off::{NEAR, kept_off};
use crate::reference::pins::Mark;
use crate::reference::sizing::Site;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::{DVec3, Vec2, Vec4};
use rtfmesh::gpu::Buffer;
use rtfmesh::stages::face::planar::PlanarInputs;
use rtfmesh::stages::project::bvh::Bvh;
use rtfmesh::stages::project::closest::ClosestPoints;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::site_layout::SiteLayout;
use rtfmesh::stages::step::{KeepOff, Settle, Step};

/// The walk, and the search that can follow it, whose tree is built once for a surface; the moves, and the
/// clearance from curves.
pub const GROUPS: [Group; 4] = [
    Group {
        kernels: &["project.leaves", "project.join", "project.walk", "project.closest"],
        most_sites: usize::MAX,
        run: project,
    },
    Group { kernels: &["step.settle", "step.reduce"], most_sites: usize::MAX, run: settle },
    Group { kernels: &["step.step"], most_sites: usize::MAX, run: step },
    Group { kernels: &["step.keep_off"], most_sites: usize::MAX, run: keep_off },
];

/// The targets of the relaxed sites in an iteration without momentum.
pub fn targets(context: &Context) -> Result<Vec<Vec4>> {
    let it = &context.iteration;
    context.submit(&mut |recorder, _| it.faces.record(recorder, &it.inputs(), &it.planar_move(1)), 0)?;
    Ok(it.faces.targets.to_vec(context.device)?)
}

fn project(context: &Context) -> Result<Vec<Row>> {
    let (n, device, records) = (context.len(), context.device, &context.model.records);
    let wanted = targets(context)?;
    let targets = &context.iteration.faces.targets;
    let walk = Walk::new(device, n, None)?;
    let bvh = Bvh::new(device, records.len(), None)?;
    let closest = ClosestPoints::new(device, None)?;
    let under = Buffer::from_slice(device, "bench.under", &context.under)?;
    context.submit(
        &mut |recorder, _| {
            bvh.record(recorder, records)?;
            walk.record(recorder, targets, records, &under)
        },
        0,
    )?;
    let walked = walk.projected.to_vec(device)?;
    check_projected(context, &wanted, &walk, &under)?;
    let sides = walk.normals.to_vec(device)?;
    let search =
        |recorder: &mut _, _| closest.record(recorder, targets, records, &bvh, (&walk).into(), &under);
    context.submit(&mut { search }, 0)?;
    let found = walk.projected.to_vec(device)?;
    check_projected(context, &wanted, &walk, &under)?;
    let mut missed = 0;
    for &i in &context.samples {
        let (at, side) = (wanted[i].truncate().as_dvec3(), sides[i].truncate().as_dvec3());
        let distance = |least: f64| {
            let facing =
                distance_facing(at, &context.model.corners, &context.model.surface.normals, side, least);
            facing.min(f64::from(walked[i].w))
        };
        let (low, high, got) = (distance(-1e-3) - ROUNDING, distance(1e-3) + ROUNDING, f64::from(found[i].w));
        ensure!(low <= got && got <= high, "site {i}: {got} away from the surface, not {low} to {high}");
        missed += usize::from(f64::from(walked[i].w) > got + ROUNDING);
    }
    ensure!(10 * missed <= context.samples.len(), "{missed} walks ended too far away");
    // The triangles that sites lie on are the least that must be read; of a wedge each has half.
    let triangles = n.min(records.len());
    let (t, nodes) = (records.len(), 16 * bvh.nodes.len());
    let works = [
        Work {
            note: format!("{t} triangles, once a surface"),
            ..Work::new("project.leaves", (12 + 8) * t + nodes)
        },
        Work { note: "once a surface".to_owned(), ..Work::new("project.join", nodes) },
        Work::new("project.walk", n * (16 + 4 + 4 + 32) + (12 + 12 + 8 + 4) * triangles),
        Work::new("project.closest", n * (16 + 32 + 4 + 32 + 4) + (12 + 8 + 4) * triangles + nodes),
    ];
    context.time(&works, &mut |recorder, _| {
        recorder.upload(&under, &context.under)?;
        bvh.record(recorder, records)?;
        walk.record(recorder, targets, records, &under)?;
        closest.record(recorder, targets, records, &bvh, (&walk).into(), &under)
    })
}

/// Checks that points, distances, triangles and normals match.
fn check_projected(context: &Context, targets: &[Vec4], walk: &Walk, under: &Buffer<u32>) -> Result<()> {
    let projected = walk.projected.to_vec(context.device)?;
    let normals = walk.normals.to_vec(context.device)?;
    let under = under.to_vec(context.device)?;
    landed(context, &projected, &under)?;
    for &i in &context.samples {
        let (to, t) = (projected[i].truncate().as_dvec3(), under[i] as usize);
        let from = targets[i].truncate().as_dvec3();
        let off = (from.distance(to) - f64::from(projected[i].w)).abs();
        ensure!(off < ROUNDING, "site {i}: the distance is {off} off");
        let nearest = onto_triangle(from, context.model.corners[t]).distance(from);
        ensure!(from.distance(to) < nearest + ROUNDING, "site {i}: its own triangle has a nearer point");
        let off = normals[i].truncate().as_dvec3().distance(normal_at(to, t, &context.model.corners));
        ensure!(off < 2e-3, "site {i}: the normal is {off} off");
    }
    Ok(())
}

fn settle(context: &Context) -> Result<Vec<Row>> {
    let (n, device) = (context.len(), context.device);
    let wanted = targets(context)?;
    let targets = &context.iteration.faces.targets;
    let walk = Walk::new(device, n, None)?;
    let under = Buffer::from_slice(device, "bench.under", &context.under)?;
    let sites = Buffer::<Vec4>::new(device, "bench.settled", n)?;
    let settle = Settle::new(device, n, 1, None, SiteLayout::Marked, None)?;
    let mut record = |recorder: &mut _, _| settle.record(recorder, &walk, targets, &sites, 0);
    context.submit(&mut |recorder, _| walk.record(recorder, targets, &context.model.records, &under), 0)?;
    context.submit(&mut record, 0)?;
    let (projected, normals) = (walk.projected.to_vec(device)?, walk.normals.to_vec(device)?);
    let (got, packed) = (sites.to_vec(device)?, settle.surface_normals.to_vec(device)?);
    for i in 0..n {
        ensure!(got[i] == projected[i].with_w(0.0), "site {i} is not at its target");
        let off = unpack_normal(packed[i]).distance(normals[i].truncate().as_dvec3());
        ensure!(off < 2e-4, "site {i}: the normal is {off} off");
    }
    check_steps(&settle.history, context, &wanted.iter().map(|t| f64::from(t.w)).collect::<Vec<_>>())?;
    let partials = 8 * n.div_ceil(64);
    let works =
        [Work::new("step.settle", n * (16 * 3 + 16 + 4) + partials), Work::new("step.reduce", partials)];
    context.time(&works, &mut record)
}

/// Checks the root mean square and the largest step in the history.
fn check_steps(history: &Buffer<Vec2>, context: &Context, squares: &[f64]) -> Result<()> {
    let got = history.to_vec(context.device)?[0].as_dvec2();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let most = squares.iter().copied().fold(0.0, f64::max).sqrt();
    ensure!((got.x - rms).abs() <= 1e-4 * rms, "the step is {} instead of {rms}", got.x);
    ensure!((got.y - most).abs() <= 1e-5 * most, "the largest step is {} instead of {most}", got.y);
    Ok(())
}

fn step(context: &Context) -> Result<Vec<Row>> {
    let (n, device) = (context.len(), context.device);
    let wanted = targets(context)?;
    let targets = &context.iteration.faces.targets;
    let sites = Buffer::from_slice(device, "bench.stepped", &context.sites)?;
    let step = Step::new(device, n, 1, None)?;
    let mut record = |recorder: &mut _, _| step.record(recorder, targets, &sites, 0);
    context.submit(&mut record, 0)?;
    let got = sites.to_vec(device)?;
    let place = (0..n).find(|i| got[*i] != wanted[*i].with_w(0.0));
    ensure!(place.is_none(), "site {place:?} is not at its target");
    let far = |i: usize| (wanted[i] - context.sites[i]).truncate().as_dvec3().length_squared();
    check_steps(&step.history, context, &(0..n).map(far).collect::<Vec<_>>())?;
    context.time(&[Work::new("step.step", n * 48 + 8 * n.div_ceil(64))], &mut record)
}

/// As if every fifth site were on a curve that goes on for a spacing: more than there ever are.
fn keep_off(context: &Context) -> Result<Vec<Row>> {
    let (n, device, it) = (context.len(), context.device, &context.iteration);
    let wanted = targets(context)?;
    let normals: Vec<DVec3> = it.normals.normals.to_vec(device)?.into_iter().map(unpack_normal).collect();
    let site = |i: usize| {
        let direction = normals[i].any_orthonormal_vector();
        let mark = match i % 5 {
            0 => Mark::Pinned { direction, quarters: 4, anywhere: false },
            _ => Mark::Interior(0),
        };
        Site { at: context.points[i], normal: normals[i], mark, length: 1.0 }
    };
    let marked: Vec<Vec4> = (0..n).map(|i| context.sites[i].with_w(site(i).mark.encode())).collect();
    let marked = Buffer::from_slice(device, "bench.marked", &marked)?;
    let stage = KeepOff::new(device, false, None)?;
    let mut record = |recorder: &mut _, _| {
        let inputs = PlanarInputs { sites: &marked, ..it.inputs() };
        stage.record(recorder, &inputs, &it.faces.targets, context.spacing, None)
    };
    context.submit(&mut record, 0)?;
    let got = it.faces.targets.to_vec(device)?;
    let mut moved = 0;
    for (&i, near) in context.samples.iter().zip(&context.near) {
        let (own, to) = (site(i), wanted[i].truncate().as_dvec3());
        let around: Vec<Site> = near.iter().map(|j| site(*j as usize)).collect();
        let far = |k: usize| context.points[near[k] as usize].distance(own.at);
        // Of two sites at the same distance, the lists may contain either.
        if far(NEAR) - far(NEAR - 1) < 1e-4 * context.spacing {
            continue;
        }
        let kept = kept_off(&own, &around.iter().collect::<Vec<_>>(), context.spacing, to);
        let want = if own.mark.is_pinned() { to } else { kept };
        let off = got[i].truncate().as_dvec3().distance(want);
        ensure!(off < ROUNDING + 1e-3 * context.spacing, "site {i}: the target is {off} off");
        moved += usize::from(want != to);
    }
    ensure!(10 * moved > context.samples.len(), "only {moved} targets had to keep off");
    let bytes = n * (16 + 4 + 4 * NEAR + 2 * 16);
    context.time(&[Work::new("step.keep_off", bytes)], &mut record)
}
