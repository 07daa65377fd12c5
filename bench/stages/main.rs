//! Every kernel alone, and the iteration of the default pipeline, on real geometry: checked, then timed. See
//! bench/README.md.

mod check;
mod context;
mod exact;
mod faces;
mod iteration;
mod moves;
mod neighbours;
mod order;
mod paper;
mod polish;
#[path = "../../tests/support/polygons.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod polygons;
#[path = "../../tests/reference/mod.rs"]
#[allow(clippy::unwrap_used, dead_code, reason = "shared with the tests, which fail by panicking")]
mod reference;
mod results;
mod sizing;

use anyhow::{Context as _, Result, ensure};
use clap::Parser;
use context::{Context, Group, Model};
use results::{Report, Row};
use rtfmesh::{Device, DeviceOptions, Error};
use std::path::PathBuf;
use std::time::Instant;

/// Times every kernel alone on relaxed sites of real surfaces.
#[derive(Parser)]
struct Args {
    /// Numbers of sites, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "10000,100000,1000000")]
    sizes: Vec<usize>,
    /// Timed runs of each kernel, after the one that is checked
    #[arg(long, default_value_t = 3)]
    runs: u32,
    /// Built-in model or mesh file; repeat it for several
    #[arg(long, default_values = ["torus", "genus3"])]
    mesh: Vec<String>,
    /// How many times farther apart the sites are at one end of the surface than at the other
    #[arg(long, default_value_t = 1.0)]
    density: f64,
    /// Device: an index, `cpu`, `gpu` or a part of the name
    #[arg(long)]
    device: Option<String>,
    /// Only kernels whose name contains this
    #[arg(long)]
    only: Option<String>,
    /// Writes the results to this file
    #[arg(long)]
    json: Option<PathBuf>,
    /// Prints ratios to the results in this file, which --json wrote
    #[arg(long)]
    compare: Option<PathBuf>,
    /// Passed by `cargo bench`; has no effect
    #[arg(long, hide = true)]
    bench: bool,
}

/// In the order of the iteration, and the polish after it; the kernels of the presets come last.
const GROUPS: [&[Group]; 9] = [
    &[iteration::GROUP],
    &neighbours::GROUPS,
    &faces::GROUPS,
    &moves::GROUPS,
    &sizing::GROUPS,
    &polish::GROUPS,
    &order::GROUPS,
    &paper::GROUPS,
    &exact::GROUPS,
];

fn main() -> Result<()> {
    let args = Args::parse();
    ensure!(args.runs > 0, "--runs must be at least 1");
    ensure!(args.sizes.iter().all(|n| *n >= 100), "--sizes must be at least 100");
    ensure!((1.0..=100.0).contains(&args.density), "--density must be 1 to 100");
    let earlier = args.compare.as_deref().map(Report::read).transpose()?;
    let mut options = DeviceOptions::from_env().timings(true);
    options.device = args.device.clone().or(options.device);
    let device = Device::open(&options)?;
    ensure!(device.info().limits.timestamp_ns > 0.0, "device '{}' has no timestamps", device.info().name);
    let mut report = Report::new(device.info(), args.runs);
    println!("{}", report.heading());
    for mesh in &args.mesh {
        let model = Model::load(&device, mesh).with_context(|| format!("mesh {mesh}"))?;
        for sites in &args.sizes {
            let begin = Instant::now();
            let rows = measure(&device, &model, *sites, &args)?;
            println!("{}", results::table(&rows, earlier.as_ref()));
            println!(
                "{mesh}, {sites} sites: all in {:.1} s, at most {:.2} GiB on the device\n",
                begin.elapsed().as_secs_f64(),
                device.peak_bytes() as f64 / f64::from(1 << 30)
            );
            report.rows.extend(rows);
        }
    }
    if let Some(path) = &args.json {
        report.write(path)?;
    }
    Ok(())
}

/// All kernels at one size. A kernel that does not fit on the device gets a row that says so.
fn measure(device: &Device, model: &Model, sites: usize, args: &Args) -> Result<Vec<Row>> {
    let wanted = |name: &str| args.only.as_deref().is_none_or(|part| name.contains(part));
    let context = match Context::new(device, model, sites, args.runs, args.density) {
        Ok(context) => context,
        Err(error) => return Ok(vec![Row::refused("all kernels", model, sites, too_large(error)?)]),
    };
    let mut rows = Vec::new();
    for group in GROUPS.into_iter().flatten() {
        if sites > group.most_sites || !group.kernels.iter().any(|k| wanted(k)) {
            continue;
        }
        match (group.run)(&context) {
            Ok(found) => rows.extend(found),
            Err(error) => {
                let why = too_large(error)?;
                rows.extend(group.kernels.iter().map(|k| Row::refused(k, model, sites, why.clone())));
            }
        }
    }
    rows.retain(|row| wanted(&row.kernel));
    Ok(rows)
}

/// The reason, if `error` is about memory.
fn too_large(error: anyhow::Error) -> Result<String> {
    match error.downcast_ref::<Error>() {
        Some(Error::OutOfMemory { what, bytes, problem, .. }) => {
            Ok(format!("{what}: {bytes} bytes, {problem}"))
        }
        _ => Err(error),
    }
}
