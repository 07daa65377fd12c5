//! Whole runs on generated surfaces as files have them: no result is worse than its input without a warning,
//! and the report describes the mesh that comes out.
//!
//! `PROPTEST_CASES=2000 cargo test --release --test tests -- dirty` tries many, and names those that fail.

use super::properties::{config, differences};
use crate::support::dirty::{Arrangement, Defect, Dirty};
use crate::support::{assert_valid, device};
use proptest::prelude::*;
use rtfmesh::measure::{Measures, measure};
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, Options, TriMesh, remesh};

/// Largest distance of the result from a point of the input, in edge lengths.
const MISSING: f64 = 2.0;

/// What is wrong with a result and not said of it.
fn unsaid(dirty: &Dirty, vertices: usize) -> Vec<String> {
    let input = dirty.mesh();
    let result = match remesh(device(), &input, &Options::new(vertices)) {
        Ok(result) => result,
        // Every component needs four vertices, seven if it is a torus, and three for each hole.
        Err(Error::Usage { problem, .. }) if problem.contains("too few") => {
            let of = topology(&repair(&input).unwrap().mesh);
            let least = 7 * of.components + 3 * of.boundary_loops;
            return if least > vertices { Vec::new() } else { vec![problem] };
        }
        Err(error) => return vec![format!("refused: {error}")],
    };
    assert_valid(device());
    let summary = &result.summary;
    let mut list = untrue(&summary.output, &result.mesh);
    let count = result.mesh.vertices.len();
    if count != vertices {
        list.push(format!("{count} vertices"));
    }
    let repaired = repair(&input).unwrap().mesh;
    let mut found = worse(&summary.output, &measure(&repaired, None).unwrap());
    let [low, high] = repaired.bounds().unwrap();
    let percent = summary.output.distances.map_or(0.0, |distances| distances.hausdorff_from_reference_lower);
    let edges = percent / 100.0 * low.distance(high) / summary.spacing;
    if edges > MISSING {
        found.push((format!("parts are missing, {edges} edges away"), &["missing", "left out"]));
    }
    let is_said = |words: &[&str]| summary.warnings.iter().any(|said| words.iter().any(|w| said.contains(w)));
    list.extend(found.into_iter().filter(|(_, words)| !is_said(words)).map(|(wrong, _)| wrong));
    list
}

/// What the report has other than an independent count.
fn untrue(report: &Measures, mesh: &TriMesh) -> Vec<String> {
    let found = measure(mesh, None).unwrap();
    let mut list = Vec::new();
    if report.topology != found.topology {
        list.push(format!("reported {:?}, is {:?}", report.topology, found.topology));
    }
    if report.self_intersecting_faces != found.self_intersecting_faces {
        let [reported, is] = [report, &found].map(|measures| measures.self_intersecting_faces);
        list.push(format!("reported {reported:?} intersecting faces, are {is:?}"));
    }
    if report.quality != found.quality {
        list.push(format!("reported {:?}, is {:?}", report.quality, found.quality));
    }
    list
}

/// In what a result is worse than its input, each with words of the warnings that say so.
fn worse(result: &Measures, input: &Measures) -> Vec<(String, &'static [&'static str])> {
    let mut list: Vec<(String, &'static [&'static str])> = Vec::new();
    for difference in differences(&result.topology, &input.topology) {
        list.push((difference, &["topology differs", "are lost"]));
    }
    if input.self_intersecting_faces == Some(0) && result.self_intersecting_faces != Some(0) {
        list.push((format!("{:?} intersecting faces", result.self_intersecting_faces), &["intersect"]));
    }
    if input.quality.min_angle > 2.0 && result.quality.min_angle < 1.0 {
        list.push((format!("an angle of {} degrees", result.quality.min_angle), &["an angle below"]));
    }
    let volumes = result.relative_volume.zip(input.relative_volume);
    if volumes.is_some_and(|(got, want)| got * want < 0.0 && got.abs().min(want.abs()) > 1e-3) {
        list.push((format!("inside out: {volumes:?}"), &["inside out"]));
    }
    list
}

fn arrangements() -> impl Strategy<Value = Arrangement> {
    let gap = (1e-4f64.ln()..0.5f64.ln()).prop_map(|log| Arrangement::Row(log.exp()));
    prop_oneof![Just(Arrangement::Through), gap, Just(Arrangement::Around)]
}

fn defects() -> impl Strategy<Value = Defect> {
    prop_oneof![
        3 => Just(Defect::None),
        1 => prop_oneof![Just(0.0), Just(1e-7), Just(1e-5), Just(1e-3)].prop_map(Defect::Shattered),
        1 => Just(Defect::Doubled),
        1 => Just(Defect::Turned),
        1 => Just(Defect::Missing),
        1 => Just(Defect::Joints),
    ]
}

proptest! {
    #![proptest_config(config(12))]

    #[test]
    fn nothing_is_worse_than_its_input_without_a_warning(
        (bodies, arrangement, defect) in (1usize..=8, arrangements(), defects()),
        (seed, vertices) in (0u64..1_000_000, 100usize..800),
    ) {
        let dirty = Dirty { bodies, arrangement, defect, seed };
        let wrong = unsaid(&dirty, vertices);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }
}
