//! Whole runs on generated surfaces: whatever the input, the result is a valid mesh of the same topology.
//!
//! `PROPTEST_CASES` and `PROPTEST_RNG_SEED` try more or other cases than the few of every day.

use crate::support::generators::Shape;
use crate::support::shapes::{cube, moved, sphere, union};
use crate::support::{assert_valid, device, faults as warned_of};
use glam::DVec3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::topology::{Topology, topology};
use rtfmesh::{MeasureDepth, Options, remesh};

/// In what the topology of a result differs from that of its input.
pub fn differences(got: &Topology, want: &Topology) -> Vec<String> {
    let figures = [
        ("components", got.components as i64, want.components as i64),
        ("Euler characteristic", got.euler, want.euler),
        ("boundary loops", got.boundary_loops as i64, want.boundary_loops as i64),
        ("duplicate faces", got.duplicate_faces as i64, 0),
        ("irregular vertices", got.nonmanifold_vertices as i64, want.nonmanifold_vertices as i64),
        ("junctions", i64::from(got.nonmanifold_edges > 0), i64::from(want.nonmanifold_edges > 0)),
        ("inconsistent", i64::from(got.inconsistent_edges > 0), i64::from(want.inconsistent_edges > 0)),
    ];
    let wrong = figures.iter().filter(|(_, got, want)| got != want);
    wrong.map(|(name, got, want)| format!("{name}: {got} for {want}")).collect()
}

/// What is wrong with the result; nothing for a valid one.
fn faults(shape: &Shape, n: usize, seed: u64) -> Vec<String> {
    let input = shape.mesh();
    let options = Options::new(n).seed(seed).measures(MeasureDepth::Intersections);
    let result = match remesh(device(), &input, &options) {
        Ok(result) => result,
        Err(error) => return vec![format!("refused: {error}")],
    };
    assert_valid(device());
    let mut list = warned_of(&result.summary);
    let got = topology(&result.mesh);
    list.extend(differences(&got, &topology(&input)));
    if got.vertices != n {
        list.push(format!("{} vertices in use", got.vertices));
    }
    let [before, after] = [quality(&input), Some(result.summary.output.quality)];
    let smallest = [before, after].map(|of| of.map_or(60.0, |quality| quality.min_angle));
    if smallest[0] > 2.0 && smallest[1] < 1.0 {
        list.push(format!("an angle of {} degrees", smallest[1]));
    }
    let intersecting = result.summary.output.self_intersecting_faces;
    if intersecting != Some(0) {
        list.push(format!("intersecting faces: {intersecting:?}"));
    }
    if result.mesh.vertices.len() != n {
        list.push(format!("{} vertices in the list", result.mesh.vertices.len()));
    }
    list
}

#[track_caller]
fn check(shape: &Shape, n: usize, seed: u64) {
    assert_eq!(faults(shape, n, seed), Vec::<String>::new(), "{shape:?}, {n} vertices, seed {seed}");
}

/// The same cases every day, unless the environment says otherwise.
pub fn config(cases: u32) -> ProptestConfig {
    let given = ProptestConfig::default();
    let asked = |name: &str| std::env::var_os(name).is_some();
    ProptestConfig {
        cases: if asked("PROPTEST_CASES") { given.cases } else { cases },
        rng_seed: if asked("PROPTEST_RNG_SEED") { given.rng_seed } else { RngSeed::Fixed(1) },
        failure_persistence: None,
        // A case takes a second: a few smaller ones will do.
        max_shrink_iters: 12,
        ..given
    }
}

