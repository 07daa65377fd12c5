//! Results that are their own mirror images.

use crate::support::device;
use crate::support::shapes::{cube, globe, moved, union};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::options::Symmetry;
use rtfmesh::{Options, TriMesh, WarningCode, preview, remesh};
use std::collections::HashMap;

/// A sphere with bumps that are the same on both sides of x = 0: one half, and its mirror image.
fn face() -> TriMesh {
    let round = globe(48, 32);
    let mut mesh = moved(&round, |p| {
        let bumps = 1.0 + 0.15 * (4.0 * p.y + p.z).sin() * (5.0 * p.x).cos();
        // The meridian of x = 0 is there up to rounding.
        if p.x.abs() < 1e-9 { DVec3::new(0.0, p.y, p.z) * bumps } else { p * bumps }
    });
    mesh.triangles.retain(|t| t.iter().all(|v| mesh.vertices[*v as usize].x >= 0.0));
    let count = mesh.vertices.len() as u32;
    let image = |v: u32| if mesh.vertices[v as usize].x == 0.0 { v } else { v + count };
    let mirrored: Vec<[u32; 3]> = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b].map(image)).collect();
    mesh.triangles.extend(mirrored);
    mesh.vertices.extend_from_within(..);
    mesh.vertices[count as usize..].iter_mut().for_each(|p| p.x = -p.x);
    mesh
}

/// The same with a hole across the plane.
fn open_face() -> TriMesh {
    let mut mesh = face();
    mesh.triangles.retain(|t| t.iter().map(|v| mesh.vertices[*v as usize].z).sum::<f64>() < 2.0);
    mesh
}

/// Fails unless the vertices and triangles are the same once mirrored along an axis; returns the number of
/// vertices on the plane.
#[track_caller]
fn check_mirrored(mesh: &TriMesh, input: &TriMesh, axis: usize) -> usize {
    let [low, high] = input.bounds().unwrap();
    let (middle, within) = (0.5 * (low[axis] + high[axis]), 1e-12 * low.distance(high));
    // Vertices by their rounded places; those nearby are looked at as well.
    let key = |p: DVec3| p.to_array().map(|x| (x * 1e6).round() as i64);
    let by_place: HashMap<[i64; 3], usize> = mesh.vertices.iter().map(|p| key(*p)).zip(0..).collect();
    let image = |v: usize| {
        let mut p = mesh.vertices[v];
        p[axis] = 2.0 * middle - p[axis];
        let [x, y, z] = key(p);
        let near = |d: i64| [[d, 0, 0], [0, d, 0], [0, 0, d]].map(|[a, b, c]| [x + a, y + b, z + c]);
        let found = [0, -1, 1].into_iter().flat_map(near).find_map(|place| by_place.get(&place));
        let other = *found.unwrap_or_else(|| panic!("vertex {v} has no mirror image"));
        assert!(mesh.vertices[other].distance(p) <= within, "{} {p}", mesh.vertices[other]);
        other
    };
    let images: Vec<usize> = (0..mesh.vertices.len()).map(image).collect();
    let sorted = |triangle: [usize; 3]| {
        let first = (0..3).min_by_key(|k| triangle[*k]).unwrap();
        [0, 1, 2].map(|k| triangle[(first + k) % 3])
    };
    let own = mesh.triangles.iter().map(|t| sorted(t.map(|v| v as usize)));
    let mut own: Vec<[usize; 3]> = own.collect();
    let mirrored = mesh.triangles.iter().map(|&[a, b, c]| sorted([a, c, b].map(|v| images[v as usize])));
    let mut mirrored: Vec<[usize; 3]> = mirrored.collect();
    own.sort_unstable();
    mirrored.sort_unstable();
    assert_eq!(own, mirrored);
    (0..images.len()).filter(|v| images[*v] == *v).count()
}

