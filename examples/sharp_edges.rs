//! A CAD part, with its creases and a line of one's own: `cargo run --release --example sharp_edges`

use rtfmesh::io::FeatureLine;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, DeviceOptions, FeatureLines, Options, remesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let part = sample("box")?;
    // Any edge of the input, by its ends.
    let points = part.triangles[0][..2].iter().map(|v| part.vertices[*v as usize]).collect();
    let options = Options::new(2000)
        .feature_angle(30.0)
        .features(FeatureLines::new(vec![FeatureLine { line: 1, points }]));
    let device = Device::open(&DeviceOptions::from_env())?;
    let result = remesh(&device, &part, &options)?;
    if let Some(skeleton) = result.summary.features {
        println!("{} vertices on {} curves", skeleton.curve_sites, skeleton.curves);
    }
    Ok(())
}
