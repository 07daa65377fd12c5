//! Whole runs with barely enough vertices, or too few.

use crate::support::generators::Shape;
use crate::support::shapes::{cube, globe, moved, torus, union};
use crate::support::{assert_valid, device, faults};
use glam::{DQuat, DVec2, DVec3};
use rtfmesh::mesh::features::FeatureLine;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, FeatureLines, Options, Remeshed, Result, Shortage, Sizing, TriMesh, remesh};
use std::f64::consts::FRAC_PI_2;

fn run(mesh: &TriMesh, vertices: usize, shortage: Shortage) -> Result<Remeshed> {
    let result = remesh(device(), mesh, &Options::new(vertices).shortage(shortage));
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
    assert_eq!(faults(&result.summary), Vec::<String>::new(), "{vertices}");
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

/// A surface that needs 21 vertices, with a user's point, for which local operations do not step in.
fn with_a_point(vertices: usize, shortage: Shortage) -> Result<Remeshed> {
    let input = sample("genus3").unwrap();
    let points = input.vertices[..1].to_vec();
    let result = remesh(device(), &input, &Options::new(vertices).shortage(shortage).points(points));
    assert_valid(device());
    result
}

#[test]
fn a_faulty_result_is_refused_if_asked_for_and_vertices_added() {
    let input = sample("genus3").unwrap();
    let error = with_a_point(20, Shortage::Refuse).unwrap_err();
    assert!(matches!(error, Error::Input { .. }), "{error:?}");
    let text = error.to_string();
    assert!(
        text.contains("could not build a valid mesh with 20 vertices") && text.contains("near ("),
        "{text}"
    );
    let added = run(&input, 20, Shortage::AddVertices).unwrap();
    let enough = added.mesh.vertices.len();
    assert!(enough > 20 && added.summary.attempts > 1, "{enough}");
    assert_like(&input, &added, enough);
    assert_eq!(run(&input, enough, Shortage::Refuse).unwrap().mesh, added.mesh);
}

#[test]
fn vertices_are_added_until_they_suffice_for_the_curves_that_finer_edges_show() {
    let plate = Shape::Plate { holes: 20, thickness: 0.05 / 3.0, parts: 1, rounds: 0 }.mesh();
    let added = run(&plate, 30, Shortage::AddVertices).unwrap();
    assert_like(&plate, &added, added.mesh.vertices.len());
}

#[test]
fn with_best_effort_it_comes_out_with_warnings() {
    let result = with_a_point(20, Shortage::BestEffort).unwrap();
    assert!(!result.mesh.triangles.is_empty());
    let warnings = faults(&result.summary);
    assert!(warnings.iter().any(|w| w.contains("near (")), "{warnings:?}");
}

#[test]
fn fewer_vertices_than_the_topology_needs_are_refused_with_that_number() {
    let input = sample("genus3").unwrap();
    let error = run(&input, 8, Shortage::Refuse).unwrap_err();
    assert!(error.to_string().starts_with("8 vertices are too few for the topology"), "{error}");
    let enough = advised(&error);
    assert_like(&input, &run(&input, enough, Shortage::Refuse).unwrap(), enough);
}

#[test]
fn faces_intersect_before_a_number_that_the_topology_allows_is_refused() {
    let plate = Shape::Plate { holes: 5, thickness: 0.2, parts: 4, rounds: 0 }.mesh();
    for input in [plate, sample("genus3").unwrap()] {
        let [strict, fewest] = [Shortage::Refuse, Shortage::BestEffort]
            .map(|shortage| advised(&run(&input, 8, shortage).unwrap_err()));
        assert!(fewest < strict, "{fewest} {strict}");
        let made = run(&input, fewest, Shortage::BestEffort).unwrap();
        let (before, after) = (topology(&input), topology(&made.mesh));
        assert_eq!((after.vertices, after.genus), (fewest, before.genus));
        assert!(after.is_closed_manifold());
        assert!(!faults(&made.summary).is_empty());
    }
}

#[test]
fn small_components_leave_the_large_one_what_its_topology_needs() {
    let plate = Shape::Plate { holes: 5, thickness: 0.2, parts: 4, rounds: 0 }.mesh();
    let size = plate.bounds().map(|[lo, hi]| lo.distance(hi)).unwrap();
    let beside = |k: u32| moved(&cube(), |v| 0.02 * size * v + size * f64::from(k) * DVec3::X);
    let input = (1..=12).fold(plate, |all, k| union(&all, &beside(k)));
    let error = run(&input, 50, Shortage::Refuse).unwrap_err();
    let enough = advised(&error);
    for vertices in [enough, enough + 7, enough + 30] {
        assert_like(&input, &run(&input, vertices, Shortage::Refuse).unwrap(), vertices);
    }
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
    let features = FeatureLines::new(vec![line]);
    let run = |vertices| remesh(device(), &input, &Options::new(vertices).features(features.clone()));
    // There are eight corners.
    let error = run(7).unwrap_err();
    assert!(matches!(error, Error::Usage { .. }), "{error:?}");
    for vertices in [8, 20, advised(&error)] {
        assert_like(&input, &run(vertices).unwrap(), vertices);
    }
}

/// A globe whose triangles at the poles have vertices of their own there, this far apart, one for every
/// fourth.
fn slit_at_the_poles(width: f64) -> TriMesh {
    let mut mesh = globe(16, 8);
    for (k, triangle) in mesh.triangles.iter_mut().enumerate() {
        let (sin, cos) = (FRAC_PI_2 * (k % 4) as f64).sin_cos();
        for v in triangle.iter_mut().filter(|v| **v < 2) {
            mesh.vertices.push(mesh.vertices[*v as usize] + width * DVec3::new(cos, sin, 0.0));
            *v = mesh.vertices.len() as u32 - 1;
        }
    }
    mesh
}

#[test]
fn torn_surfaces_are_closed_or_it_is_said_how() {
    for width in [1e-16, 1e-4] {
        let one = slit_at_the_poles(width);
        let two = union(&one, &moved(&one, |v| v * DVec3::new(2.0, 1.0, 1.0) + 3.0 * DVec3::X));
        let result = run(&two, 600, Shortage::Refuse).unwrap();
        let warnings = faults(&result.summary);
        let [warning] = warnings.as_slice() else {
            assert_eq!((width, &warnings), (1e-16, &vec![]));
            assert!(topology(&result.mesh).is_closed_manifold());
            continue;
        };
        assert!(width > 1e-16 && warning.ends_with("`weld` 2e-4 closes them"), "{width:e}: {warning}");
        let closed = remesh(device(), &one, &Options::new(600).weld(2e-4)).unwrap();
        assert_like(&globe(16, 8), &closed, 600);
    }
}

#[test]
fn too_many_components_are_blamed_on_cracks() {
    let ball = globe(16, 8);
    let corners = ball.triangles.as_flattened().iter().enumerate();
    let off = |k: usize| 1e-4 * DVec3::new((k % 7) as f64, (k % 5) as f64, (k % 3) as f64) / 7.0;
    let vertices = corners.map(|(k, v)| ball.vertices[*v as usize] + off(k)).collect();
    let triangles = (0..ball.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let soup = TriMesh { vertices, triangles };
    let text = run(&soup, 200, Shortage::BestEffort).unwrap_err().to_string();
    assert!(text.contains("the input has cracks") && text.contains("`weld` "), "{text}");
    let weld: f64 = text.split("`weld` ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let closed = remesh(device(), &soup, &Options::new(200).weld(weld)).unwrap();
    assert_eq!((topology(&closed.mesh).components, topology(&closed.mesh).boundary_edges), (1, 0));
}

/// A cube with a needle on top, this many times thinner than the edges of a few hundred vertices.
pub fn cube_with_a_pin(times: f64) -> TriMesh {
    let mut body = remesh(device(), &sample("box").unwrap(), &Options::new(300)).unwrap().mesh;
    let is_on_top = |t: &usize| body.triangles[*t].iter().all(|v| body.vertices[*v as usize].z == 1.0);
    let top = (0..body.triangles.len()).find(is_on_top).unwrap();
    let corners = body.corners(top);
    let centre = corners.iter().sum::<DVec3>() / 3.0;
    let first = body.vertices.len() as u32;
    // A small triangle inside, and the tip.
    body.vertices.extend(corners.map(|p| centre.lerp(p, 1.0 / times)));
    body.vertices.push(centre + DVec3::Z);
    let [a, b, c] = body.triangles[top];
    let [p, q, r, tip] = [0, 1, 2, 3].map(|k| first + k);
    body.triangles[top] = [a, b, q];
    body.triangles.extend([[a, q, p], [b, c, r], [b, r, q], [c, a, p], [c, p, r]]);
    body.triangles.extend([[p, q, tip], [q, r, tip], [r, p, tip]]);
    body
}

#[test]
fn a_pin_is_kept() {
    let input = cube_with_a_pin(100.0);
    assert!(topology(&input).is_closed_manifold());
    // Without features nothing else would hold the tip.
    let result = remesh(device(), &input, &Options::new(400).feature_angle(180.0)).unwrap();
    assert_like(&input, &result, 400);
    let missing = result.summary.output.distances.unwrap().hausdorff_from_reference;
    assert!(missing < 3.0, "{missing}");
    assert_eq!(result.summary.collapsed_components, 1);
    // They were those of the cells that left the pin out.
    assert_eq!(result.summary.connected.cells, None);
}

#[test]
fn bodies_that_run_through_each_other_do_so_in_the_result() {
    let cube = sample("box").unwrap();
    let both = union(&cube, &moved(&cube, |v| v + DVec3::new(0.5, 0.4, 0.3)));
    for n in [300, 1500] {
        let result = run(&both, n, Shortage::Refuse).unwrap();
        assert_eq!(result.mesh.vertices.len(), n);
        assert_eq!(topology(&result.mesh).components, 2);
        assert!(result.summary.output.self_intersecting_faces > Some(0));
        assert_eq!(result.summary.warnings, Vec::<String>::new());
    }
}

#[test]
fn parts_that_touch_remain_apart_in_the_result() {
    // Two cubes with a side in common: vertices of both stand at the same places.
    let cube = sample("box").unwrap();
    let both = union(&cube, &moved(&cube, |v| v + DVec3::X));
    let result = run(&both, 400, Shortage::BestEffort).unwrap();
    assert_eq!(result.mesh.vertices.len(), 400);
    let mut places: Vec<[u64; 3]> =
        result.mesh.vertices.iter().map(|v| v.to_array().map(|x| (x + 0.0).to_bits())).collect();
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 400);
}

#[test]
fn local_operations_alone_do_the_same_work() {
    for (name, n) in [("torus", 500), ("genus3", 900), ("box", 600), ("two-components", 700)] {
        let input = sample(name).unwrap();
        let result = remesh(device(), &input, &Options::new(n).local(true)).unwrap();
        assert_like(&input, &result, n);
        assert!(
            result.summary.output.quality.mean_quality > 0.9,
            "{name}: {:?}",
            result.summary.output.quality
        );
        assert_eq!(result.summary.iterations, 0);
    }
}

#[test]
fn local_operations_go_on_where_the_input_runs_through_itself() {
    // A tube along a figure of eight, coarser than the result, which has more faces where it crosses itself.
    let eight = moved(&torus(40, 12), |v| {
        let around = v.truncate();
        let (along, out) = (around.to_angle(), (around.length() - 1.0) / 4.0);
        let tangent = DVec2::new(along.cos(), (2.0 * along).cos()).normalize();
        let at = DVec2::new(along.sin(), along.sin() * along.cos()) + out * DVec2::new(tangent.y, -tangent.x);
        at.extend(v.z / 4.0)
    });
    let result = remesh(device(), &eight, &Options::new(3000).local(true)).unwrap();
    let output = &result.summary.output;
    assert!(output.quality.mean_quality > 0.9, "{:?}", output.quality);
    assert!(output.self_intersecting_faces > Some(0));
    let kind = [&result.mesh, &eight].map(topology).map(|t| (t.components, t.euler, t.boundary_loops));
    assert_eq!((kind[0], result.mesh.vertices.len()), (kind[1], 3000));
}

#[test]
fn local_operations_follow_the_size_field() {
    let input = sample("genus3").unwrap();
    let made = |options: Options| {
        let result = remesh(device(), &input, &options.local(true)).unwrap();
        assert_like(&input, &result, 1500);
        result.summary.output.quality.edge_cv
    };
    let even = made(Options::new(1500));
    let sized = made(Options::new(1500).sizing(Sizing::Curvature { gradation: 1.0 }));
    assert!(even < 0.15 && sized > 0.25, "{even} {sized}");
}

#[test]
fn dented_bodies_of_few_vertices_face_outwards() {
    for (turn, depth) in [(0.9, 1.2), (1.3, 1.5)] {
        let dent =
            |v: DVec3| DVec3::new(v.x, v.y, if v.z > 0.3 { v.z - depth * (v.z - 0.3) * 2.0 } else { v.z });
        let input = moved(&moved(&globe(24, 12), dent), |v| DQuat::from_axis_angle(DVec3::X, turn) * v);
        for vertices in [4, 5] {
            for seed in 0..3 {
                let result = remesh(device(), &input, &Options::new(vertices).seed(seed)).unwrap();
                assert_valid(device());
                let volume = result.summary.output.relative_volume.unwrap();
                assert!(volume > -1e-3, "{volume}: {turn} {depth}, {vertices} vertices, seed {seed}");
            }
        }
    }
}
