//! Spatial order: Morton codes, sort with its prefix sums, gathers.

use crate::context::{Context, Group, Work};
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::Vec4;
use rtfmesh::gpu::Buffer;
use rtfmesh::stages::spatial::SpatialOrder;

/// A single group, because the kernels need each other.
pub const GROUPS: [Group; 1] = [Group {
    kernels: &[
        "spatial.morton",
        "spatial.radix_count",
        "spatial.scan_sum",
        "spatial.scan_apply",
        "spatial.radix_scatter",
        "spatial.gather_vectors",
        "spatial.gather_indices",
    ],
    most_sites: usize::MAX,
    run: sort,
}];

/// Passes of the sort by 30 bits.
const PASSES: usize = 8;

fn sort(context: &Context) -> Result<Vec<Row>> {
    let (n, device, sites) = (context.len(), context.device, &context.iteration.sites);
    let order = SpatialOrder::new(device, n)?;
    let under = Buffer::from_slice(device, "bench.under", &context.under)?;
    let vectors = Buffer::<Vec4>::new(device, "bench.gathered_sites", n)?;
    let indices = Buffer::<u32>::new(device, "bench.gathered_under", n)?;
    let mut record = |recorder: &mut _, _| {
        order.record(recorder, sites)?;
        order.record_vectors(recorder, sites, &vectors)?;
        order.record_indices(recorder, &under, &indices)
    };
    context.submit(&mut record, 0)?;
    let (codes, places) = (order.codes().to_vec(device)?, order.order().to_vec(device)?);
    ensure!(codes.iter().zip(&places).is_sorted(), "the codes are not sorted, or ties not by index");
    let mut once = places.clone();
    once.sort_unstable();
    ensure!(once.into_iter().eq(0..n as u32), "a site is missing or occurs twice");
    let differing =
        places.iter().zip(&codes).filter(|(i, code)| morton(context.sites[**i as usize]) != **code).count();
    // A coordinate may be rounded into the next cell.
    ensure!(differing <= n / 500, "{differing} codes differ");
    let (vectors, indices) = (vectors.to_vec(device)?, indices.to_vec(device)?);
    for (new, old) in places.iter().map(|i| *i as usize).enumerate() {
        ensure!(vectors[new] == context.sites[old] && indices[new] == context.under[old], "site {old}");
    }
    // Sixteen counters for every 32 pairs, and one sum for every 32 values of the level below.
    let counts = 4 * 16 * n.div_ceil(32);
    let sums = counts / 31;
    let works = [
        Work::new("spatial.morton", 24 * n),
        Work::new("spatial.radix_count", PASSES * (4 * n + counts)),
        Work::new("spatial.scan_sum", PASSES * (counts + 2 * sums)),
        Work::new("spatial.scan_apply", PASSES * 2 * (counts + sums)),
        Work::new("spatial.radix_scatter", PASSES * (16 * n + counts)),
        Work::new("spatial.gather_vectors", 36 * n),
        Work::new("spatial.gather_indices", 12 * n),
    ];
    context.time(&works, &mut record)
}

/// The Morton code, interleaved bit by bit.
fn morton(p: Vec4) -> u32 {
    let cell = |x: f32| ((x + 0.51) * (1024.0 / 1.02)).clamp(0.0, 1023.0) as u32;
    let axes = [cell(p.x), cell(p.y), cell(p.z)];
    (0..30).map(|b| (axes[b % 3] >> (b / 3) & 1) << b).sum()
}
