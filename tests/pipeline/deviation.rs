//! Whole runs with a largest deviation instead of, or besides, a number of vertices.

use crate::support::{assert_valid, device};
use rtfmesh::measure::measure;
use rtfmesh::mesh::distance::distances;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{
    Error, Flow, Length, Options, ProgressToken, Remeshed, Sizing, TriMesh, preview, remesh,
    remesh_with_progress,
};

fn within(percent: f64) -> Options {
    Options::new(0).sizing(Sizing::Deviation(Length::OfDiagonal(0.01 * percent)))
}

/// The result of a run, with the topology of its input and without self-intersections.
pub fn run(mesh: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), mesh, options).unwrap();
    assert_valid(device());
    let [got, want] = [&result.mesh, mesh].map(|mesh| {
        let found = topology(mesh);
        (found.components, found.euler, found.boundary_loops, found.nonmanifold_edges)
    });
    assert_eq!(got, want);
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    result
}

/// The larger Hausdorff distance in percent, measured apart from the run.
fn deviation(mesh: &TriMesh, input: &TriMesh) -> f64 {
    distances(mesh, input, &ProgressToken::default()).unwrap().hausdorff_lower
}

#[test]
fn the_result_is_as_close_as_asked_for_with_few_vertices() {
    for (name, percent) in [("genus3", 0.5), ("open-hemisphere", 0.5), ("box", 0.1)] {
        let input = sample(name).unwrap();
        let result = run(&input, &within(percent));
        let found = result.summary.deviation.unwrap();
        assert!(found.is_reached && found.enough.is_none() && found.reached <= percent, "{name}: {found:?}");
        assert!((found.asked - percent).abs() < 1e-12);
        assert_eq!(result.summary.warnings, Vec::<String>::new(), "{name}");
        let reached = deviation(&result.mesh, &input);
        assert!(reached <= percent && found.reached >= reached, "{name}: {reached}, {found:?}");
        if name == "genus3" {
            // Even edges take a quarter more vertices for that at least, and the result makes use of what is
            // allowed.
            let even = run(&input, &Options::new(5 * result.mesh.vertices.len() / 4));
            assert!(deviation(&even.mesh, &input) > percent);
            assert!(reached > 0.5 * percent, "{reached}");
            let quality = measure(&result.mesh, None).unwrap().quality;
            assert!(quality.min_angle >= 30.0 && quality.mean_quality > 0.85, "{quality:?}");
        }
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let input = sample("genus3").unwrap();
    let first = run(&input, &within(0.6));
    assert!(first.summary.deviation.unwrap().is_reached);
    assert_eq!(run(&input, &within(0.6)).mesh, first.mesh);
}

#[test]
fn a_number_of_vertices_is_kept() {
    let input = sample("genus3").unwrap();
    let few = run(&input, &within(0.1).vertices(900));
    assert_eq!(few.mesh.vertices.len(), 900);
    let found = few.summary.deviation.unwrap();
    assert!(!found.is_reached && found.enough.unwrap() > 1800, "{found:?}");
    let [warning] = few.summary.warnings.as_slice() else { panic!("{:?}", few.summary.warnings) };
    assert!(warning.contains("instead of 0.1000 %") && warning.contains("about"), "{warning}");
    // But they are where they are needed.
    let even = run(&input, &Options::new(900));
    let [adapted, even] = [&few.mesh, &even.mesh].map(|mesh| deviation(mesh, &input));
    assert!(adapted < 0.9 * even, "{adapted} {even}");
    let enough = run(&input, &within(2.0).vertices(900));
    assert_eq!(enough.mesh.vertices.len(), 900);
    assert!(enough.summary.deviation.unwrap().is_reached && enough.summary.warnings.is_empty());
}

#[test]
fn what_cannot_be_is_refused() {
    let input = sample("box").unwrap();
    let message = |options: &Options| match remesh(device(), &input, options) {
        Err(error @ Error::Usage { .. }) => error.to_string(),
        other => panic!("{:?}", other.map(|result| result.summary.warnings)),
    };
    for percent in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(message(&within(percent)).contains("out of range"));
    }
    assert!(message(&Options::new(0)).contains("0 vertices"));
    assert!(message(&within(0.1).vertices(3)).contains("3 vertices"));
    let torus = sample("torus").unwrap();
    let tiny = remesh(device(), &torus, &within(1e-9)).err().unwrap().to_string();
    assert!(tiny.contains("so small a deviation"), "{tiny}");
    let plan = preview(&input, &within(0.1)).err().unwrap().to_string();
    assert!(plan.contains("several runs"), "{plan}");
}

#[test]
fn it_can_be_cancelled_in_any_run() {
    let input = sample("torus").unwrap();
    for attempt in [1, 2, 3] {
        let cancel = |now: rtfmesh::Progress| {
            if now.attempt == attempt && now.fraction > 0.5 { Flow::Cancel } else { Flow::Continue }
        };
        let result = remesh_with_progress(device(), &input, &within(0.5), cancel);
        assert!(matches!(result, Err(Error::Cancelled)), "attempt {attempt}");
    }
}

#[test]
fn a_run_that_finishes_early_tells_its_own_distance() {
    let input = sample("genus3").unwrap();
    let mut finish = |_| Flow::Finish;
    let result = remesh_with_progress(device(), &input, &within(0.5), &mut finish).unwrap();
    assert_valid(device());
    let found = result.summary.deviation.unwrap();
    assert!(result.summary.finished_early && found.runs == 1, "{found:?}");
    // The result's own distance is told all the same.
    let reached = deviation(&result.mesh, &input);
    assert!(found.reached >= reached, "{reached} {found:?}");
    assert!(found.enough.is_none(), "nobody knows: {found:?}");
}
