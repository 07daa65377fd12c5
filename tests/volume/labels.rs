//! Borders between labels.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use predicates::prelude::*;
use rand::RngExt;
use rtfmesh::Flow;
use rtfmesh::glam::{DAffine3, DVec3, Vec3Swizzles};
use rtfmesh::io::{Volume, read};
use rtfmesh::mesh::topology::topology;
use rtfmesh::volume::{
    LABEL_BEFORE, LABEL_BEHIND, LabelOptions, LabelSurface, label_surface, label_surface_with_progress,
};

use super::{npy, volume_of};
use crate::support::place::Place;
use crate::support::rng;

fn borders(volume: &Volume, closed: bool) -> LabelSurface {
    label_surface(volume, &LabelOptions::default().closed(closed)).unwrap()
}

/// The labels behind each face and in front of it.
fn sides(found: &LabelSurface) -> Vec<[u32; 2]> {
    let of = |name: &str| found.attributes.face_named(name).unwrap().values.clone();
    let both = of(LABEL_BEHIND).into_iter().zip(of(LABEL_BEFORE));
    both.map(|(behind, before)| [behind as u32, before as u32]).collect()
}

/// The volume that a label's border encloses. It must be closed.
pub fn enclosed(found: &LabelSurface, label: u32) -> f64 {
    let mut open: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    let mut sum = 0.0;
    for (t, [behind, before]) in sides(found).into_iter().enumerate() {
        let sign = i32::from(behind == label) - i32::from(before == label);
        let corners = found.mesh.triangles[t];
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            *open.entry((a.min(b), a.max(b))).or_default() += if a < b { sign } else { -sign };
        }
        let [a, b, c] = found.mesh.corners(t);
        sum += f64::from(sign) * a.dot(b.cross(c)) / 6.0;
    }
    assert!(open.values().all(|count| *count == 0), "the border of {label} is open");
    sum
}

fn ball(radius: f64) -> (DVec3, Volume) {
    let centre = DVec3::new(0.21, -0.34, 0.11) + radius + 4.0;
    let size = (2.0 * radius) as usize + 9;
    (centre, volume_of([size; 3], |p| if p.distance(centre) < radius { 7.0 } else { 0.0 }))
}

#[test]
fn a_ball_comes_back_round() {
    for radius in [8.0, 13.0] {
        let (centre, volume) = ball(radius);
        let found = borders(&volume, false);
        assert_eq!((found.labels, found.rim.len()), (1, 0));
        assert!(sides(&found).iter().all(|sides| *sides == [7, 0]));
        let off = found.mesh.vertices.iter().map(|v| v.distance(centre) - radius);
        let square = off.map(|d| d * d).sum::<f64>() / found.mesh.vertices.len() as f64;
        // Stairs would be off by 0.29.
        assert!(square.sqrt() < 0.05, "{radius}: {}", square.sqrt());
        // A shell of 0.05 has 1.9 % of the smaller ball's volume.
        let exact = 4.0 / 3.0 * PI * radius.powi(3);
        assert!((enclosed(&found, 7) / exact - 1.0).abs() < 0.02);
    }
}

#[test]
fn every_node_stays_on_its_side() {
    let (centre, volume) = ball(6.0);
    let found = borders(&volume, false);
    let [nx, ny, _] = volume.size;
    for (i, value) in volume.values.iter().enumerate() {
        let node = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
        if (node.distance(centre) - 6.0).abs() > 1.5 {
            continue;
        }
        // The solid angle of the surface, which is all around nodes inside.
        let angle = |t: usize| {
            let [a, b, c] = found.mesh.corners(t).map(|corner| (corner - node).normalize());
            2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
        };
        let around: f64 = (0..found.mesh.triangles.len()).map(angle).sum();
        assert_eq!(around > 2.0 * PI, *value > 0.0, "{node} in {around}");
    }
}

/// Two balls with a wall between them at x = 15.2.
fn pair() -> Volume {
    let (a, b) = (DVec3::new(10.5, 12.0, 12.2), DVec3::new(19.9, 12.0, 12.2));
    volume_of([31, 25, 25], |p| match (p.distance(a), p.distance(b)) {
        (a, b) if a.min(b) >= 8.0 => 0.0,
        (a, b) => f64::from(u8::from(a < b)) + 1.0,
    })
}