#[test]
fn symmetric_inputs_give_symmetric_results() {
    let flat = sample("box").unwrap();
    let inputs = [(face(), 0, Symmetry::X), (flat, 1, Symmetry::Y), (open_face(), 0, Symmetry::Automatic)];
    for (input, axis, symmetry) in inputs {
        let plain = remesh(device(), &input, &Options::new(700)).unwrap().summary.output;
        let result = remesh(device(), &input, &Options::new(700).symmetric(symmetry)).unwrap();
        let on_plane = check_mirrored(&result.mesh, &input, axis);
        let count = result.mesh.vertices.len();
        assert!(on_plane > 10 && count.abs_diff(700) <= 1, "{on_plane} of {count}");
        let said = result.summary.remarks.iter().any(|remark| remark.contains("since both halves are alike"));
        assert_eq!(said, count != 700, "{:?}", result.summary.remarks);
        let [got, want] = [&result.mesh, &input].map(topology);
        assert_eq!((got.euler, got.boundary_loops), (want.euler, want.boundary_loops));
        assert!(got.is_manifold());
        let quality = result.summary.output.quality;
        assert!(quality.mean_quality > plain.quality.mean_quality - 0.02, "{quality:?} {:?}", plain.quality);
        assert!(
            quality.min_angle > plain.quality.min_angle.min(30.0) - 3.0,
            "{quality:?} {:?}",
            plain.quality
        );
        assert!(!result.summary.warning_codes.contains(&WarningCode::Fault));
    }
}

#[test]
fn what_is_said_counts_the_whole() {
    let flat = sample("box").unwrap();
    let result = remesh(device(), &flat, &Options::new(700).symmetric(Symmetry::Y)).unwrap();
    let features = result.summary.features.unwrap();
    assert_eq!((features.curves, features.corners, features.patches), (12, 8, 6));
    // All twelve edges, and none of the plane's.
    let outer = |p: &&DVec3| p.to_array().iter().filter(|x| x.min(1.0 - **x).abs() < 1e-9).count() > 1;
    assert_eq!(features.curve_sites, result.mesh.vertices.iter().filter(outer).count());
    assert_eq!(result.summary.warnings, Vec::<String>::new());
}

#[test]
fn halves_that_cross_each_other_are_told() {
    // Two flat bodies almost in touch: the vertices of coarse ones lie outside of them.
    let right = moved(&globe(48, 32), |p| DVec3::new(p.x + 1.001, 3.0 * p.y, 3.0 * p.z));
    let mut left = moved(&right, |p| p * DVec3::new(-1.0, 1.0, 1.0));
    left.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let both = union(&left, &right);
    let mut crossing = 0;
    for count in [60, 100, 150, 200, 300] {
        let summary = remesh(device(), &both, &Options::new(count).symmetric(Symmetry::X)).unwrap().summary;
        let faces = summary.output.self_intersecting_faces.unwrap();
        let is_told = summary.warning_codes.contains(&WarningCode::Intersections);
        assert_eq!((faces > 0, summary.input_self_intersecting_faces.unwrap_or(0)), (is_told, 0), "{count}");
        crossing += usize::from(is_told);
    }
    assert!(crossing > 0);
}

#[test]
fn inputs_that_are_not_symmetric_are_refused_with_how_far_off_they_are() {
    let lopsided = moved(&face(), |p| p + DVec3::X * 0.1 * (p.y + p.x).max(0.0));
    let options = Options::new(300).symmetric(Symmetry::X);
    let refused = [
        remesh(device(), &lopsided, &options).map(drop).unwrap_err(),
        preview(&lopsided, &options).map(drop).unwrap_err(),
    ];
    for text in refused.map(|refused| refused.to_string()) {
        assert!(text.contains("not symmetric along x") && text.contains("% of the diagonal away"), "{text}");
    }
}

#[test]
fn what_lies_in_the_plane_or_touches_it_is_refused() {
    // Two boxes that are almost in touch, and one with a wall inside.
    let gap = 1e-7;
    let right = moved(&cube(), |p| p + DVec3::X * gap);
    let left = moved(&cube(), |p| p - DVec3::X * (1.0 + gap));
    let mut walled = union(&moved(&cube(), |p| p - DVec3::X * 0.5), &TriMesh::default());
    let count = walled.vertices.len() as u32;
    let wall = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[y, z]| DVec3::new(0.0, y, z));
    walled.vertices.extend(wall);
    walled.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v: u32| v + count)));
    for mesh in [union(&left, &right), walled] {
        let refused = remesh(device(), &mesh, &Options::new(300).symmetric(Symmetry::X)).unwrap_err();
        assert!(refused.to_string().contains("in the plane of symmetry or touches it"), "{refused}");
    }
}

#[test]
fn what_is_known_of_the_whole_input_alone_is_refused() {
    let options = Options::new(300).symmetric(Symmetry::X).keep_boundary(true);
    assert!(options.validate().unwrap_err().to_string().contains("`keep_boundary`"));
    assert!(Options::rtf(300).symmetric(Symmetry::X).validate().is_err());
}
