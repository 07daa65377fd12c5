//! A CAD part with its creases and a line of its user: `cargo run --release --example sharp_edges`

use rtfmesh::mesh::features::FeatureLine;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, DeviceOptions, FeatureLines, Options, remesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let part = sample("box")?;
    // A line runs along edges of the input; any will do here.
    let points = part.triangles[0][..2].iter().map(|v| part.vertices[*v as usize]).collect();
    let line = FeatureLine { line: 1, points };
    let options = Options::new(2000).feature_angle(30.0).features(FeatureLines::new(vec![line]));
    let device = Device::open(&DeviceOptions::from_env())?;
    let result = remesh(&device, &part, &options)?;
    if let Some(kept) = result.summary.features {
        println!("{} vertices on {} curves", kept.curve_sites, kept.curves);
    }
    Ok(())
}
