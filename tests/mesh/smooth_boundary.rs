//! Boundaries made smooth within a tolerance.

use crate::support::shapes::{moved, plane, sphere, union};
use glam::{DVec2, DVec3};
use rtfmesh::TriMesh;
use rtfmesh::mesh::repair::{RepairOptions, Repaired, repair, repair_with};
use rtfmesh::mesh::topology::topology;

fn smoothed(mesh: &TriMesh, tolerance: f64) -> Repaired {
    let diagonal = mesh.bounds().map(|[low, high]| (high - low).length()).unwrap();
    repair_with(mesh, &RepairOptions::default().smooth_boundary(tolerance / diagonal)).unwrap()
}

/// Same triangles, none folded, and no vertex farther from its place than the tolerance.
#[track_caller]
fn assert_moved_within(before: &TriMesh, after: &TriMesh, tolerance: f64) {
    assert_eq!(before.triangles, after.triangles);
    for (p, q) in before.vertices.iter().zip(&after.vertices) {
        assert!(p.distance(*q) <= tolerance + 1e-15, "{p} moved to {q}");
    }
    for t in 0..before.triangles.len() {
        let [old, new] = [before, after].map(|mesh| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(c - a)
        });
        assert!(old.dot(new) > 0.4 * old.length() * new.length() && new.length() > 0.09 * old.length());
    }
}

/// A square with 24 quads a side, where every other vertex of the side at x = 0 sticks out by `height`.
fn with_teeth(height: f64) -> TriMesh {
    let mut mesh = plane(24, 0.0);
    for p in mesh.vertices.iter_mut().filter(|p| p.x == 0.0) {
        p.x -= if (24.0 * p.y).round() % 2.0 == 1.0 { height } else { 0.0 };
    }
    mesh
}

/// An annulus of so many edges around, with radii 0.5 and 1.
fn annulus(around: u32) -> TriMesh {
    let rings = 8;
    let at = |i: u32, j: u32| j * around + i % around;
    let vertices = (0..=rings).flat_map(|j| {
        let radius = 0.5 + 0.5 * f64::from(j) / f64::from(rings);
        (0..around).map(move |i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(around);
            (radius * DVec2::from_angle(angle)).extend(0.0)
        })
    });
    let quads = (0..rings).flat_map(|j| (0..around).map(move |i| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices: vertices.collect(), triangles: triangles.collect() }
}

#[test]
fn teeth_shorter_than_the_tolerance_vanish() {
    let teeth = with_teeth(0.02);
    let Repaired { mesh, counts, .. } = smoothed(&teeth, 0.03);
    assert_moved_within(&teeth, &mesh, 0.03);
    assert!(counts.boundary_vertices_moved > 80, "{counts:?}");
    let side = |mesh: &TriMesh| -> Vec<f64> {
        let on_side = teeth.vertices.iter().zip(&mesh.vertices);
        on_side.filter(|(p, _)| p.x <= 0.0 && (p.y - 0.5).abs() < 0.3).map(|(_, q)| q.x).collect()
    };
    let spread = |x: &[f64]| {
        let [low, high] = [f64::min, f64::max].map(|of| x.iter().copied().reduce(of).unwrap());
        high - low
    };
    assert!(spread(&side(&teeth)) > 0.0199);
    assert!(spread(&side(&mesh)) < 0.001, "{:?}", side(&mesh));
}

#[test]
fn no_vertex_moves_farther_than_the_tolerance() {
    let teeth = with_teeth(0.02);
    for tolerance in [1e-5, 0.001, 0.005, 0.1, 0.4] {
        let mesh = smoothed(&teeth, tolerance).mesh;
        assert_moved_within(&teeth, &mesh, tolerance);
        assert_ne!(mesh, teeth, "{tolerance}");
    }
}

#[test]
fn circles_keep_their_size_and_vertices_inside_the_surface() {
    let ring = annulus(96);
    let mesh = smoothed(&ring, 0.05).mesh;
    for (p, q) in ring.vertices.iter().zip(&mesh.vertices) {
        let is_boundary = p.length() < 0.501 || p.length() > 0.999;
        assert!(!is_boundary || (p.length() - q.length()).abs() < 0.002, "{p} moved to {q}");
        assert!(q.z.abs() < 1e-12);
    }
}

#[test]
fn what_has_no_boundary_stays_to_the_bit() {
    let ball = sphere(1.0, 3);
    assert_eq!(smoothed(&ball, 0.3), repair(&ball).unwrap());
    let teeth = with_teeth(0.02);
    assert_eq!(smoothed(&teeth, 0.0), repair(&teeth).unwrap());
}

#[test]
fn the_smallest_meshes_and_boundaries_that_meet_are_no_problem() {
    let triangle = TriMesh { vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]] };
    // Two squares with a common corner.
    let square = plane(3, 0.0);
    let both = union(&square, &moved(&square, |p| p + DVec3::new(1.0, 1.0, 0.0)));
    let bow_tie = repair(&both).unwrap().mesh;
    assert_eq!(topology(&bow_tie).nonmanifold_vertices, 1);
    for mesh in [triangle, bow_tie.clone()] {
        for tolerance in [1e-9, 0.01, 0.5] {
            assert_moved_within(&mesh, &smoothed(&mesh, tolerance).mesh, tolerance);
        }
    }
    let at = bow_tie.vertices.iter().position(|p| *p == DVec3::new(1.0, 1.0, 0.0)).unwrap();
    assert_eq!(smoothed(&bow_tie, 0.2).mesh.vertices[at], bow_tie.vertices[at], "curves meet there");
}

#[test]
fn shares_out_of_range_are_refused() {
    for share in [-0.1, 1.0, f64::NAN] {
        let error = repair_with(&plane(2, 0.0), &RepairOptions::default().smooth_boundary(share));
        assert!(error.unwrap_err().to_string().contains("`smooth_boundary`"));
    }
}
