//! Holes filled by patches that follow the surface around them.

use crate::support::shapes::{moved, plane, sphere, torus, union};
use glam::DVec3;
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::repair::{RepairOptions, Repaired, repair_with};
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Length, ProgressToken, TriMesh};

const ALL: Length = Length::OfDiagonal(1.0);

fn filled(mesh: &TriMesh, largest: Length) -> Repaired {
    repair_with(mesh, &RepairOptions::default().fill_holes(largest)).unwrap()
}

/// The mesh without the triangles whose centres meet the condition.
fn without(mesh: &TriMesh, is_cut: impl Fn(DVec3) -> bool) -> TriMesh {
    let centre = |t: usize| mesh.corners(t).into_iter().sum::<DVec3>() / 3.0;
    let kept = (0..mesh.triangles.len()).filter(|t| !is_cut(centre(*t))).map(|t| mesh.triangles[t]).collect();
    TriMesh { triangles: kept, ..mesh.clone() }
}

fn volume(mesh: &TriMesh) -> f64 {
    let cone = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        a.dot(b.cross(c)) / 6.0
    };
    (0..mesh.triangles.len()).map(cone).sum()
}

#[test]
fn caps_of_a_sphere_come_back_round_with_triangles_like_the_rest() {
    let ball = sphere(1.0, 5);
    // What bends least is flatter than a sphere, the more so the wider a hole is. Of each: its height, the
    // share of the volume that is lost at most, the largest distance, and how many times as large triangles
    // are.
    for (height, lost, far, larger) in
        [(0.98, 1e-4, 0.003, 1.3), (0.9, 0.0025, 0.02, 1.5), (0.6, 0.05, 0.13, 3.0)]
    {
        let open = without(&ball, |p| p.z.abs() > height);
        let result = filled(&open, ALL);
        assert_eq!((result.counts.holes_filled, result.counts.holes_left), (2, 0));
        assert!(topology(&result.mesh).is_closed_manifold());
        let share = volume(&result.mesh) / volume(&ball);
        assert!((1.0 - lost..1.0 + 1e-4).contains(&share), "{height}: {share} of the volume");
        let off = result.mesh.vertices.iter().map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < far, "{height}: {off} off the sphere");
        let kept = open.triangles.len();
        let [inside, outside] = [kept..result.mesh.triangles.len(), 0..kept].map(|range| {
            let near =
                range.filter(|t| result.mesh.corners(*t).into_iter().all(|p| p.z.abs() > height - 0.15));
            let areas: Vec<f64> = near.map(|t| result.mesh.triangle_area(t)).collect();
            areas.iter().sum::<f64>() / areas.len() as f64
        });
        assert!((0.8..larger).contains(&(inside / outside)), "{height}: {inside}, beside it {outside}");
        let patch = TriMesh { triangles: result.mesh.triangles[kept..].to_vec(), ..result.mesh.clone() };
        let shape = quality(&patch).unwrap();
        assert!(shape.mean_quality > 0.75, "{height}: {shape:?}");
        assert!(intersecting_faces(&result.mesh, &ProgressToken::default()).unwrap().is_empty());
    }
}

#[test]
fn nothing_else_moves_and_triangles_of_a_patch_come_from_beside_their_hole() {
    let ring = torus(40, 24);
    let open = without(&ring, |p| p.distance(DVec3::new(1.4, 0.0, 0.0)) < 0.3);
    let result = filled(&open, ALL);
    let (before, kept) = (repair_with(&open, &RepairOptions::default()).unwrap(), open.triangles.len());
    assert_eq!(result.mesh.vertices[..before.mesh.vertices.len()], before.mesh.vertices);
    assert_eq!(result.mesh.triangles[..kept], before.mesh.triangles);
    assert_eq!(topology(&result.mesh).genus, Some(1));
    for (t, origin) in result.origin.iter().enumerate().skip(kept) {
        let [own, other] = [(t, &result.mesh), (*origin as usize, &open)]
            .map(|(t, mesh)| mesh.corners(t).into_iter().sum::<DVec3>() / 3.0);
        assert!(own.distance(other) < 0.4, "{own} is said to be from {other}");
    }
}

#[test]
fn holes_wider_than_asked_for_stay() {
    let square = plane(20, 0.0);
    let open = without(&square, |p| {
        p.distance(DVec3::new(0.3, 0.3, 0.0)) < 0.08 || p.distance(DVec3::new(0.7, 0.7, 0.0)) < 0.16
    });
    for (largest, [filled_up, left]) in [(0.05, [0, 3]), (0.3, [1, 2]), (0.6, [2, 1])] {
        for largest in [Length::Units(largest), Length::OfDiagonal(largest / 2f64.sqrt())] {
            let result = filled(&open, largest);
            assert_eq!([result.counts.holes_filled, result.counts.holes_left], [filled_up, left]);
            assert!(result.mesh.vertices.iter().all(|p| p.z.abs() < 1e-9));
            assert_eq!(topology(&result.mesh).boundary_loops, left);
        }
    }
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = RepairOptions::default().fill_holes(Length::Units(wrong));
        assert!(repair_with(&open, &options).unwrap_err().to_string().contains("`fill_holes`"));
    }
}

