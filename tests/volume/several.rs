//! Isosurfaces of several values in one mesh.

use predicates::prelude::*;
use rtfmesh::glam::DVec3;
use rtfmesh::io::read;
use rtfmesh::mesh::topology::topology;
use rtfmesh::volume::ISO;

use super::iso::noisy_ball;
use super::{npy, volume_of};
use crate::support::place::Place;

const CENTRE: DVec3 = DVec3::splat(9.3);

#[test]
fn triangles_have_the_value_of_their_isosurface() {
    let place = Place::new();
    let ball = volume_of([20, 20, 20], |p| p.distance(CENTRE) - 6.0);
    std::fs::write(place.path("ball.npy"), npy(&ball)).unwrap();
    let (_, told) = place.run("remesh ball.npy out.ply -n 600 --iso -3,0,1.5");
    for value in ["-3", "0", "1.5"] {
        assert!(told.contains(&format!("the isosurface at {value} has")), "{told}");
    }
    let found = read(place.path("out.ply")).unwrap();
    let mesh = found.mesh;
    assert_eq!((mesh.vertices.len(), topology(&mesh).components), (600, 3));
    let iso = found.attributes.face_named(ISO).unwrap();
    let mut areas = [0.0; 3];
    for t in 0..mesh.triangles.len() {
        let value = iso.at(t)[0];
        for p in mesh.corners(t) {
            let radius = p.distance(CENTRE);
            assert!((radius - 6.0 - value).abs() < 0.15, "{radius} at {value}");
        }
        areas[[-3.0, 0.0, 1.5].iter().position(|own| *own == value).unwrap()] += mesh.triangle_area(t);
        // Outward, all of them.
        let centre = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        let [a, b, c] = mesh.corners(t);
        assert!((b - a).cross(c - a).dot(centre - CENTRE) > 0.0);
    }
    for (area, radius) in areas.iter().zip([3.0_f64, 6.0, 7.5]) {
        let expected = 4.0 * std::f64::consts::PI * radius * radius;
        assert!((area / expected - 1.0).abs() < 0.06, "{area} {expected}");
    }
}

#[test]
fn surfaces_much_closer_than_an_edge_keep_their_values() {
    let place = Place::new();
    let ball = volume_of([24, 24, 24], |p| p.distance(DVec3::splat(11.5)) - 9.0);
    std::fs::write(place.path("ball.npy"), npy(&ball)).unwrap();
    // Edges of three voxels.
    place.run("remesh ball.npy out.ply -n 300 --iso 0,0.2");
    let found = read(place.path("out.ply")).unwrap();
    let iso = found.attributes.face_named(ISO).unwrap();
    let (mut sums, mut counts) = ([0.0_f64; 2], [0.0_f64; 2]);
    for t in 0..found.mesh.triangles.len() {
        let k = usize::from(iso.at(t)[0] > 0.1);
        let corners = found.mesh.corners(t);
        sums[k] += corners.into_iter().map(|p| p.distance(DVec3::splat(11.5))).sum::<f64>() / 3.0;
        counts[k] += 1.0;
    }
    let vertices = |k: usize| counts[k] / 2.0 + 2.0;
    assert!((vertices(0) + vertices(1) - 300.0).abs() < 1e-9, "{counts:?}");
    let gap = sums[1] / counts[1] - sums[0] / counts[0];
    assert!((gap - 0.2).abs() < 0.05, "{gap}");
}

#[test]
fn isosurfaces_that_touch_are_refused() {
    let place = Place::new();
    let half = volume_of([12, 12, 12], |p| p.distance(DVec3::new(0.0, 5.4, 5.6)) - 4.0);
    std::fs::write(place.path("half.npy"), npy(&half)).unwrap();
    // All values of 1 to 20 are next to the nodes outside.
    let steep = volume_of([12, 12, 12], |p| if p.distance(DVec3::splat(5.5)) < 4.0 { 1e4 } else { 0.0 });
    std::fs::write(place.path("steep.npy"), npy(&steep)).unwrap();
    for (arguments, said) in [
        ("half.npy o.ply -n 300 --iso 0,-1,0", "--iso has 0 twice"),
        ("half.npy o.ply -n 300 --iso 0,nan", "--iso NaN is not finite"),
        ("half.npy o.ply -n 300 --iso 0,-1 --closed", "would overlap at the volume's border"),
        ("steep.npy o.ply -n 300 --iso 9000,5,10", "the isosurfaces at 5 and 10 touch"),
    ] {
        let refused = place.program(&format!("remesh {arguments}")).assert().code(2);
        refused.stderr(predicate::str::contains(said));
    }
    let beyond = place.program("remesh half.npy o.ply -n 300 --iso 0,5000").assert().code(3);
    beyond.stderr(predicate::str::contains("no surface at 5000"));
    // With one of them closed there is no overlap, nor where they are open.
    place.run("remesh half.npy o.ply -n 300 --iso 0,-1");
    // The surface at -1, below all values, is that of the whole volume.
    place.run("remesh steep.npy o.ply -n 300 --iso 5,-1 --closed --inside above");
    let inner = volume_of([12, 12, 12], |p| p.distance(DVec3::new(4.5, 5.4, 5.6)) - 3.0);
    std::fs::write(place.path("inner.npy"), npy(&inner)).unwrap();
    place.run("remesh inner.npy o.ply -n 300 --iso -1,2 --closed --inside below");
    assert_eq!(topology(&read(place.path("o.ply")).unwrap().mesh).boundary_loops, 0);
}

#[test]
fn much_noise_at_one_value_is_smoothed_with_a_warning_and_at_several_it_stays() {
    let place = Place::new();
    std::fs::write(place.path("noisy.npy"), npy(&noisy_ball())).unwrap();
    let (_, told) = place.run("remesh noisy.npy out.ply -n 800 --iso 1");
    assert!(told.contains("warning: noise gave the isosurface at 1 too many handles"), "{told}");
    assert_eq!(topology(&read(place.path("out.ply")).unwrap().mesh).genus, Some(0));
    // Both surfaces keep all their handles.
    let refused = place.program("remesh noisy.npy out.ply -n 800 --iso 1,11").assert().code(2);
    let too_few = predicate::str::contains("vertices are too few");
    refused.stderr(too_few.and(predicate::str::contains("smoothed").not()));
}
