//! `fit/{inward, keys, segments}`.

use crate::reference::closest::onto_triangle;
use crate::reference::fit::{corners, doubled_normal};
use crate::reference::polish::vertex_normal;
use crate::stages::polish::fixture::uneven;
use crate::support::{assert_valid, device, rng};
use glam::DVec3;
use rand::RngExt;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::fit::inward::{InwardSamples, SurfacePoint};
use rtfmesh::stages::fit::mesh::FitMesh;
use rtfmesh::stages::polish::mesh::DeviceMesh;

/// Vertices of a surface, with a triangle of the mesh that is not far.
pub fn points(surface: &TriMesh, mesh: &TriMesh, seed: u64) -> Vec<SurfacePoint> {
    let mut rng = rng(seed);
    let point = |v: u32| {
        let position = surface.vertices[v as usize];
        let far = |t: &usize| corners(mesh, *t)[0].distance_squared(position);
        let near = (0..mesh.triangles.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
        let area = 1e-4 * (1.0 + rng.random::<f64>());
        SurfacePoint { position, normal: vertex_normal(surface, v), area, near: near.unwrap() as u32 }
    };
    (0..surface.vertices.len() as u32).map(point).collect()
}

#[test]
fn vertices_of_the_surface_find_the_triangles_under_them() {
    let surface = uneven(30, 16, 0.0, 1);
    let mesh = uneven(24, 12, 0.05, 2);
    let device = device();
    let on_device = DeviceMesh::new(device, &mesh).unwrap();
    let all = points(&surface, &mesh, 3);
    for (count, workgroup) in [(0, 64), (1, 64), (15, 16), (16, 16), (17, 16), (all.len(), 64)] {
        let points = &all[..count];
        let fit = FitMesh::new(device, &on_device, Some(workgroup)).unwrap();
        let inward = InwardSamples::new(device, points, mesh.triangles.len(), Some(workgroup)).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        fit.record(&mut recorder).unwrap();
        inward.record(&mut recorder, &fit).unwrap();
        recorder.submit().unwrap();
        assert_valid(device);
        let (samples, weights) =
            (inward.samples.to_vec(device).unwrap(), inward.weights.to_vec(device).unwrap());
        let under = inward.under().to_vec(device).unwrap();
        let mut elsewhere = 0;
        for (i, point) in points.iter().enumerate() {
            let [a, b, c] = corners(&mesh, under[i] as usize);
            let w = weights[i].as_dvec2();
            let on = a * (1.0 - w.x - w.y) + b * w.x + c * w.y;
            let nearest = (0..mesh.triangles.len())
                .map(|t| onto_triangle(point.position, corners(&mesh, t)))
                .min_by(|p, q| p.distance(point.position).total_cmp(&q.distance(point.position)))
                .unwrap();
            elsewhere += usize::from(on.distance(nearest) > 3e-6);
            let direction = samples[i].truncate().as_dvec3();
            assert!((direction.length_squared() / (0.4 * point.area) - 1.0).abs() < 1e-4);
            let offset = direction * f64::from(samples[i].w) / (0.4 * point.area);
            assert!((on + offset).distance(point.position) < 3e-6, "point {i}");
        }
        assert!(elsewhere <= 1 + count / 50, "{elsewhere} of {count}");
        let (ranges, order) =
            (inward.ranges.to_vec(device).unwrap(), inward.by_triangle().to_vec(device).unwrap());
        for t in 0..mesh.triangles.len() {
            let wanted: Vec<u32> = (0..count as u32).filter(|i| under[*i as usize] == t as u32).collect();
            assert_eq!(order[ranges[2 * t] as usize..ranges[2 * t + 1] as usize], wanted, "triangle {t}");
        }
    }
}

#[test]
fn what_faces_away_from_the_mesh_is_no_sample() {
    let mesh = uneven(24, 12, 0.05, 2);
    let device = device();
    let on_device = DeviceMesh::new(device, &mesh).unwrap();
    let centre = |t: usize| corners(&mesh, t).into_iter().sum::<DVec3>() / 3.0;
    let sign = |t: usize| if t.is_multiple_of(3) { -1.0 } else { 1.0 };
    let point = |t: usize| SurfacePoint {
        position: centre(t),
        normal: sign(t) * doubled_normal(corners(&mesh, t)),
        area: 1e-4,
        near: t as u32,
    };
    let points: Vec<SurfacePoint> = (0..100).map(point).collect();
    let fit = FitMesh::new(device, &on_device, None).unwrap();
    let inward = InwardSamples::new(device, &points, mesh.triangles.len(), None).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    fit.record(&mut recorder).unwrap();
    inward.record(&mut recorder, &fit).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let ranges = inward.ranges.to_vec(device).unwrap();
    for (t, sample) in inward.samples.to_vec(device).unwrap().iter().enumerate() {
        assert_eq!(sample.truncate() == glam::Vec3::ZERO, sign(t) < 0.0, "point {t}");
        assert_eq!(ranges[2 * t + 1] - ranges[2 * t], u32::from(sign(t) > 0.0), "triangle {t}");
    }
}
