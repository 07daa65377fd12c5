//! Distances between meshes and points.

use glam::DVec3;
use rtfmesh::cloud::point_distances;
use rtfmesh::{Error, ProgressToken, TriMesh};
use serde_json::Value;

use crate::support::place::Place;

/// Two faces over the unit square.
fn square() -> TriMesh {
    let vertices = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    TriMesh { vertices: vertices.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

/// Points in the middle of `columns` by `rows` squares with sides of a twentieth, `z` above the square.
fn grid(columns: u32, rows: u32, z: f64) -> Vec<DVec3> {
    let at = |k: u32| (f64::from(k) + 0.5) / 20.0;
    (0..rows).flat_map(|row| (0..columns).map(move |column| DVec3::new(at(column), at(row), z))).collect()
}

#[test]
fn distances_of_points_above_a_square_are_known() {
    let mut points = grid(20, 20, 0.0);
    let flat = point_distances(&square(), &points, &ProgressToken::default()).unwrap();
    let unit = 100.0 / flat.diagonal;
    assert!((flat.diagonal - 0.95 * 2_f64.sqrt()).abs() < 1e-12);
    assert!(flat.from_points.largest < 1e-12, "{flat:?}");
    // The squares around the points have sides of 0.05, and random places in them these distances.
    assert!((flat.spacing - 0.05 * unit).abs() < 0.2 * 0.05 * unit, "{flat:?}");
    assert!((flat.to_points.largest - 0.05 / 2_f64.sqrt() * unit).abs() < 0.01 * unit, "{flat:?}");
    // Mean squares of a random place in such a square and on the diagonal, and of one on the border.
    let (inside, border) = (0.05_f64.powi(2) / 6.0, 0.05_f64.powi(2) / 3.0);
    let on_edges = (4.0 * border + 2_f64.sqrt() * inside) / (4.0 + 2_f64.sqrt());
    let rms = (0.5 * (inside + on_edges)).sqrt();
    assert!((flat.to_points.rms - rms * unit).abs() < 1e-4 * unit, "{flat:?}");
    // One point far away counts like all others.
    points.iter_mut().for_each(|p| p.z = 0.3);
    points.push(DVec3::new(0.5, 0.5, 5.0));
    let found = point_distances(&square(), &points, &ProgressToken::default()).unwrap();
    let unit = 100.0 / found.diagonal;
    assert_eq!(found.points, 401);
    assert!((found.from_points.largest - 5.0 * unit).abs() < 1e-9 * unit, "{found:?}");
    assert!((found.from_points.mean - (400.0 * 0.3 + 5.0) / 401.0 * unit).abs() < 1e-9 * unit, "{found:?}");
    let rms = ((400.0 * 0.09 + 25.0) / 401.0_f64).sqrt();
    assert!((found.from_points.rms - rms * unit).abs() < 1e-9 * unit, "{found:?}");
}

#[test]
fn a_mesh_that_reaches_beyond_the_points_is_far_from_them_only_one_way() {
    let found = point_distances(&square(), &grid(10, 20, 0.0), &ProgressToken::default()).unwrap();
    let unit = 100.0 / found.diagonal;
    assert!(found.from_points.largest < 1e-12, "{found:?}");
    let largest = found.to_points.largest / unit;
    assert!((0.52..=0.526).contains(&largest), "from x = 0.475 to 1: {largest}");
}

#[test]
fn meshes_without_faces_and_points_at_one_place_are_refused() {
    let refused = |mesh: &TriMesh, points: &[DVec3], word: &str| {
        let error = point_distances(mesh, points, &ProgressToken::default()).unwrap_err();
        assert!(matches!(error, Error::Input { .. }) && error.to_string().contains(word), "{error}");
    };
    refused(&TriMesh::default(), &grid(2, 2, 0.0), "no faces");
    refused(&square(), &[], "at one point");
    refused(&square(), &[DVec3::ONE; 3], "at one point");
    refused(&square(), &[DVec3::ONE, DVec3::NAN], "finite");
}

#[test]
fn the_program_measures_against_points() {
    let place = Place::new();
    rtfmesh::io::write(place.path("square.ply"), &square()).unwrap();
    let line = |p: &DVec3| format!("{} {} {}\n", p.x, p.y, p.z);
    let text: String = grid(20, 20, 0.1).iter().map(line).collect();
    std::fs::write(place.path("points.xyz"), text).unwrap();
    let (table, errors) = place.run("measure square.ply --against points.xyz");
    assert_eq!(errors, "");
    let row = "points to mesh: RMS, mean, maximum   7.4432 %, 7.4432 %, 7.4432 %";
    for row in [row, "mesh to nearest points", "spacing of the points", "400, 1.343503"] {
        assert!(table.contains(row), "'{row}' is missing: {table}");
    }
    let json = place.run("measure square.ply --against points.xyz --json").0;
    let json: Value = serde_json::from_str(&json).unwrap();
    let rms = json["points"]["from_points"]["rms"].as_f64().unwrap();
    assert!((rms - 10.0 / 1.343_503).abs() < 1e-4 && json["distances"].is_null(), "{json}");
    for option in ["--energy", "--features", "--accuracy 0.1"] {
        let done =
            place.program(&format!("measure square.ply --against points.xyz {option}")).assert().code(2);
        let errors = String::from_utf8(done.get_output().stderr.clone()).unwrap();
        assert!(errors.contains(&option[..8]) && errors.contains("needs a mesh as reference"), "{errors}");
    }
}
