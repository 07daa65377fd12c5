//! Neighbour lists, the bounds that keep them valid, and the normals over them.

use crate::check::{near_list, unpack_normal};
use crate::context::{Context, Group, Work};
use crate::iteration::LIST;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::{DVec3, Vec4};
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::NONE;
use rtfmesh::stages::neighbours::lists::NEAR;
use rtfmesh::stages::normals::SmoothNormals;

/// In the order of the iteration.
pub const GROUPS: [Group; 3] = [
    Group { kernels: &["neighbours.moved", "neighbours.decide"], most_sites: usize::MAX, run: refresh },
    Group { kernels: &["neighbours.box_levels", "neighbours.lists"], most_sites: usize::MAX, run: build },
    Group { kernels: &["normals.smooth"], most_sites: usize::MAX, run: smooth },
];

/// Distances moved since the lists were built, after a move that is too small to build them again.
fn refresh(context: &Context) -> Result<Vec<Row>> {
    let (n, lists) = (context.len(), &context.iteration.lists);
    let off = |i: usize| 0.02 * context.spacing as f32 * (i % 7) as f32;
    let moved: Vec<Vec4> = (0..n).map(|i| context.sites[i] + Vec4::X * off(i)).collect();
    let buffer = Buffer::from_slice(context.device, "bench.moved_sites", &moved)?;
    let reach = lists.reach.to_vec(context.device)?;
    let builds = lists.status.to_vec(context.device)?[2];
    context.submit(&mut |recorder, _| lists.record_refresh(recorder, &buffer, 0.5), 0)?;
    let away = lists.away.to_vec(context.device)?;
    let mut rho = 0.0_f32;
    for i in 0..n {
        let want = moved[i].distance(context.sites[i]);
        let got = reach[i].y - away[i].y;
        ensure!(
            (got - want).abs() <= 1e-5 * want + 1e-6 * reach[i].y,
            "site {i} moved {got} instead of {want}"
        );
        rho = rho.max(want / reach[i].y);
    }
    let status = lists.status.to_vec(context.device)?;
    let told = f32::from_bits(status[1]);
    ensure!((told - rho).abs() <= 1e-5 * rho, "rho is {told} instead of {rho}");
    ensure!(status[2] == builds, "the lists were built again");
    let works = [Work::new("neighbours.moved", 48 * n), Work::new("neighbours.decide", 0)];
    let rows = context.time(&works, &mut |recorder, _| lists.record_refresh(recorder, &buffer, 0.5))?;
    // The sites did not move, so the lists must not say that they did.
    context.submit(&mut |recorder, _| lists.record_build(recorder, &context.iteration.sites), 0)?;
    ensure!(lists.status.to_vec(context.device)?[2] == builds + 1, "the lists were not built again");
    Ok(rows)
}

fn build(context: &Context) -> Result<Vec<Row>> {
    let (n, k) = (context.len(), LIST as usize);
    let (lists, sites) = (&context.iteration.lists, &context.iteration.sites);
    context.submit(&mut |recorder, _| lists.record_build(recorder, sites), 0)?;
    let neighbours = lists.neighbours.to_vec(context.device)?;
    let reach = lists.reach.to_vec(context.device)?;
    for (sample, &i) in context.samples.iter().enumerate() {
        let got: Vec<u32> = (0..k).map(|s| neighbours[s * n + i]).collect();
        near_list(context, sample, &got)?;
        for (got, rank) in [(reach[i].x, NEAR as usize), (reach[i].y, k)] {
            let want = context.points[context.near[sample][rank] as usize].distance(context.points[i]);
            ensure!((f64::from(got) - want).abs() <= 1e-6 * want, "site {i}: reach {got} instead of {want}");
        }
    }
    // A box is 32 bytes, and each level has an eighth of the boxes below it.
    let boxes =
        |below: usize| std::iter::successors(Some(below.div_ceil(8)), |b| (*b > 8).then(|| b.div_ceil(8)));
    let bytes = 32 * boxes(n).sum::<usize>();
    let level_bytes = 16 * n + bytes + (bytes - 32 * n.div_ceil(8));
    let list_bytes = 16 * n + bytes + n * (4 * k + 8 + 16 + 8);
    let works = [Work::new("neighbours.box_levels", level_bytes), Work::new("neighbours.lists", list_bytes)];
    context.time(&works, &mut |recorder, _| lists.record_build(recorder, sites))
}

fn smooth(context: &Context) -> Result<Vec<Row>> {
    let n = context.len();
    let (lists, settle) = (&context.iteration.lists, &context.iteration.settle);
    let smooth = SmoothNormals::new(context.device, n, false, None)?;
    let mut record = |recorder: &mut _, _| {
        smooth.record(recorder, &settle.surface_normals, &lists.neighbours, &context.iteration.sites)
    };
    context.submit(&mut record, 0)?;
    let own = settle.surface_normals.to_vec(context.device)?;
    let got = smooth.normals.to_vec(context.device)?;
    let neighbours = lists.neighbours.to_vec(context.device)?;
    let mut compared = 0;
    for &i in &context.samples {
        let mine = unpack_normal(own[i]);
        let around: Vec<DVec3> = (0..6)
            .map(|s| neighbours[s * n + i])
            .filter(|j| *j != NONE)
            .map(|j| unpack_normal(own[j as usize]))
            .collect();
        // In folds of the surface the kernel decides by counting; elsewhere it takes the plain mean.
        if around.iter().all(|n| n.dot(mine) > 0.01) {
            let want = (mine + around.iter().sum::<DVec3>()).normalize();
            let off = unpack_normal(got[i]).distance(want);
            ensure!(off < 2e-4, "site {i}: the normal is {off} off the mean");
            compared += 1;
        }
    }
    ensure!(2 * compared > context.samples.len(), "only {compared} normals could be compared");
    context.time(&[Work::new("normals.smooth", n * (4 + 4 * 6 + 4))], &mut record)
}
