//! A scan into a mesh of even triangles: `cargo run --release --example remesh -- scan.ply even.ply 10000`

use rtfmesh::{Device, DeviceOptions, Options, io, remesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, vertices] = arguments.as_slice() else {
        return Err("give an input, an output and a number of vertices".into());
    };
    let scan = io::read(input)?.mesh;
    // The fastest device of the machine, or what RTFMESH_DEVICE names.
    let device = Device::open(&DeviceOptions::from_env())?;
    let result = remesh(&device, &scan, &Options::new(vertices.parse()?))?;
    // What was odd about the input, and what could not be done.
    for line in result.summary.remarks.iter().chain(&result.summary.warnings) {
        eprintln!("{line}");
    }
    let quality = &result.summary.output.quality;
    println!("mean quality {:.3}, smallest angle {:.1}°", quality.mean_quality, quality.min_angle);
    io::write(output, &result.mesh)?;
    Ok(())
}
