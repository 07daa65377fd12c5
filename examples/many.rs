//! Many meshes on one device, such as the samples of a training set: `cargo run --release --example many`

use rtfmesh::mesh::samples::{names, sample};
use rtfmesh::{Device, DeviceOptions, MeasureDepth, Options, Remesher};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let device = Device::open(&DeviceOptions::from_env().timings(true))?;
    let remesher = Remesher::new(&device, Options::new(1000).measures(MeasureDepth::Basic))?;
    for (name, _) in names() {
        match remesher.remesh(&sample(name)?) {
            Ok(result) => {
                let timings = &result.summary.timings;
                // Not every device tells.
                let device: f64 = timings.stages.iter().filter_map(|stage| stage.milliseconds).sum();
                let faces = result.mesh.triangles.len();
                println!(
                    "{name}: {faces} faces in {:.0} ms, {device:.0} on the device",
                    timings.wall_milliseconds
                );
            }
            Err(error) => println!("{name}: {error}"),
        }
    }
    Ok(())
}
