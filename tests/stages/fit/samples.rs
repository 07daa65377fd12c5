//! `fit/{vertices, faces, corner_samples, points, face_samples}`.

use crate::reference::fit::{area, corners, doubled_normal, thirds};
use crate::reference::polish::{edges, onto_surface, vertex_normal};
use crate::stages::polish::fixture::{Ground, uneven};
use crate::support::shapes::{plane, tetrahedron};
use crate::support::{assert_valid, device, rounded};
use glam::{DVec3, Vec4};
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::fit::mesh::FitMesh;
use rtfmesh::stages::fit::samples::FaceSamples;
use rtfmesh::stages::polish::mesh::DeviceMesh;

/// The samples at vertices, centres of triangles and middles of edges; with the edges' half-edges.
struct Looked {
    at_vertices: Vec<Vec4>,
    at_faces: Vec<Vec4>,
    at_edges: Vec<Vec4>,
    edges: Vec<u32>,
    frames: Vec<Vec4>,
    areas: Vec<f32>,
}

fn looked_up(mesh: &TriMesh, ground: &Ground, workgroup: u32, chunk: Option<usize>) -> Looked {
    let device = device();
    let on_device = DeviceMesh::new(device, mesh).unwrap();
    let fit = FitMesh::new(device, &on_device, Some(workgroup)).unwrap();
    let samples = FaceSamples::new(device, (&fit, &ground.records), Some(workgroup), chunk).unwrap();
    let under: Vec<u32> = mesh.vertices.iter().map(|p| ground.under(*p)).collect();
    let under = Buffer::from_slice(device, "test.under", &under).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    fit.record(&mut recorder).unwrap();
    samples.record_tree(&mut recorder, &ground.records).unwrap();
    samples.record(&mut recorder, &fit, &ground.records, &under, 0.0).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let read = |buffer: &Buffer<Vec4>| buffer.to_vec(device).unwrap();
    Looked {
        at_vertices: read(&samples.corners),
        at_faces: read(&samples.faces),
        at_edges: read(&samples.edges),
        edges: fit.edges.to_vec(device).unwrap(),
        frames: read(&fit.frames),
        areas: fit.areas.to_vec(device).unwrap(),
    }
}

/// How many samples are not of this weight, or lead elsewhere than to the closest point of the surface.
fn wrong(samples: &[Vec4], at: &[DVec3], weights: &[f64], surface: &TriMesh) -> usize {
    assert_eq!(samples.len(), at.len());
    let is_wrong = |((sample, p), weight): &((&Vec4, &DVec3), &f64)| {
        let direction = sample.truncate().as_dvec3();
        assert!((direction.length_squared() / **weight - 1.0).abs() < 1e-4, "{sample} for {weight}");
        let offset = direction * f64::from(sample.w) / **weight;
        (**p + offset).distance(onto_surface(surface, **p)) > 3e-6
    };
    samples.iter().zip(at).zip(weights).filter(is_wrong).count()
}

#[test]
fn samples_lead_to_the_closest_points_with_the_weight_of_their_area() {
    let surface = uneven(60, 30, 0.0, 1);
    let ground = Ground::new(&surface);
    let mesh = uneven(24, 12, 0.05, 2);
    let at = |v: u32| mesh.vertices[v as usize];
    let all = edges(&mesh);
    let around = |h: u32| all.iter().find(|edge| edge.half_edge == h).unwrap().around;
    for (workgroup, chunk) in [(64, None), (16, None), (64, Some(64)), (17, Some(100))] {
        let got = looked_up(&mesh, &ground, workgroup, chunk);
        assert_eq!(got.edges, all.iter().map(|edge| edge.half_edge).collect::<Vec<_>>());
        let thirds = thirds(&mesh);
        for (v, frame) in got.frames.iter().enumerate() {
            assert!((f64::from(frame.w) / thirds[v] - 1.0).abs() < 1e-4);
            assert!(frame.truncate().as_dvec3().distance(vertex_normal(&mesh, v as u32)) < 1e-4);
        }
        let areas: Vec<f64> = (0..mesh.triangles.len()).map(|t| area(&mesh, t)).collect();
        assert!(got.areas.iter().zip(&areas).all(|(got, want)| (f64::from(*got) / want - 1.0).abs() < 1e-4));
        let weights: Vec<f64> = thirds.iter().map(|third| 0.15 * third).collect();
        let at_vertices = wrong(&got.at_vertices, &mesh.vertices, &weights, &surface);
        let centres: Vec<DVec3> =
            mesh.triangles.iter().map(|t| t.map(at).into_iter().sum::<DVec3>() / 3.0).collect();
        let weights: Vec<f64> = areas.iter().map(|area| 0.45 * area).collect();
        let at_faces = wrong(&got.at_faces, &centres, &weights, &surface);
        let middles: Vec<DVec3> =
            got.edges.iter().map(|h| 0.5 * (at(around(*h)[0]) + at(around(*h)[1]))).collect();
        let beside = |h: &u32| {
            let [a, b, c, d] = around(*h).map(at);
            let pair = doubled_normal([a, b, c]).length() + doubled_normal([b, a, d]).length();
            2.0 / 15.0 * 0.5 * pair
        };
        let weights: Vec<f64> = got.edges.iter().map(beside).collect();
        let at_edges = wrong(&got.at_edges, &middles, &weights, &surface);
        // Where triangles make a valley, a walk can end on the farther side.
        let (few, wrong) = (mesh.triangles.len() / 50, [at_vertices, at_faces, at_edges]);
        assert!(wrong.iter().all(|count| *count <= few), "{wrong:?} samples lead elsewhere");
    }
}

#[test]
fn meshes_of_any_size_have_their_samples() {
    let flat = Ground::new(&plane(4, 0.0));
    for (mesh, workgroup) in [
        (plane(1, 0.0), 1),
        (plane(1, 0.0), 64),
        (plane(5, 0.0), 16),
        (plane(5, 0.0), 17),
        (tetrahedron(), 64),
    ] {
        let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
        let got = looked_up(&mesh, &flat, workgroup, None);
        for t in 0..mesh.triangles.len() {
            // A triangle that faces away from the surface has no sample.
            let up = doubled_normal(corners(&mesh, t)).z > 0.0;
            assert_eq!(got.at_faces[t].truncate() != glam::Vec3::ZERO, up, "{t}");
        }
        let boundary = mesh.vertices.iter().map(|p| [p.x, p.y].iter().any(|x| *x == 0.0 || *x == 1.0));
        if mesh.triangles.len() > 4 || mesh.triangles.len() == 2 {
            for (frame, open) in got.frames.iter().zip(boundary) {
                assert_eq!(frame.truncate() == glam::Vec3::ZERO, open);
            }
        }
    }
    let empty = looked_up(&TriMesh::default(), &flat, 64, None);
    assert!(empty.at_vertices.is_empty() && empty.edges.is_empty());
}
