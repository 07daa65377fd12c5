//! Progress, and an end before time: `cargo run --release --example progress`

use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, DeviceOptions, Flow, Options, Quality, remesh_with_progress};
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let device = Device::open(&DeviceOptions::from_env())?;
    let begin = Instant::now();
    let options = Options::with_quality(20_000, Quality::Best);
    let result = remesh_with_progress(&device, &sample("genus3")?, &options, |now| {
        println!("{:5.1} %  {}", 100.0 * now.fraction, now.phase.name());
        // The mesh is polished less, but complete. Flow::Cancel would give no mesh.
        if begin.elapsed() > Duration::from_secs(2) { Flow::Finish } else { Flow::Continue }
    })?;
    println!("{} vertices, finished early: {}", result.mesh.vertices.len(), result.summary.finished_early);
    Ok(())
}
