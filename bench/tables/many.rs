//! Many small meshes, one after another on one `Remesher`: what is left besides the device's work.

use crate::markdown::{Table, number};
use crate::runs::{Bench, median};
use crate::section::Section;
use anyhow::Result;
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, MeasureDepth, Options, Remesher, Summary, TriMesh};
use std::collections::BTreeMap;
use std::time::Instant;

const MESHES: usize = 100;
const SIZES: [usize; 3] = [100, 300, 1000];

/// Spheres of different axes, with the default options and nothing measured but what warnings need; a quick
/// run has a tenth of them.
///
/// # Errors
/// Those of the device.
pub fn section(bench: &Bench) -> Result<Section> {
    let count = if bench.quick { MESHES / 10 } else { MESHES };
    let meshes = spheres(count)?;
    let mut table = Table::new(["#V", "ms/mesh", "device, ms", "wall/device", "phases, ms"]);
    for vertices in SIZES {
        println!("{count} spheres, {vertices} vertices each");
        let options = Options::new(vertices).measures(MeasureDepth::Basic);
        let mut walls = Vec::new();
        for _ in 0..bench.runs {
            walls.push(wall(&bench.device, &options, &meshes)?.0);
        }
        let (_, timed) = wall(&bench.timing, &options, &meshes)?;
        let mean = |sum: f64| sum / count as f64;
        let on_device = mean(timed.iter().map(device_time).sum());
        let per_mesh = median(&mut walls).map(mean);
        table.push(vec![
            vertices.to_string(),
            number(per_mesh, 2),
            number(Some(on_device), 2),
            number(per_mesh.map(|wall| wall / on_device), 2),
            phases(&timed),
        ]);
    }
    let text = vec![
        format!("{count} spheres on one `Remesher`: wall time of each, mean; median of {} runs.", bench.runs),
        "Device time and phases, with waiting for the device, are those of one more run with timed kernels."
            .to_owned(),
    ];
    let title = "Many small meshes".to_owned();
    Ok(Section { name: "many", title, text, table, rows: Vec::new(), charts: Vec::new() })
}

fn spheres(count: usize) -> Result<Vec<TriMesh>> {
    let ball = sample("sphere")?;
    let squeezed = |k: usize| {
        let axes = DVec3::new(1.0, 1.0 + 0.002 * k as f64, 1.0 - 0.002 * k as f64);
        TriMesh { vertices: ball.vertices.iter().map(|v| *v * axes).collect(), ..ball.clone() }
    };
    Ok((0..count).map(squeezed).collect())
}

/// Wall milliseconds of all meshes after a first one that compiles kernels, and what was measured of each.
fn wall(device: &Device, options: &Options, meshes: &[TriMesh]) -> Result<(f64, Vec<Summary>)> {
    let remesher = Remesher::new(device, options.clone())?;
    if let Some(first) = meshes.first() {
        remesher.remesh(first)?;
    }
    let begin = Instant::now();
    let one = |mesh| Ok(remesher.remesh(mesh)?.summary);
    let summaries = meshes.iter().map(one).collect::<Result<_>>()?;
    Ok((1e3 * begin.elapsed().as_secs_f64(), summaries))
}

fn device_time(summary: &Summary) -> f64 {
    summary.timings.stages.iter().filter_map(|stage| stage.milliseconds).sum()
}

/// Mean milliseconds of each phase, longest first.
fn phases(summaries: &[Summary]) -> String {
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    for phase in summaries.iter().flat_map(|summary| &summary.timings.phases) {
        *sums.entry(phase.name).or_default() += phase.milliseconds / summaries.len() as f64;
    }
    let mut sums: Vec<_> = sums.into_iter().collect();
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    sums.iter().map(|(name, ms)| format!("{name} {ms:.2}")).collect::<Vec<_>>().join(", ")
}
