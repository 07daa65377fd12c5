//! `project/nearest_vertices` against its definition.

use crate::reference::knn::nearest;
use crate::reference::nearest_vertices::distance;
use crate::support::{assert_valid, cloud, device, rounded, slots, upload};
use glam::{DVec3, Vec4};
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::{Surface, SurfaceBuffers};
use rtfmesh::stages::project::nearest_vertices::NearestVertices;

fn assert_projected(mesh: &TriMesh, targets: &[DVec3], k: u32, workgroup: u32) {
    let device = device();
    let surface = Surface::new(mesh, &UnitFrame::of(mesh).unwrap());
    let (targets, vertices) = (rounded(targets), rounded(&surface.vertices));
    let near = nearest(&targets, &vertices, k as usize, false);
    let neighbours = slots(&near, k as usize);
    let project = NearestVertices::new(device, targets.len(), k, Some(workgroup)).unwrap();
    let under = Buffer::<u32>::new(device, "test.site_triangle", targets.len()).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    let buffer = upload("test.targets", &targets);
    let neighbours = Buffer::from_slice(device, "test.neighbours", &neighbours).unwrap();
    project
        .record(&mut recorder, &buffer, &neighbours, &SurfaceBuffers::new(device, &surface).unwrap(), &under)
        .unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let under = under.to_vec(device).unwrap();
    let got: Vec<Vec4> = project.projected.to_vec(device).unwrap();
    for (i, at) in targets.iter().enumerate() {
        let to = got[i].truncate().as_dvec3();
        let want = distance(*at, &near[i], &vertices, &surface.triangles);
        assert!((to.distance(*at) - want).abs() < 2e-6, "target {i}: {} instead of {want}", to.distance(*at));
        assert!((f64::from(got[i].w) - want).abs() < 2e-6, "target {i}: distance {}", got[i].w);
        // And it lies on the triangle that it names, or on a corner of a neighbouring one (the corner case).
        let [a, b, c] = surface.triangles[under[i] as usize].map(|v| vertices[v as usize]);
        let n = (b - a).cross(c - a).normalize();
        assert!((to - a).dot(n).abs() < 2e-6, "target {i} is off triangle {}", under[i]);
    }
}

#[test]
fn projections_are_the_nearest_ones() {
    for name in ["torus", "genus3", "thin-plate", "box"] {
        assert_projected(&sample(name).unwrap(), &cloud(300, 0.8, 1), 16, 64);
    }
}

#[test]
fn projection_sizes_and_slivers() {
    for count in [0, 1, 15, 16, 17, 63, 64, 65] {
        for workgroup in [16, 64] {
            assert_projected(&sample("torus").unwrap(), &cloud(count, 0.8, 2), 4, workgroup);
        }
    }
    // Long slivers, seen from beyond their ends: the corner case.
    let fan = TriMesh {
        vertices: [(0.0, 0.0), (1.0, 0.0), (1.0, 1e-3), (1.0, 2e-3), (-1.0, 0.5)]
            .map(|(x, y)| DVec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]],
    };
    assert_projected(&fan, &cloud(400, 2.0, 3), 3, 64);
}