#[test]
fn labels_meet_in_a_smooth_curve() {
    let found = borders(&pair(), false);
    assert_eq!(found.labels, 2);
    let mut faces: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for (t, corners) in found.mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            faces.entry((a.min(b), a.max(b))).or_default().push(t);
        }
    }
    assert!(faces.values().all(|on| matches!(on.len(), 2 | 3)));
    let curve: Vec<(u32, u32)> =
        faces.iter().filter(|(_, on)| on.len() == 3).map(|(edge, _)| *edge).collect();
    let place = |v: u32| found.mesh.vertices[v as usize];
    let length: f64 = curve.iter().map(|(a, b)| place(*a).distance(place(*b))).sum();
    let radius = (64.0_f64 - 4.7 * 4.7).sqrt();
    assert!((length / (2.0 * PI * radius) - 1.0).abs() < 0.03, "{length}");
    for (a, _) in &curve {
        let p = place(*a) - DVec3::new(15.2, 12.0, 12.2);
        // The nodes say no more than that the wall is between x = 15 and 16.
        assert!(p.x.abs() < 0.5 && (p.yz().length() - radius).abs() < 0.5, "{p}");
        assert_eq!(curve.iter().filter(|(b, c)| b == a || c == a).count(), 2);
    }
    // A ball without the cap behind the wall.
    let cap = PI * (8.0 - 4.7_f64).powi(2) * (3.0 * 8.0 - (8.0 - 4.7)) / 3.0;
    let exact = 4.0 / 3.0 * PI * 512.0 - cap;
    let both = enclosed(&found, 1) + enclosed(&found, 2);
    assert!((both / (2.0 * exact) - 1.0).abs() < 0.03, "{both}");
}

#[test]
fn random_labels_have_closed_borders() {
    let mut random = rng(5);
    for labels in [2, 3, 9] {
        let mut volume = volume_of([7, 6, 5], |_| 0.0);
        volume.values.iter_mut().for_each(|value| *value = random.random_range(0..labels) as f32);
        let found = borders(&volume, true);
        assert!(found.mesh.vertices.iter().all(|vertex| vertex.is_finite()));
        assert!(sides(&found).iter().all(|[behind, before]| behind > before));
        let total: f64 = (1..labels).map(|label| enclosed(&found, label)).sum();
        assert!(total > 0.0 && total < 6.0 * 5.0 * 4.0, "{total}");
    }
}

#[test]
fn closed_labels_end_flat_at_the_border() {
    for mirror in [1.0, -1.0] {
        let mut volume = volume_of([9, 8, 7], |p| if p.x < 4.5 { 1.0 } else { 2.0 });
        volume.frame = DAffine3::from_scale(DVec3::new(mirror, 1.0, 2.0));
        let found = borders(&volume, true);
        let [low, high] = found.mesh.bounds().unwrap();
        assert_eq!(high - low, DVec3::new(8.0, 7.0, 12.0));
        let whole = 8.0 * 7.0 * 12.0;
        let parts = [1, 2].map(|label| enclosed(&found, label));
        assert!((parts[0] + parts[1] - whole).abs() < 1e-9);
        assert!((parts[0] - whole * 4.5 / 8.0).abs() < 0.01 * whole, "{parts:?}");
        // The twelve edges of the box are in the rim.
        let corners = found.mesh.triangles.as_flattened();
        let length = |half: &u32| {
            let next = if half % 3 == 2 { half - 2 } else { half + 1 };
            let [a, b] = [*half, next].map(|c| found.mesh.vertices[corners[c as usize] as usize]);
            a.distance(b)
        };
        let rim: f64 = found.rim.iter().map(length).sum();
        assert!(rim > 4.0 * (8.0 + 7.0 + 12.0) - 1e-9, "{rim}");
        assert!(sides(&borders(&volume, false)).iter().all(|sides| *sides == [2, 1]));
    }
}

