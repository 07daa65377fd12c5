//! `fit/{clamp, extremes, spoiled, shorten, hold, accept}`.

use crate::reference::fit::limited;
use crate::stages::polish::fixture::{read, uneven};
use crate::support::shapes::{plane, sphere};
use crate::support::{assert_valid, device, rng, rounded};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::fit::limit::Limits;
use rtfmesh::stages::fit::mesh::FitMesh;
use rtfmesh::stages::polish::mesh::DeviceMesh;

/// The mesh after the moves, and how many of them were shortened.
fn moved(mesh: &TriMesh, moves: &[DVec3], least: f64, workgroup: u32) -> (TriMesh, usize) {
    let device = device();
    let on_device = DeviceMesh::new(device, mesh).unwrap();
    let fit = FitMesh::new(device, &on_device, Some(workgroup)).unwrap();
    let limits = Limits::new(device, mesh.vertices.len(), Some(workgroup)).unwrap();
    let moves: Vec<Vec4> = moves.iter().map(|step| step.as_vec3().extend(0.0)).collect();
    let moves = Buffer::from_slice(device, "test.moves", &moves).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    fit.record(&mut recorder).unwrap();
    limits.record(&mut recorder, &fit, &moves, least as f32).unwrap();
    let held = limits.download_held(&mut recorder).unwrap();
    let held = recorder.submit().unwrap().first(&held).unwrap();
    assert_valid(device);
    (read(&on_device), held as usize)
}

/// Random moves of up to so many edges.
fn random_moves(mesh: &TriMesh, most: f64, seed: u64) -> Vec<DVec3> {
    let [a, b, _] = mesh.triangles[0].map(|v| mesh.vertices[v as usize]);
    let mut rng = rng(seed);
    let mut one = || most * a.distance(b) * (2.0 * rng.random::<f64>() - 1.0);
    rounded(&mesh.vertices.iter().map(|_| DVec3::new(one(), one(), one())).collect::<Vec<_>>())
}

#[test]
fn moves_are_made_as_far_as_triangles_stay_good() {
    let least = 38_f64.to_radians();
    for (jitter, most) in [(0.1, 0.02), (0.1, 0.1), (0.1, 0.4), (0.3, 0.1)] {
        let mesh = uneven(40, 22, jitter, 3);
        let moves = random_moves(&mesh, most, 4);
        let want = limited(&mesh, &moves, least);
        for workgroup in [16, 64] {
            let (got, held) = moved(&mesh, &moves, least, workgroup);
            let off = |v: usize| got.vertices[v].distance(mesh.vertices[v] + want[v]);
            let differ = (0..want.len()).filter(|v| off(*v) > 1e-6).count();
            let shortened = (0..want.len()).filter(|v| want[*v] != moves[*v]).count();
            // A triangle may be as good as spoiled.
            assert!(differ <= want.len() / 100, "{differ} of {} differ", want.len());
            assert!(held.abs_diff(shortened) <= want.len() / 50, "{held} for {shortened}");
        }
    }
}

#[test]
fn boundaries_and_moves_of_any_length_are_met() {
    // As many vertices as a workgroup, and one more or less.
    for (n, workgroup) in [(1, 4), (3, 15), (3, 16), (3, 17)] {
        let mesh = plane(n, 0.0);
        let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
        let none = vec![DVec3::ZERO; mesh.vertices.len()];
        assert_eq!(moved(&mesh, &none, 0.6, workgroup), (mesh, 0));
    }
    let round = sphere(0.4, 3);
    let round = TriMesh { vertices: rounded(&round.vertices), ..round };
    for length in [1e-30, 1e3, 1e20] {
        let (got, _) = moved(&round, &random_moves(&round, length, 6), 0.6, 64);
        let far = got.vertices.iter().zip(&round.vertices).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(far < 0.1, "{far}");
    }
    let empty = TriMesh::default();
    assert_eq!(moved(&empty, &[], 0.6, 64), (empty, 0));
}
