//! Whole runs of the default pipeline on surfaces with creases, boundaries and non-manifold edges.

use crate::support::shapes::{gear, moved, plane, prism, regular, studs, union};
use crate::support::{assert_valid, device, faults};
use glam::DVec3;
use rtfmesh::mesh::features::{FeatureLine, FeatureOptions, find_features, spacing_of};
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{FeatureLines, Options, Remeshed, TriMesh, WarningCode, remesh};

/// Remeshes, with the checks that hold wherever the result is right.
#[track_caller]
fn run(input: &TriMesh, options: &Options) -> Remeshed {
    let result = remesh(device(), input, options).unwrap();
    assert_valid(device());
    assert_eq!(faults(&result.summary), Vec::<String>::new());
    assert_eq!(result.mesh.vertices.len(), options.vertices);
    let (got, want) = (topology(&result.mesh), topology(input));
    assert_eq!(got.vertices, options.vertices);
    assert_eq!(
        (got.components, got.euler, got.boundary_loops),
        (want.components, want.euler, want.boundary_loops)
    );
    assert_eq!(
        got.inconsistent_edges - got.nonmanifold_edges,
        want.inconsistent_edges - want.nonmanifold_edges
    );
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    result
}

#[test]
fn a_box_and_a_thin_plate_come_back_exactly() {
    for (name, n, least) in [("box", 600, 38.0), ("thin-plate", 1500, 5.0)] {
        let input = sample(name).unwrap();
        let result = run(&input, &Options::new(n));
        let output = &result.summary.output;
        assert!(topology(&result.mesh).is_closed_manifold(), "{name}");
        assert!((output.relative_volume.unwrap() - 1.0).abs() < 1e-5, "{name}: {:?}", output.relative_volume);
        assert!(output.distances.unwrap().hausdorff < 1e-4, "{name}: {:?}", output.distances);
        assert!(output.quality.min_angle > least, "{name}: {:?}", output.quality);
        let found = result.summary.features.unwrap();
        assert_eq!((found.curves, found.corners, found.patches), (12, 8, 6), "{name}");
        for corner in &input.vertices {
            let is_corner = input.bounds().is_some_and(|[lo, hi]| {
                corner
                    .to_array()
                    .iter()
                    .zip(lo.to_array().iter().zip(hi.to_array()))
                    .all(|(x, (l, h))| x == l || *x == h)
            });
            let nearest =
                result.mesh.vertices.iter().map(|v| v.distance(*corner)).fold(f64::INFINITY, f64::min);
            assert!(!is_corner || nearest < 1e-12, "{name}: the corner {corner} is missing");
        }
    }
}

#[test]
fn a_boundary_stays_a_boundary() {
    let result = run(&sample("open-hemisphere").unwrap(), &Options::new(900));
    let output = &result.summary.output;
    assert!(output.quality.min_angle > 38.0 && output.quality.mean_quality > 0.93, "{:?}", output.quality);
    assert!(output.distances.unwrap().hausdorff < 0.2, "{:?}", output.distances);
    assert!(result.summary.features.unwrap().curve_sites > 50);
}

#[test]
fn three_pages_stay_together() {
    let page = |angle: f64| {
        let (sin, cos) = angle.to_radians().sin_cos();
        moved(&plane(6, 0.0), |v| DVec3::new(v.x * cos, v.y, v.x * sin))
    };
    let pages = union(&union(&page(0.0), &page(110.0)), &page(250.0));
    let input = repair(&pages).unwrap().mesh;
    let result = run(&input, &Options::new(900));
    let spine = topology(&result.mesh).nonmanifold_edges;
    assert!((10..40).contains(&spine), "{spine} edges where the pages meet");
    assert!(result.summary.output.distances.unwrap().hausdorff < 1e-4);
}

#[test]
fn sharp_edges_are_kept_by_angle_or_by_name() {
    let input = sample("box").unwrap();
    let none = Options::new(400).feature_angle(180.0);
    assert_eq!(run(&input, &none).summary.features.unwrap().curve_sites, 0);
    let [lo, hi] = input.bounds().unwrap();
    let line = FeatureLine { line: 1, points: vec![lo, DVec3::new(hi.x, lo.y, lo.z)] };
    let one = none.features(FeatureLines::new(vec![line]));
    let result = run(&input, &one);
    let found = result.summary.features.unwrap();
    assert_eq!((found.curves, found.corners), (1, 2));
    let on_edge = |v: &&DVec3| (v.y - lo.y).abs() + (v.z - lo.z).abs() < 1e-12;
    assert!(result.mesh.vertices.iter().filter(on_edge).count() >= found.curve_sites);
}

#[test]
fn reruns_give_the_same_bytes() {
    let input = sample("thin-plate").unwrap();
    let options = Options::new(700).first_iterations(8);
    assert_eq!(run(&input, &options).mesh, run(&input, &options).mesh);
}

#[test]
fn a_line_shorter_than_an_edge_leaves_no_hole() {
    let input = sample("bumpy-sphere").unwrap();
    let [a, b, _] = input.corners(0);
    let line = FeatureLine { line: 1, points: vec![a, b] };
    let result = run(&input, &Options::new(300).features(FeatureLines::new(vec![line])));
    assert_eq!(result.summary.features.unwrap().curve_sites, 3);
    for end in [a, b] {
        assert!(result.mesh.vertices.iter().any(|v| v.distance(end) < 1e-9), "{end} is no vertex");
    }
}

