//! Results that follow their inputs to other poses.

use crate::support::device;
use crate::support::shapes::{moved, prism, regular};
use glam::{DMat3, DVec3};
use rtfmesh::mesh::distance::distances;
use rtfmesh::mesh::feature_distance::feature_distances;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::subdivide::halve_long_edges;
use rtfmesh::{Error, Follower, Options, ProgressToken, TriMesh, remesh};

fn follower(input: &TriMesh, result: &TriMesh) -> Follower {
    Follower::new(input.clone(), result, &ProgressToken::default()).unwrap()
}

/// A cylinder along z with even triangles.
fn cylinder() -> TriMesh {
    let coarse = prism(&regular(64), 8.0);
    halve_long_edges(&coarse, 0.25, 100_000, &ProgressToken::default()).unwrap().unwrap()
}

/// Bends the z axis into an arc of this angle.
fn bent(mesh: &TriMesh, angle: f64) -> TriMesh {
    let radius = 8.0 / angle;
    moved(mesh, |p| {
        let (sine, cosine) = (p.z / radius).sin_cos();
        DVec3::new(radius - (radius - p.x) * cosine, p.y, (radius - p.x) * sine)
    })
}

#[test]
fn a_result_follows_turns_and_scales_exactly() {
    let input = sample("bumpy-sphere").unwrap();
    let result = remesh(device(), &input, &Options::new(500)).unwrap().mesh;
    let follower = follower(&input, &result);
    let turn = DMat3::from_rotation_z(1.0) * DMat3::from_rotation_x(2.0) * 3.0;
    let pose = |mesh: &TriMesh| moved(mesh, |p| turn * p + DVec3::new(5.0, 0.0, -7.0));
    let wanted = pose(&result).vertices;
    let without_triangles = TriMesh { triangles: Vec::new(), ..pose(&input) };
    for (found, wanted) in follower.follow(&without_triangles).unwrap().iter().zip(&wanted) {
        assert!(found.distance(*wanted) < 1e-9, "{found} {wanted}");
    }
    let again = follower.follow(&input).unwrap();
    let off = result.vertices.iter().zip(&again).map(|(a, b)| a.distance(*b));
    assert!(off.fold(0.0, f64::max) < 1e-12);
}

#[test]
fn bent_cylinders_are_as_close_as_the_straight_one_and_keep_their_rims() {
    let input = cylinder();
    let result = remesh(device(), &input, &Options::new(800)).unwrap().mesh;
    let follower = follower(&input, &result);
    let token = ProgressToken::default();
    let first = distances(&result, &input, &token).unwrap().rms;
    let off_rims = |mesh: &TriMesh, pose: &TriMesh| {
        feature_distances(mesh, pose, 40.0, &token).unwrap().to_reference.unwrap().rms
    };
    let rims = off_rims(&result, &input);
    for step in 1..=4 {
        let pose = bent(&input, 0.7 * f64::from(step));
        let mesh = TriMesh { vertices: follower.follow(&pose).unwrap(), triangles: result.triangles.clone() };
        let rms = distances(&mesh, &pose, &token).unwrap().rms;
        assert!(rms < 1.3 * first, "{step}: {rms} {first}");
        let found = off_rims(&mesh, &pose);
        assert!(found < 1.3 * rims, "{step}: {found} {rims}");
    }
}

#[test]
fn other_meshes_are_refused() {
    let input = sample("torus").unwrap();
    let follower = follower(&input, &input);
    let refusal = |pose: &TriMesh| match follower.follow(pose).unwrap_err() {
        Error::Input { problem, .. } => problem,
        other => panic!("{other}"),
    };
    let mut pose = input.clone();
    pose.triangles[5].rotate_left(1);
    assert_eq!(refusal(&pose), "triangle 5 of the pose has other vertices than that of the input");
    pose.triangles.pop();
    assert!(refusal(&pose).contains("the pose has 3455 triangles, and the input has 3456"));
    pose.vertices.pop();
    assert!(refusal(&pose).contains("vertices, and the input has 1728"));
    let huge = moved(&input, |p| p * f64::INFINITY);
    assert!(refusal(&huge).contains("not finite or too large"));
    let elsewhere = moved(&input, |p| p + DVec3::X * 9.0);
    let refused = Follower::new(input, &elsewhere, &ProgressToken::default()).unwrap_err();
    assert!(refused.to_string().contains("give the mesh that the result was made from"), "{refused}");
}
