//! Whole runs with points and boundaries that stay exactly, and with a number of triangles.

use crate::support::{assert_valid, device, faults};
use glam::DVec3;
use rtfmesh::io::Format;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, Length, Options, Refinement, Region, Remeshed, TriMesh, WarningCode, preview, remesh};
use std::collections::HashSet;

fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    let (got, want) = (topology(&result.mesh), topology(mesh));
    assert_eq!(
        (got.components, got.euler, got.boundary_loops),
        (want.components, want.euler, want.boundary_loops)
    );
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    result
}

fn bits(p: DVec3) -> [u64; 3] {
    p.to_array().map(f64::to_bits)
}

/// Points of triangles of a mesh that are far from each other in it.
fn points_on(mesh: &TriMesh, count: usize) -> Vec<DVec3> {
    let point = |k: usize| {
        let [a, b, c] = mesh.corners(k * mesh.triangles.len() / count);
        let [u, v] = [0.618, 0.755].map(|r| (r * k as f64).fract());
        let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
        a + u * (b - a) + v * (c - a)
    };
    (0..count).map(point).collect()
}

#[test]
fn points_become_vertices_bit_by_bit() {
    for (name, count, angle) in [("bumpy-sphere", 40, 30.0), ("box", 12, 25.0)] {
        let mesh = sample(name).unwrap();
        let mut points = points_on(&mesh, count);
        // At a vertex, and in the middle of an edge.
        points.extend([mesh.vertices[3], mesh.corners(5)[0].midpoint(mesh.corners(5)[1])]);
        let result = run(&mesh, &Options::new(3000).points(points.clone()));
        assert_eq!(faults(&result.summary), Vec::<String>::new());
        assert_eq!(result.mesh.vertices.len(), 3000);
        let there: HashSet<_> = result.mesh.vertices.iter().map(|p| bits(*p)).collect();
        for (k, point) in points.iter().enumerate() {
            assert!(there.contains(&bits(*point)), "{name}: point {k}");
        }
        let quality = &result.summary.output.quality;
        assert!(quality.mean_quality > 0.93 && quality.min_angle > angle, "{name}: {quality:?}");
        assert_eq!(result.summary.input.vertices, topology(&mesh).vertices);
        // In the format of a file, too.
        let rounded = run(&mesh, &Options::new(3000).points(points.clone()).format(Format::Stl));
        let there: HashSet<_> = rounded.mesh.vertices.iter().map(|p| bits(*p)).collect();
        assert!(points.iter().all(|p| there.contains(&bits(p.as_vec3().as_dvec3()))), "{name}");
    }
}

#[test]
fn points_off_the_surface_are_told() {
    let mesh = sample("sphere").unwrap();
    let up = mesh.vertices[0].normalize();
    let points = vec![mesh.vertices[0] + 0.02 * up, 9.0 * up];
    let result = run(&mesh, &Options::new(500).points(points));
    let codes = &result.summary.warning_codes;
    assert_eq!(codes.iter().filter(|code| **code == WarningCode::Points).count(), 2, "{codes:?}");
    let text = result.summary.warnings.join("; ");
    assert!(text.contains("1 point is off the surface, by up to 0.02"), "{text}");
    assert!(text.contains("too far to become vertices"), "{text}");
    let nearest = result.mesh.vertices.iter().map(|p| p.distance(mesh.vertices[0])).fold(9.0, f64::min);
    assert!(nearest < 1e-9, "{nearest}");
}

/// The boundary edges of a mesh, by the bits of their ends.
fn boundary(mesh: &TriMesh) -> HashSet<[[u64; 3]; 2]> {
    let mut once = HashSet::new();
    for [a, b] in mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]) {
        let ends = [a, b].map(|v| bits(mesh.vertices[v as usize]));
        let turned = [ends[1], ends[0]];
        if !once.remove(&turned) {
            once.insert(ends);
        }
    }
    once.into_iter().map(|[a, b]| if a < b { [a, b] } else { [b, a] }).collect()
}

/// A terrain over the unit square, moved by `x`.
fn tile(x: f64) -> TriMesh {
    let n = 24;
    let at = |i: u32, j: u32| {
        let [x, y] = [x + f64::from(i) / f64::from(n), f64::from(j) / f64::from(n)];
        DVec3::new(x, y, 0.05 * (7.0 * x).sin() * (5.0 * y).cos())
    };
    let vertices = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let cell = |i: u32, j: u32| {
        let [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[i, j]| j * (n + 1) + i);
        [[a, b, c], [a, c, d]]
    };
    let triangles = (0..n).flat_map(|j| (0..n).flat_map(move |i| cell(i, j))).collect();
    TriMesh { vertices, triangles }
}