#[test]
fn what_has_no_labels_is_refused() {
    let refused = |value: f64| {
        let volume = volume_of([3, 3, 3], |p| if p.x < 1.0 { value } else { 0.0 });
        label_surface(&volume, &LabelOptions::default()).unwrap_err().to_string()
    };
    for (value, said) in [
        (0.5, "0.5 is not a valid label"),
        (-1.0, "-1"),
        (f64::NAN, "NaN"),
        (2e7, "20000000"),
        (0.0, "are 0"),
    ] {
        let error = refused(value);
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn the_program_keeps_labels_and_junctions() {
    let place = Place::new();
    std::fs::write(place.path("pair.npy"), npy(&pair())).unwrap();
    let (_, told) = place.run("remesh pair.npy out.ply -n 600 --labels");
    assert!(told.contains("with 2 labels") && told.contains("junctions are kept"), "{told}");
    let loaded = read(place.path("out.ply")).unwrap();
    assert_eq!(loaded.mesh.vertices.len(), 600);
    let found = |name: &str| loaded.attributes.face_named(name).unwrap().values.clone();
    let pairs: Vec<(f64, f64)> = found(LABEL_BEHIND).into_iter().zip(found(LABEL_BEFORE)).collect();
    for expected in [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0)] {
        assert!(pairs.contains(&expected));
    }
    for (t, pair) in pairs.iter().enumerate() {
        let [a, b, c] = loaded.mesh.corners(t);
        let normal = (b - a).cross(c - a);
        let middle = (a + b + c) / 3.0;
        let out = match pair {
            // Label 2 is at the lower x.
            (2.0, 1.0) => DVec3::X,
            (2.0, 0.0) => middle - DVec3::new(10.5, 12.0, 12.2),
            (1.0, 0.0) => middle - DVec3::new(19.9, 12.0, 12.2),
            other => panic!("{other:?}"),
        };
        assert!(normal.dot(out) > 0.0, "{middle} {pair:?}");
    }
    let (shown, _) = place.run("inspect pair.npy");
    assert!(shown.lines().any(|l| l.trim().starts_with("different labels") && l.ends_with(" 3")), "{shown}");
    let both = place.program("remesh pair.npy out.ply -n 600 --labels --iso 1").assert().code(2);
    both.stderr(predicate::str::contains("--iso"));
}

/// Towards its rim a lens is thinner than edges are long, and its rim bends more than edges can show.
#[test]
fn a_lens_between_two_balls_is_made_of_good_triangles() {
    let place = Place::new();
    let lens = volume_of([40; 3], |p| {
        let [one, two] = [14.5, 24.5].map(|x| p.distance(DVec3::new(x, 19.5, 19.5)) < 12.0);
        f64::from(u8::from(one)) + 2.0 * f64::from(u8::from(two))
    });
    std::fs::write(place.path("lens.npy"), npy(&lens)).unwrap();
    for (vertices, least) in [(150, 0.78), (300, 0.86), (600, 0.9)] {
        let (_, told) =
            place.run(&format!("remesh lens.npy out.ply -n {vertices} --labels --report out.json"));
        assert!(told.contains("with 3 labels") && !told.contains("local operations"), "{vertices}: {told}");
        let report = place.json("out.json");
        let quality = report["output"]["quality"]["mean_quality"].as_f64().unwrap();
        assert!(quality > least, "{vertices}: {quality}");
    }
}

/// Two halves of a cube, labels 1 and 2 in 0, in which every 37th node has another label.
fn speckled() -> (Volume, Volume) {
    let clean = volume_of([20; 3], |p| {
        let is_in = p.min_element() >= 3.0 && p.max_element() <= 16.0;
        if !is_in {
            0.0
        } else if p.x < 10.0 {
            1.0
        } else {
            2.0
        }
    });
    let mut noisy = clean.clone();
    let is_deep = |i: usize| [i % 20, i / 20 % 20, i / 400].iter().all(|c| (5..15).contains(c));
    for i in (0..noisy.values.len()).step_by(37).filter(|i| is_deep(*i) && !(8..12).contains(&(i % 20))) {
        noisy.values[i] = (noisy.values[i] + 1.0) % 3.0;
    }
    (clean, noisy)
}

#[test]
fn speckles_become_the_label_around_them_and_are_counted() {
    let (clean, noisy) = speckled();
    let changed = clean.values.iter().zip(&noisy.values).filter(|(a, b)| a != b).count();
    assert!(changed > 10);
    let found = borders(&noisy, false);
    assert_eq!((found.specks, found.labels), (changed, 2));
    assert_eq!(found.mesh, borders(&clean, false).mesh);
    let all = label_surface(&noisy, &LabelOptions::default().keep_specks(true)).unwrap();
    assert_eq!(all.specks, 0);
    assert!(all.mesh != found.mesh);
}

#[test]
fn the_program_counts_specks_and_names_the_option_that_keeps_them() {
    let place = Place::new();
    let (_, noisy) = speckled();
    std::fs::write(place.path("labels.npy"), npy(&noisy)).unwrap();
    let (_, told) = place.run("remesh labels.npy out.ply -n 600 --labels");
    assert!(told.contains("left out as noise (--keep-specks keeps them)"), "{told}");
}

#[test]
fn a_label_of_noise_alone_becomes_what_is_around_it() {
    let (clean, mut noisy) = speckled();
    let deep =
        [[6, 6, 6], [6, 9, 6], [6, 12, 6], [14, 6, 6], [14, 9, 6], [14, 12, 6], [6, 6, 10], [14, 6, 10]];
    noisy.values.clone_from(&clean.values);
    let put = |volume: &mut Volume, node: [usize; 3]| {
        let index = volume.index(node);
        volume.values[index] = 9.0;
    };
    deep.into_iter().for_each(|node| put(&mut noisy, node));
    // So few may be small parts that are meant.
    assert_eq!(borders(&noisy, false).specks, 0);
    put(&mut noisy, [6, 12, 10]);
    let found = borders(&noisy, false);
    assert_eq!((found.specks, found.labels), (9, 2));
    assert_eq!(found.mesh, borders(&clean, false).mesh);
}

#[test]
fn borders_that_must_finish_early_use_fewer_nodes() {
    let ball = |p: DVec3| f64::from(u8::from(p.distance(DVec3::splat(49.5)) < 35.0));
    let volume = volume_of([100; 3], ball);
    let found = label_surface_with_progress(&volume, &LabelOptions::default(), |_| Flow::Finish).unwrap();
    assert_eq!((found.step, found.labels), (1, 1), "so few values are done at once");
    let ball = |p: DVec3| f64::from(u8::from(p.distance(DVec3::splat(64.5)) < 50.0));
    let volume = volume_of([130; 3], ball);
    let found = label_surface_with_progress(&volume, &LabelOptions::default(), |_| Flow::Finish).unwrap();
    assert_eq!((found.step, found.labels), (2, 1));
    assert!(topology(&found.mesh).is_closed_manifold());
}
