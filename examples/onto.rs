//! Carries a field of the input, here its height, over to the new vertices:
//! `cargo run --release --example onto`

use rtfmesh::mesh::samples::sample;
use rtfmesh::{CorrespondenceRequest, Device, DeviceOptions, Options, remesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let input = sample("bumpy-sphere")?;
    let heights: Vec<f64> = input.vertices.iter().map(|p| p.z).collect();
    // Asks for the point of the input that each new vertex lies at.
    let request = CorrespondenceRequest { vertices: true, faces: false };
    let device = Device::open(&DeviceOptions::from_env())?;
    let result = remesh(&device, &input, &Options::new(2000).correspondence(request))?;
    let correspondence = result.correspondence.ok_or("it was asked for")?;
    // Each is a triangle of the input and the weights of its three corners.
    let carried = correspondence.vertices.iter().map(|point| {
        let corners = input.triangles[point.triangle as usize];
        corners.iter().zip(point.barycentric).map(|(v, weight)| weight * heights[*v as usize]).sum::<f64>()
    });
    let worst =
        carried.zip(&result.mesh.vertices).map(|(height, p)| (height - p.z).abs()).fold(0.0, f64::max);
    println!("heights differ by {worst:.4} at most: vertices leave the surface by a little to fit it better");
    Ok(())
}