#[test]
fn tiles_that_are_remeshed_apart_still_match() {
    let tiles = [0.0, 1.0].map(tile);
    let results = tiles.each_ref().map(|tile| run(tile, &Options::new(700).keep_boundary(true)));
    for (tile, result) in tiles.iter().zip(&results) {
        assert_eq!(result.mesh.vertices.len(), 700);
        assert_eq!(boundary(tile), boundary(&result.mesh));
        let quality = &result.summary.output.quality;
        assert!(quality.mean_quality > 0.93 && quality.min_angle > 25.0, "{quality:?}");
    }
    let shared = results.each_ref().map(|result| {
        let on = result.mesh.vertices.iter().filter(|p| (p.x - 1.0).abs() < 1e-12).map(|p| bits(*p));
        on.collect::<HashSet<_>>()
    });
    assert!(shared[0].len() == 25 && shared[0] == shared[1]);
}

#[test]
fn boundaries_stay_next_to_points_and_finer_parts() {
    let tile = tile(0.0);
    let points = points_on(&tile, 20);
    let region = Region::Sphere { centre: DVec3::new(0.5, 0.1, 0.0), radius: 0.2 };
    let finer = Refinement { region, length: Length::Units(0.018) };
    let options = Options::new(1500).keep_boundary(true).points(points.clone()).refine(vec![finer]);
    let result = run(&tile, &options);
    assert_eq!(boundary(&tile), boundary(&result.mesh));
    let there: HashSet<_> = result.mesh.vertices.iter().map(|p| bits(*p)).collect();
    assert!(points.iter().all(|point| there.contains(&bits(*point))));
    assert!(result.summary.output.quality.mean_quality > 0.9, "{:?}", result.summary.output.quality);
    let beside = vec![DVec3::new(0.5 + 1e-9, 0.0, tile.vertices[12].z)];
    let refused = preview(&tile, &options.points(beside)).unwrap_err().to_string();
    assert!(refused.contains("too close to the vertex"), "{refused}");
}

#[test]
fn what_cannot_be_kept_is_refused_before_the_run() {
    let mesh = tile(0.0);
    let refused = preview(&mesh, &Options::new(120).keep_boundary(true));
    let Err(Error::Usage { problem, remedy, .. }) = refused else { panic!("{refused:?}") };
    assert!(
        problem.contains("the boundary has 96 vertices") && remedy == "ask for at least 160",
        "{problem}"
    );
    let sphere = sample("sphere").unwrap();
    let refused = preview(&sphere, &Options::new(50).points(points_on(&sphere, 40)));
    assert!(refused.unwrap_err().to_string().contains("40 vertices"));
    // Edges much longer than those next to them.
    let square = TriMesh {
        vertices: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| DVec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let refused = preview(&square, &Options::new(200).keep_boundary(true)).unwrap_err().to_string();
    assert!(refused.contains("13 times as long") && refused.contains("about 28 vertices"), "{refused}");
    let finer = Refinement {
        region: Region::Box { low: DVec3::ZERO, high: DVec3::ONE },
        length: Length::Units(0.08),
    };
    let refused = preview(&square, &Options::new(200).refine(vec![finer]).keep_boundary(true));
    assert!(refused.unwrap_err().to_string().contains("times as long"));
    let points = Options::new(500).points(vec![DVec3::NAN]);
    for (bad, field) in [
        (points, "points"),
        (Options::new(500).keep_boundary(true).local(true), "keep_boundary"),
        (Options::new(500).keep_boundary(true).smooth_boundary(0.1), "keep_boundary"),
        (Options::new(500).keep_boundary(true).outer(true), "keep_boundary"),
        (Options::new(500).keep(vec![0]).smooth_spikes(true), "keep"),
    ] {
        let refused = bad.validate();
        assert!(matches!(&refused, Err(Error::Usage { field: Some(of), .. }) if *of == field), "{refused:?}");
    }
    // No spike is on a boundary.
    assert_eq!(Options::new(500).keep_boundary(true).smooth_spikes(true).validate(), Ok(()));
}

#[test]
fn there_are_as_many_triangles_as_asked_for() {
    let torus = sample("torus").unwrap();
    for (faces, got) in [(1200, 1200), (1201, 1200)] {
        let result = run(&torus, &Options::new(0).faces(faces));
        assert_eq!(result.mesh.triangles.len(), got);
        let told = result.summary.remarks.iter().any(|text| text.contains("even number of triangles"));
        assert_eq!(told, faces != got, "{:?}", result.summary.remarks);
        assert!(!preview(&torus, &Options::new(0).faces(faces)).unwrap().vertices_may_change);
    }
    let open = sample("open-hemisphere").unwrap();
    for faces in [1500, 1501] {
        let result = run(&open, &Options::new(0).faces(faces));
        let got = result.mesh.triangles.len();
        assert!((faces - 2..=faces).contains(&got), "{got} instead of {faces}");
        assert!(preview(&open, &Options::new(0).faces(faces)).unwrap().vertices_may_change);
    }
    let refused = Options::new(0).faces(3).validate();
    assert!(matches!(refused, Err(Error::Usage { field: Some("faces"), .. })), "{refused:?}");
}
