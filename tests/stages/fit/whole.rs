//! A round of the fit on the device against one on the host.

use super::inward::points;
use crate::stages::polish::fixture::{Ground, read};
use crate::support::passes::fit;
use crate::support::shapes::moved;
use crate::support::{assert_valid, device, rounded};
use glam::DVec3;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::polish::{FitOptions, Target};
use rtfmesh::stages::fit::equations::Equations;
use rtfmesh::stages::fit::inward::{InwardSamples, SurfacePoint};
use rtfmesh::stages::fit::limit::Limits;
use rtfmesh::stages::fit::mesh::FitMesh;
use rtfmesh::stages::fit::samples::FaceSamples;
use rtfmesh::stages::polish::mesh::DeviceMesh;
use rtfmesh::{Options, TriMesh, remesh};

/// The vertices of a surface with the areas around them.
fn surface_points(surface: &TriMesh, mesh: &TriMesh) -> Vec<SurfacePoint> {
    let areas = crate::reference::fit::thirds(surface);
    let with_area = |(point, area): (SurfacePoint, f64)| SurfacePoint { area, ..point };
    points(surface, mesh, 1).into_iter().zip(areas).map(with_area).collect()
}

#[test]
fn a_round_is_that_of_the_host() {
    // Vertices on the surface, with good triangles: else the limits decide, and these are met or not.
    let input = sample("torus").unwrap();
    let frame = UnitFrame::of(&input).unwrap();
    let surface = moved(&input, |p| frame.to_unit(p));
    let ground = Ground::new(&surface);
    let mesh = remesh(device(), &surface, &Options::new(700).fit(false)).unwrap().mesh;
    let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
    let mut on_host = mesh.clone();
    let options = FitOptions { rounds: 1, ..FitOptions::default() };
    fit(&mut on_host, &Target::new(&surface), &options);
    let device = device();
    let on_device = DeviceMesh::new(device, &mesh).unwrap();
    let fit = FitMesh::new(device, &on_device, None).unwrap();
    let samples = FaceSamples::new(device, (&fit, &ground.records), None, None).unwrap();
    let points = surface_points(&surface, &mesh);
    let inward = InwardSamples::new(device, &points, mesh.triangles.len(), None).unwrap();
    let solver = Equations::new(device, mesh.vertices.len(), fit.edges.len(), None).unwrap();
    let limits = Limits::new(device, mesh.vertices.len(), None).unwrap();
    let under: Vec<u32> = mesh.vertices.iter().map(|p| ground.under(*p)).collect();
    let under = Buffer::from_slice(device, "test.under", &under).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    fit.record(&mut recorder).unwrap();
    samples.record_tree(&mut recorder, &ground.records).unwrap();
    samples.record(&mut recorder, &fit, &ground.records, &under, 0.0).unwrap();
    inward.record(&mut recorder, &fit).unwrap();
    solver.record(&mut recorder, &fit, &samples, &inward).unwrap();
    solver.record_solve(&mut recorder, &fit, 8).unwrap();
    limits.record(&mut recorder, &fit, &solver.moves, options.min_angle.to_radians() as f32).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let got = read(&on_device);
    let norm =
        |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum::<f64>().sqrt();
    let (far, apart) = (norm(&on_host.vertices, &mesh.vertices), norm(&got.vertices, &on_host.vertices));
    assert!(apart < 0.1 * far, "{apart} apart after moves of {far}");
}
