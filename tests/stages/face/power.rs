//! `face/power` against the intersection of half-planes in f64.

use crate::reference::face::face;
use crate::reference::knn::nearest;
use crate::reference::power::power_face;
use crate::support::polygons::{assert_same_polygon, frame};
use crate::support::{assert_valid, cloud, device, on_sphere, rounded, slots, spacing_on_sphere, upload};
use glam::{DVec2, DVec3, Vec2};
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::face::cell::{BOX_HALF, CellFaces};
use rtfmesh::stages::face::power::PowerOptions;
use rtfmesh::stages::flags::FlagCounts;
use rtfmesh::stages::neighbours::knn::TileBounds;

const HIDDEN: u32 = 512;

/// Faces on the device, each equal to the reference's.
fn assert_faces(sites: &[DVec3], normals: &[DVec3], options: &PowerOptions) -> FlagCounts {
    let device = device();
    let (sites, normals) = (rounded(sites), rounded(normals));
    let (n, k) = (sites.len(), options.k as usize);
    let neighbours = slots(&nearest(&sites, &sites, k, true), k);
    let (on_device, along) = (upload("test.sites", &sites), upload("test.normals", &normals));
    let neighbours = Buffer::from_slice(device, "test.neighbours", &neighbours).unwrap();
    let flags = Buffer::from_slice(device, "test.flags", &vec![0_u32; n]).unwrap();
    let bounds = TileBounds::new(device, "test.bounds", n).unwrap();
    let faces = CellFaces::power(device, n, options).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    bounds.record(&mut recorder, &on_device).unwrap();
    faces.record(&mut recorder, &on_device, &along, &neighbours, &bounds, &flags).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let counts = faces.corner_count.to_vec(device).unwrap();
    let corners: Vec<Vec2> = faces.corners.to_vec(device).unwrap();
    let (fan, flags) = (faces.fan.to_vec(device).unwrap(), flags.to_vec(device).unwrap());
    for i in 0..n {
        assert_eq!(flags[i] & 0b1111, 0, "site {i} has no face");
        let (u, v) = frame(normals[i]);
        let half = BOX_HALF * options.spacing;
        let want = power_face((&sites, &normals), i, (u, v), options.offset * options.spacing, half);
        // Rounding goes with the spacing, and what is compared with the face's size.
        if want.corners.is_empty() || want.radius() < 0.25 * options.spacing {
            assert!(flags[i] & HIDDEN != 0 || counts[i] > 0, "site {i}: a hidden face has a flag");
            continue;
        }
        assert_eq!(flags[i] & HIDDEN, 0, "site {i}");
        let slots: Vec<usize> = (0..counts[i] as usize).map(|s| s * n + i).collect();
        let got: Vec<DVec2> = slots.iter().map(|s| corners[*s].as_dvec2()).collect();
        let behind: Vec<u32> = slots.iter().map(|s| fan[*s]).collect();
        assert_same_polygon(i, &got, &behind, &want);
        let unbounded = want.behind.iter().any(Option::is_none);
        assert_eq!(flags[i] & 64 != 0, unbounded, "site {i}: unbounded flag");
    }
    FlagCounts::of(&flags[..n])
}

/// Normals that lean by up to some 20 degrees, every one in its own way.
fn leaning(normals: &[DVec3], seed: u64) -> Vec<DVec3> {
    let lean = cloud(normals.len(), 0.4, seed);
    normals.iter().zip(lean).map(|(n, l)| (*n + l).normalize()).collect()
}

#[test]
fn power_faces_of_bulges_and_hollows() {
    let (sites, normals) = on_sphere(500, 1);
    let hollow: Vec<DVec3> = normals.iter().map(|n| -*n).collect();
    for offset in [0.0, 0.5, 1.0, 2.0] {
        let options = PowerOptions::new(32, spacing_on_sphere(500), offset);
        for normals in [&normals, &hollow, &leaning(&normals, 2)] {
            let flags = assert_faces(&sites, normals, &options);
            assert_eq!(flags.unbounded, 0, "{offset}: {flags:?}");
        }
    }
}

#[test]
fn without_an_offset_they_are_tangent_faces() {
    let (sites, normals) = on_sphere(200, 3);
    for i in 0..200 {
        let (u, v) = frame(normals[i]);
        let tangent = face(&sites, i, u, v, 1.0);
        let power = power_face((&sites, &normals), i, (u, v), 0.0, 1.0);
        assert!((tangent.radius() - power.radius()).abs() < 1e-12, "site {i}");
    }
}

#[test]
fn sites_in_the_shadows_of_others_have_none() {
    let (sites, normals) = on_sphere(300, 4);
    let hollow: Vec<DVec3> = normals.iter().map(|n| -*n).collect();
    // Shadows beyond the ball's centre.
    let flags = assert_faces(&sites, &hollow, &PowerOptions::new(32, spacing_on_sphere(300), 8.0));
    assert!(flags.hidden > 100, "{flags:?}");
}

#[test]
fn power_faces_with_short_lists_and_at_odd_sizes() {
    let (sites, normals) = on_sphere(300, 5);
    let flags =
        assert_faces(&sites, &leaning(&normals, 6), &PowerOptions::new(4, spacing_on_sphere(300), 1.0));
    assert!(flags.security_missed > 100, "{flags:?}");
    for count in [0, 1, 2, 7, 8, 9, 15, 16, 17, 33] {
        for workgroup in [8, 16] {
            let (sites, normals) = on_sphere(count, 7);
            let options = PowerOptions { workgroup, ..PowerOptions::new(32, spacing_on_sphere(count), 1.0) };
            assert_faces(&sites, &normals, &options);
        }
    }
}

#[test]
fn coincident_sites_part_in_power_faces() {
    let (mut sites, mut normals) = on_sphere(60, 8);
    (sites[7], normals[7]) = (sites[3], normals[3]);
    let device = device();
    let neighbours = slots(&nearest(&sites, &sites, 32, true), 32);
    let neighbours = Buffer::from_slice(device, "test.neighbours", &neighbours).unwrap();
    let flags = Buffer::from_slice(device, "test.flags", &[0_u32; 60]).unwrap();
    let bounds = TileBounds::new(device, "test.bounds", 60).unwrap();
    let faces = CellFaces::power(device, 60, &PowerOptions::new(32, spacing_on_sphere(60), 1.0)).unwrap();
    let (sites, normals) = (upload("test.sites", &sites), upload("test.normals", &normals));
    let mut recorder = Recorder::new(device).unwrap();
    bounds.record(&mut recorder, &sites).unwrap();
    faces.record(&mut recorder, &sites, &normals, &neighbours, &bounds, &flags).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    assert_eq!(FlagCounts::of(&flags.to_vec(device).unwrap()).coincident, 2);
    let counts = faces.corner_count.to_vec(device).unwrap();
    assert!(counts[3] >= 3 && counts[7] >= 3);
}
