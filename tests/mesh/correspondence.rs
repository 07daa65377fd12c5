//! Where the vertices of a result lie on the input: the search alone, and whole runs.

use crate::support::device;
use crate::support::shapes::{moved, union};
use glam::DVec3;
use rtfmesh::mesh::correspondence::find_correspondence;
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Correspondence, CorrespondenceRequest, Options, ProgressToken, SurfacePoint, TriMesh, remesh};

/// Fails unless every point is one of a triangle of `input`, for every vertex and face of `output`.
#[track_caller]
fn check(correspondence: &Correspondence, input: &TriMesh, output: &TriMesh) {
    assert_eq!(
        (correspondence.vertices.len(), correspondence.faces.len()),
        (output.vertices.len(), output.triangles.len())
    );
    for SurfacePoint { triangle, barycentric } in correspondence.vertices.iter().chain(&correspondence.faces)
    {
        assert!((*triangle as usize) < input.triangles.len());
        assert!(barycentric.iter().all(|w| (0.0..=1.0).contains(w)), "{barycentric:?}");
        assert!((barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{barycentric:?}");
    }
}

/// The torus with what repair takes out, all of it before the rest.
fn littered(mesh: &TriMesh) -> TriMesh {
    let mut triangles = vec![[0, 0, 1], mesh.triangles[7], [0, 1, 1]];
    triangles.extend(&mesh.triangles);
    let mut vertices = mesh.vertices.clone();
    // Corners of their own, as files without shared vertices have them.
    for triangle in triangles.iter_mut().skip(3).step_by(5) {
        *triangle = triangle.map(|v| {
            vertices.push(mesh.vertices[v as usize]);
            vertices.len() as u32 - 1
        });
    }
    TriMesh { vertices, triangles }
}

#[test]
fn a_mesh_lies_on_itself_by_the_inputs_own_triangles() {
    let clean = moved(&sample("torus").unwrap(), |v| v * 1e-7 + DVec3::new(3.0, 0.0, 0.0));
    let input = littered(&clean);
    let repaired = repair(&input).unwrap();
    assert_eq!(repaired.origin.len(), clean.triangles.len());
    let correspondence =
        find_correspondence(&input, &repaired, &clean, CorrespondenceRequest::ALL, &ProgressToken::default())
            .unwrap();
    check(&correspondence, &input, &clean);
    for (point, vertex) in correspondence.vertices.iter().zip(&clean.vertices) {
        assert!(point.position(&input).distance(*vertex) < 1e-14);
        assert!(point.barycentric.contains(&1.0), "{point:?} is no corner");
    }
    for (t, point) in correspondence.faces.iter().enumerate() {
        let own = input.corners(point.triangle as usize);
        let mut of_clean = clean.corners(t).map(|p| p.to_array());
        let mut of_input = own.map(|p| p.to_array());
        of_clean.sort_by(|a, b| a.partial_cmp(b).unwrap());
        of_input.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(of_clean, of_input);
        assert!(point.barycentric.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-6), "{point:?}");
    }
}

#[test]
fn sheets_that_are_close_are_told_apart_by_their_sides() {
    // Two sheets a hundredth apart; those of the result went past each other, but face as they did.
    let input = sample("thin-plate").unwrap();
    let [low, high] = input.bounds().unwrap();
    let middle = 0.5 * (low.z + high.z);
    let output = moved(&input, |v| DVec3::new(v.x, v.y, middle - 0.2 * (v.z - middle)));
    let correspondence = find_correspondence(
        &input,
        &repair(&input).unwrap(),
        &output,
        CorrespondenceRequest::ALL,
        &ProgressToken::default(),
    )
    .unwrap();
    let upwards = |mesh: &TriMesh, t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(c - a).normalize().z
    };
    let mut sheets = 0;
    for (t, point) in
        correspondence.faces.iter().enumerate().filter(|(t, _)| upwards(&output, *t).abs() > 0.9)
    {
        assert!(upwards(&output, t) * upwards(&input, point.triangle as usize) > 0.9, "{t}");
        sheets += 1;
    }
    assert!(sheets > 500, "{sheets}");
    let inside = |v: DVec3| (v - low).min(high - v).truncate().min_element() > 0.01;
    for (v, point) in correspondence.vertices.iter().enumerate().filter(|(v, _)| inside(input.vertices[*v])) {
        assert!((point.position(&input).z - input.vertices[v].z).abs() < 1e-12, "{v}");
    }
}

#[test]
fn what_is_not_asked_for_is_not_looked_for() {
    let input = littered(&sample("sphere").unwrap());
    let (repaired, output) = (repair(&input).unwrap(), sample("sphere").unwrap());
    let traced = |vertices, faces| {
        find_correspondence(
            &input,
            &repaired,
            &output,
            CorrespondenceRequest { vertices, faces },
            &ProgressToken::default(),
        )
        .unwrap()
    };
    let whole = traced(true, true);
    let vertices = Correspondence { faces: Vec::new(), ..whole.clone() };
    let faces = Correspondence { vertices: Vec::new(), ..whole };
    assert_eq!(
        [traced(true, false), traced(false, true), traced(false, false)],
        [vertices, faces, Correspondence::default()]
    );
}

#[test]
fn runs_tell_it_only_when_asked() {
    let input = littered(&sample("sphere").unwrap());
    let quick = Options::new(300).first_iterations(10);
    assert_eq!(remesh(device(), &input, &quick).unwrap().correspondence, None);
    for options in [quick, Options::rtf(300).iterations(10)] {
        let result = remesh(device(), &input, &options.correspondence(CorrespondenceRequest::ALL)).unwrap();
        let correspondence = result.correspondence.unwrap();
        check(&correspondence, &input, &result.mesh);
        let far = correspondence.vertices.iter().zip(&result.mesh.vertices);
        let far = far.map(|(point, v)| point.position(&input).distance(*v)).fold(0.0, f64::max);
        assert!(far < 0.02, "{far}");
    }
}

#[test]
fn vertices_on_curves_lie_on_edges_and_fixed_half_edges_become_curves() {
    let cube = sample("box").unwrap();
    let input = littered(&union(&cube, &moved(&cube, |v| v + DVec3::new(3.0, 0.0, 0.0))));
    // The diagonals of the sides of both boxes, found by their length; nothing else is held.
    let sides = (0..input.triangles.len() as u32).flat_map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let ends = |half: u32| {
        let corners = input.corners(half as usize / 3);
        [corners[half as usize % 3], corners[(half as usize + 1) % 3]]
    };
    let is_diagonal = |half: &u32| {
        let [a, b] = ends(*half);
        a.distance(b) > 1.2
    };
    let fixed_half_edges: Vec<u32> = sides.filter(is_diagonal).collect();
    let options = Options::new(500)
        .fixed_half_edges(fixed_half_edges)
        .correspondence(CorrespondenceRequest::ALL)
        .feature_angle(180.0);
    let result = remesh(device(), &input, &options).unwrap();
    let found = result.summary.features.unwrap();
    assert_eq!(found.curves, 12, "{found:?}");
    let correspondence = result.correspondence.unwrap();
    let on_side = |p: &&SurfacePoint| p.barycentric.contains(&0.0);
    let held = correspondence.vertices.iter().filter(on_side).count();
    assert!(held >= found.curve_sites, "{held} of {}", found.curve_sites);
}
