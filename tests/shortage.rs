//! Runs with hardly enough vertices, or too few.

use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::mesh::io::FeatureLine;
use rtfmesh::mesh::repair::{RepairOptions, at_welded_places, repair};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, Features, Options, Remeshed, Result, Shortage, TriMesh, remesh};

fn run(mesh: &TriMesh, vertices: usize, shortage: Shortage) -> Result<Remeshed> {
    let result = remesh(device(), mesh, &Options { shortage, ..Options::new(vertices) }, &mut |_| {});
    assert_valid(device());
    result
}

fn assert_like(input: &TriMesh, result: &Remeshed, vertices: usize) {
    let (got, want) = (topology(&result.mesh), topology(input));
    assert!(got.is_manifold(), "{got:?}");
    assert_eq!((got.vertices, result.mesh.vertices.len()), (vertices, vertices));
    let kind = [&got, &want].map(|t| (t.components, t.euler, t.boundary_loops));
    assert_eq!(kind[0], kind[1], "{vertices}");
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0), "{vertices}");
    assert_eq!(result.summary.warnings, Vec::<String>::new(), "{vertices}");
}

/// The number after "ask for".
fn advised(error: &Error) -> usize {
    let text = error.to_string();
    let number = text.split("ask for ").nth(1).and_then(|rest| rest.split([' ', ',']).next());
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{text}"))
}

#[test]
fn thin_parts_get_the_sites_that_they_need() {
    // Evenly spread sites leave the rings' tubes too few.
    for (name, n) in [("genus3", 80), ("torus", 30), ("two-components", 60)] {
        let input = sample(name).unwrap();
        assert_like(&input, &run(&input, n, Shortage::Refuse).unwrap(), n);
    }
}

#[test]
fn what_is_too_few_is_refused_with_a_count_that_does() {
    let input = sample("genus3").unwrap();
    let error = run(&input, 20, Shortage::Refuse).unwrap_err();
    assert!(matches!(error, Error::Input { .. }), "{error:?}");
    assert!(error.to_string().contains("20 vertices are too few") && error.to_string().contains("near ("));
    let enough = advised(&error);
    assert!(enough > 20, "{error}");
    let asked = run(&input, enough, Shortage::Refuse).unwrap();
    assert_like(&input, &asked, enough);
    let added = run(&input, 20, Shortage::AddVertices).unwrap();
    assert_eq!(added.mesh, asked.mesh);
    assert!(added.summary.attempts > 1 && asked.summary.attempts == 1);
}

#[test]
fn with_best_effort_it_comes_out_with_warnings() {
    let result = run(&sample("genus3").unwrap(), 20, Shortage::BestEffort).unwrap();
    assert!(!result.mesh.triangles.is_empty());
    let warnings = &result.summary.warnings;
    assert!(warnings.iter().any(|w| w.contains("near (")), "{warnings:?}");
}

#[test]
fn curves_that_leave_nothing_beside_them_are_made_by_collapsing_edges() {
    let input = sample("box").unwrap();
    let result = run(&input, 20, Shortage::Refuse).unwrap();
    assert_like(&input, &result, 20);
    assert_eq!(result.summary.collapsed_components, 1);
    let added = run(&input, 20, Shortage::AddVertices).unwrap();
    assert!(added.mesh.vertices.len() > 20 && added.summary.collapsed_components == 0);
    assert_like(&input, &added, added.mesh.vertices.len());
}

#[test]
fn the_lines_of_a_user_do_not_give_way() {
    let input = sample("box").unwrap();
    let line = FeatureLine { points: vec![DVec3::ZERO, DVec3::X], line: 1 };
    let features = Some(Features { file: None, lines: vec![line] });
    let refused = |vertices| {
        remesh(
            device(),
            &input,
            &Options { features: features.clone(), ..Options::new(vertices) },
            &mut |_| {},
        )
    };
    let error = refused(20).unwrap_err();
    assert!(matches!(error, Error::Usage { .. }), "{error:?}");
    let enough = advised(&error);
    assert_like(&input, &refused(enough).unwrap(), enough);
}

/// A sphere of longitude and latitude, open on every other edge of one meridian by less than anybody sees.
fn cracked() -> TriMesh {
    const AROUND: u32 = 32;
    const ALONG: u32 = 16;
    let mut mesh = TriMesh { vertices: vec![DVec3::NEG_Z, DVec3::Z], triangles: Vec::new() };
    for j in 1..ALONG {
        let (height, radius) = (std::f64::consts::PI * (f64::from(j) / f64::from(ALONG) - 0.5)).sin_cos();
        for i in 0..=AROUND {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i % AROUND) / f64::from(AROUND)).sin_cos();
            let crack = if i == AROUND && j % 2 == 0 { -1e-15 } else { 0.0 };
            mesh.vertices.push(DVec3::new(radius * cos, radius * sin + crack, height));
        }
    }
    let at = |i: u32, j: u32| 2 + (j - 1) * (AROUND + 1) + i;
    for i in 0..AROUND {
        mesh.triangles.push([0, at(i + 1, 1), at(i, 1)]);
        mesh.triangles.push([1, at(i, ALONG - 1), at(i + 1, ALONG - 1)]);
        for j in 1..ALONG - 1 {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

#[test]
fn cracks_are_never_written_as_what_they_are_not() {
    let input = cracked();
    let repaired = repair(&input).unwrap().mesh;
    assert!(topology(&repaired).nonmanifold_vertices > 0);
    match run(&input, 600, Shortage::Refuse) {
        Ok(result) => {
            let (got, want) = (topology(&result.mesh), topology(&repaired));
            assert_eq!(
                (result.mesh.vertices.len(), got.euler, got.boundary_loops),
                (600, want.euler, want.boundary_loops)
            );
        }
        Err(Error::Input { remedy, .. }) => assert!(remedy.contains("--weld"), "{remedy}"),
        Err(error) => panic!("{error:?}"),
    }
    assert!(run(&input, 600, Shortage::BestEffort).is_ok());
    let welded = Options { weld: 1e-9, ..Options::new(600) };
    let result = remesh(device(), &input, &welded, &mut |_| {}).unwrap();
    let closed = at_welded_places(&input, &RepairOptions { weld: 1e-9, min_component: 0.0 }).unwrap();
    assert_like(&repair(&closed).unwrap().mesh, &result, 600);
}
