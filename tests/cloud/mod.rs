//! Point clouds: normals, surfaces and what is refused.

mod distances;
mod files;
mod scanners;
mod surface;
mod survey;
pub mod terrain;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rtfmesh::TriMesh;
use rtfmesh::cloud::PointCloud;

/// Random points of a mesh with the normals of its faces, even by area.
pub fn sampled(mesh: &TriMesh, count: usize, seed: u64) -> PointCloud {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut ends = Vec::new();
    let mut area = 0.0;
    for t in 0..mesh.triangles.len() {
        area += mesh.triangle_area(t);
        ends.push(area);
    }
    let mut cloud = PointCloud::default();
    for _ in 0..count {
        let at = rng.random::<f64>() * area;
        let t = ends.partition_point(|end| *end < at).min(ends.len() - 1);
        let [a, b, c] = mesh.corners(t);
        let (root, share) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
        cloud.points.push(a + root * (1.0 - share) * (b - a) + root * share * (c - a));
        cloud.normals.push((b - a).cross(c - a).normalize());
    }
    cloud
}

/// The same without normals.
pub fn without_normals(cloud: &PointCloud) -> PointCloud {
    PointCloud { normals: Vec::new(), ..cloud.clone() }
}

/// Points moved by up to `size` in each direction.
pub fn shaken(cloud: &PointCloud, size: f64, seed: u64) -> PointCloud {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut random = || size * (2.0 * rng.random::<f64>() - 1.0);
    let points = cloud.points.iter().map(|p| *p + DVec3::new(random(), random(), random())).collect();
    PointCloud { points, ..cloud.clone() }
}