/// From a low to a high number, each magnitude as often as the others.
fn magnitude(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

#[test]
fn the_least_count_for_many_components_is_named_and_does() {
    let radii = (0..50).map(|k| 0.02 * 50f64.powf(f64::from(k * 17 % 50) / 49.0)).collect();
    let shape = Shape::Spheres { radii };
    check(&shape, 200, 1);
    let text = faults(&shape, 199, 1).concat();
    assert!(text.contains("199 vertices are too few") && text.contains("ask for 200 vertices"), "{text}");
}

#[test]
fn handles_smaller_than_an_edge_survive() {
    for n in [61, 90, 150] {
        check(&Shape::Plate { holes: 5, thickness: 0.2, parts: 4, rounds: 3 }, n, 1);
    }
}

#[test]
fn fewer_vertices_than_the_sharp_edges_want_do() {
    check(&Shape::Wedge { degrees: 60.0, length: 2.0, parts: 4 }, 6, 1);
    check(&Shape::Plate { holes: 0, thickness: 0.2, parts: 2, rounds: 0 }, 8, 1);
    check(&Shape::Sheet { holes: 2, bend: 0.2, parts: 3 }, 12, 1);
    check(&Shape::Book { pages: vec![0.0, 100.0, 220.0], parts: 4 }, 8, 1);
}

#[test]
fn a_touching_pair_smaller_than_an_edge_survives() {
    let (ball, pair) = (sphere(1.0, 4), union(&cube(), &moved(&cube(), |v| v + DVec3::ONE)));
    let input = repair(&union(&ball, &moved(&pair, |v| 0.02 * v + 2.0 * DVec3::X))).unwrap().mesh;
    let result = remesh(device(), &input, &Options::new(400)).unwrap();
    let (got, want) = (topology(&result.mesh), topology(&input));
    assert_eq!((got.components, got.euler, got.nonmanifold_vertices), (2, want.euler, 1));
    assert_eq!((got.vertices, result.summary.output.self_intersecting_faces), (400, Some(0)));
    assert_eq!((result.summary.collapsed_components, result.summary.remarks.len()), (1, 2));
}

proptest! {
    #![proptest_config(config(6))]

    #[test]
    fn plates_with_holes(
        (holes, thickness, parts) in (0u32..=5, magnitude(1e-3, 0.3), 2u32..5),
        (rounds, n, seed) in (0u32..6, 400usize..900, 0u64..1000),
    ) {
        let wrong = faults(&Shape::Plate { holes, thickness, parts, rounds }, n, seed);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn sheets_with_holes(
        (holes, bend, parts) in (0u32..=5, 0.0..0.4, 2u32..6),
        (n, seed) in (300usize..900, 0u64..1000),
    ) {
        let wrong = faults(&Shape::Sheet { holes, bend, parts }, n, seed);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn sheets_nearly_touching(
        gap in magnitude(1e-3, 0.1), closed: bool, n in 300usize..900, seed in 0u64..1000,
    ) {
        // Between faces of coarse spheres there is less room than between the spheres.
        let gap = if closed { gap.max(0.05) } else { gap };
        let wrong = faults(&Shape::Near { gap, closed }, n, seed);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn wedges(
        (degrees, length, parts) in (10.0..170.0, 0.3..4.0, 2u32..8),
        (n, seed) in (200usize..900, 0u64..1000),
    ) {
        let wrong = faults(&Shape::Wedge { degrees, length, parts }, n, seed);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn books(
        (first, steps, parts) in (0.0..360.0, prop::collection::vec(20.0..100.0, 2..4), 2u32..8),
        (n, seed) in (200usize..900, 0u64..1000),
    ) {
        let next = |at: &mut f64, step: f64| { *at += step; Some(*at) };
        let pages: Vec<f64> = std::iter::once(0.0).chain(steps).scan(first, next).collect();
        let wrong = faults(&Shape::Book { pages, parts }, n, seed);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }

    #[test]
    fn many_spheres(
        radii in prop::collection::vec(magnitude(0.02, 1.0), 1..=50),
        (n, seed) in (400usize..900, 0u64..1000),
    ) {
        let wrong = faults(&Shape::Spheres { radii }, n, seed);
        prop_assert!(wrong.is_empty(), "{wrong:?}");
    }
}
