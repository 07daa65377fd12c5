//! A field of the input, here its height, onto the new vertices: `cargo run --release --example onto`

use rtfmesh::mesh::samples::sample;
use rtfmesh::{CorrespondenceRequest, Device, DeviceOptions, Options, remesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let input = sample("bumpy-sphere")?;
    let heights: Vec<f64> = input.vertices.iter().map(|p| p.z).collect();
    let device = Device::open(&DeviceOptions::from_env())?;
    let options = Options::new(2000).correspondence(CorrespondenceRequest { vertices: true, faces: false });
    let result = remesh(&device, &input, &options)?;
    let correspondence = result.correspondence.ok_or("it was asked for")?;
    let onto = correspondence.vertices.iter().map(|point| {
        let corners = input.triangles[point.triangle as usize];
        corners.iter().zip(point.barycentric).map(|(v, weight)| weight * heights[*v as usize]).sum::<f64>()
    });
    let worst = onto.zip(&result.mesh.vertices).map(|(height, p)| (height - p.z).abs()).fold(0.0, f64::max);
    println!("heights differ by {worst:.4} at most: vertices leave the surface by a little to fit it better");
    Ok(())
}
