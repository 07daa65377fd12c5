//! Progress, and an end before time: `cargo run --release --example progress`

use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, DeviceOptions, Flow, Options, Quality, remesh};
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let device = Device::open(&DeviceOptions::from_env())?;
    let begin = Instant::now();
    let options = Options::with_quality(20_000, Quality::Best);
    let result = remesh(&device, &sample("genus3")?, &options, &mut |now| {
        println!("{:5.1} %  {}", 100.0 * now.fraction, now.phase.name());
        // What there is by then is finished: polished less, but whole. Flow::Cancel would throw it away.
        if begin.elapsed() > Duration::from_secs(2) { Flow::Finish } else { Flow::Continue }
    })?;
    println!("{} vertices, finished early: {}", result.mesh.vertices.len(), result.summary.finished_early);
    Ok(())
}