#[test]
fn features_too_narrow_for_the_spacing_are_counted_in_the_input_s_units() {
    let input = moved(&plane(40, 0.0), |v| {
        let (x, z) = if v.x > 0.5 { (v.x - 1.0 / 40.0, -0.4) } else { (v.x, 0.0) };
        DVec3::new(100.0 * x, 100.0 * v.y, z)
    });
    let summary = run(&input, &Options::new(500)).summary;
    assert_eq!(summary.warning_codes, [WarningCode::SharpEdges]);
    let said = "sharp edges of length 200.0 (of 200.0 in total) were given up: 4,800 vertices keep them";
    assert_eq!(summary.warnings, [said]);
    // However few vertices there are.
    let few = run(&input, &Options::new(40)).summary;
    assert!(few.warning_codes.contains(&WarningCode::SharpEdges), "{:?}", few.warnings);
    let kept = run(&input, &Options::new(4800)).summary;
    assert_eq!((kept.warning_codes, kept.features.unwrap().discarded.length()), (vec![], 0.0));
    let spacing = spacing_of(&input, 500).unwrap();
    let discarded = find_features(&input, &FeatureOptions::new(spacing)).unwrap().discarded;
    let counted = summary.features.unwrap().discarded;
    assert_eq!(counted, discarded);
    assert_eq!(discarded.strips, 1);
    assert!((discarded.strip_length - 200.0).abs() < 1e-6, "{discarded:?}");
}

#[test]
fn a_coarse_tube_is_round_where_its_facets_are_narrow_and_a_prism_where_they_are_wide() {
    let tube = prism(&regular(8), 20.0);
    let narrow = run(&tube, &Options::new(100)).summary;
    assert_eq!(narrow.warning_codes.first(), Some(&WarningCode::NarrowFacets), "{:?}", narrow.warnings);
    assert!(narrow.output.quality.fraction_below_30 < 0.02, "{:?}", narrow.output.quality);
    assert!(narrow.attempts > 1);
    let (before, _) = narrow.warnings[0].split_once(" vertices keep them").unwrap();
    let enough: usize = before.rsplit(' ').next().unwrap().replace(',', "").parse().unwrap();
    let kept = run(&tube, &Options::new(enough)).summary;
    assert_eq!((kept.features.unwrap().discarded.facet_edges, kept.warnings), (0, Vec::new()), "{enough}");
    let wide = run(&tube, &Options::new(3000)).summary;
    assert_eq!((wide.features.unwrap().discarded.facet_edges, wide.warnings), (0, Vec::new()));
    // Good triangles between creases leave no doubt, however narrow the facets.
    let nut = prism(&regular(6), 20.0);
    assert_eq!(run(&nut, &Options::new(100)).summary.features.unwrap().discarded.facet_edges, 0);
    // No edge of so many is as short as its facets are wide.
    let pipe = run(&prism(&regular(200), 20.0), &Options::new(700).feature_angle(1.0)).summary;
    assert!(pipe.warnings[0].ends_with(": even 50,000 vertices do not keep them"), "{:?}", pipe.warnings);
}

#[test]
fn a_gear_keeps_its_teeth_where_its_creases_need_most_of_the_vertices() {
    let gear = gear(12, 0.7, 0.3);
    for vertices in [60, 100] {
        let output = run(&gear, &Options::new(vertices)).summary.output;
        assert!(output.distances.as_ref().unwrap().hausdorff < 1.5, "{vertices}: {:?}", output.distances);
        assert!(output.quality.min_angle > 25.0, "{vertices}: {:?}", output.quality);
    }
}

#[test]
fn studs_narrower_than_an_edge_do_not_melt() {
    for (width, height) in [(0.06, 0.06), (0.04, 0.08)] {
        let plate = studs(5, width, height);
        for vertices in [250, 400] {
            let distances = run(&plate, &Options::new(vertices)).summary.output.distances.unwrap();
            assert!(distances.hausdorff < 1.0, "{width}, {vertices}: {distances:?}");
        }
    }
}

#[test]
fn the_tip_between_an_arc_and_its_tangent_is_no_needle() {
    // A rectangle with a corner cut out by an arc, which leaves the lower side without a bend.
    let arc = (0..=18).rev().map(|k| 5.0 * f64::from(k)).map(|degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        DVec3::new(sin, 1.0 - cos, 0.0)
    });
    let corners = [[9.0, 0.0], [9.0, 6.0], [1.0, 6.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let vertices: Vec<DVec3> = corners.into_iter().chain(arc).collect();
    let triangles = (2..vertices.len() as u32).map(|k| [0, k - 1, k]).collect();
    let input = TriMesh { vertices, triangles };
    for n in [80, 150, 200, 220] {
        let quality = run(&input, &Options::new(n)).summary.output.quality;
        // With segments of one length: 11.5 to 15 degrees.
        assert!(quality.min_angle > 16.5, "{n}: {quality:?}");
    }
}