#[test]
fn ragged_holes_of_any_length_are_filled_without_folds() {
    for (across, edges) in [(60, 100..300), (160, 400..900)] {
        let square = plane(across, 0.0);
        // A rim that goes in and out.
        let radius = |p: DVec3| {
            let way = p - DVec3::new(0.5, 0.5, 0.0);
            way.length() * (1.0 + 0.15 * (7.0 * way.y.atan2(way.x)).sin())
        };
        let open = without(&square, |p| radius(p) < 0.35);
        let result = filled(&open, Length::Units(1.2));
        assert_eq!((result.counts.holes_filled, topology(&result.mesh).boundary_loops), (1, 1), "{across}");
        let rim = topology(&open).boundary_edges - topology(&square).boundary_edges;
        assert!(edges.contains(&rim), "{rim}");
        assert!((result.mesh.area() - 1.0).abs() < 1e-9, "{}", result.mesh.area());
        for t in 0..result.mesh.triangles.len() {
            let [a, b, c] = result.mesh.corners(t);
            assert!((b - a).cross(c - a).z > 0.0, "{a} {b} {c} is folded");
        }
    }
}

#[test]
fn specks_are_not_closed_onto_themselves() {
    let speck = TriMesh {
        vertices: vec![DVec3::X * 3.0, DVec3::new(3.1, 0.0, 0.0), DVec3::new(3.0, 0.1, 0.0)],
        triangles: vec![[0, 1, 2]],
    };
    let ball = sphere(1.0, 4);
    let open = union(&without(&ball, |p| p.z > 0.98), &speck);
    for largest in [Length::Units(0.6), ALL] {
        let result = filled(&open, largest);
        assert_eq!((result.counts.holes_filled, result.counts.holes_left), (1, 1));
        assert_eq!(topology(&result.mesh).boundary_loops, 1);
    }
}

#[test]
fn parts_that_hang_in_a_hole_by_a_vertex_are_removed() {
    let square = plane(20, 0.0);
    let open = without(&square, |p| p.distance(DVec3::new(0.5, 0.5, 0.0)) < 0.2);
    let rim = open.vertices.iter().position(|p| p.distance(DVec3::new(0.7, 0.5, 0.0)) < 0.03).unwrap();
    let tip = open.vertices[rim];
    let mut hung = open.clone();
    let first = hung.vertices.len() as u32;
    hung.vertices.extend([tip + DVec3::new(-0.1, 0.02, 0.0), tip + DVec3::new(-0.1, -0.02, 0.0)]);
    hung.triangles.push([rim as u32, first, first + 1]);
    let [bare, result] = [&open, &hung].map(|mesh| filled(mesh, Length::Units(0.6)));
    assert_eq!((result.counts.parts_removed, bare.counts.parts_removed), (1, 0));
    assert!(result.mesh == bare.mesh && result.counts.holes_filled == 1);
    // Nothing is removed where no holes are to be filled.
    let untouched = repair_with(&hung, &RepairOptions::default()).unwrap().mesh;
    assert_eq!(untouched.triangles.len(), hung.triangles.len());
}

#[test]
fn holes_that_touch_at_a_vertex_are_filled_each() {
    let ball = sphere(1.0, 4);
    // Two triangles opposite each other at a vertex.
    let around: Vec<usize> =
        (0..ball.triangles.len()).filter(|t| ball.triangles[*t].contains(&100)).collect();
    let far = around.iter().copied().find(|t| {
        let shared = ball.triangles[*t].iter().filter(|v| ball.triangles[around[0]].contains(v));
        shared.count() == 1
    });
    let cut = [around[0], far.unwrap()];
    let kept = (0..ball.triangles.len()).filter(|t| !cut.contains(t)).map(|t| ball.triangles[t]).collect();
    let result = filled(&TriMesh { triangles: kept, ..ball.clone() }, ALL);
    assert_eq!(result.counts.holes_filled, 2);
    assert!(topology(&result.mesh).is_closed_manifold());
    assert_eq!(result.mesh.triangles.len(), ball.triangles.len());
}

#[test]
fn chains_between_edges_of_three_triangles_are_left_and_closed_meshes_stay() {
    // Three pages that share a spine.
    let page = plane(4, 0.0);
    let pages = [0.0, 2.0, 4.0]
        .map(|angle: f64| moved(&page, |p| DVec3::new(p.x * angle.cos(), p.x * angle.sin(), p.y)));
    let book = union(&union(&pages[0], &pages[1]), &pages[2]);
    let result = filled(&book, ALL);
    assert_eq!((result.counts.holes_filled, result.counts.holes_unfilled), (0, 1));
    assert_eq!(result.mesh.triangles.len(), book.triangles.len());
    let closed = filled(&union(&sphere(1.0, 3), &sphere(0.5, 3)), ALL);
    assert_eq!(closed.counts, repair_with(&closed.mesh, &RepairOptions::default()).unwrap().counts);
}
