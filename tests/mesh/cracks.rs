//! Cracks: closed if no wider than rounding, else found; clean boundaries are none.

use crate::support::shapes::{moved, plane, sphere, union};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rtfmesh::TriMesh;
use rtfmesh::mesh::repair::{RepairCounts, RepairOptions, cracks, repair, repair_with};
use rtfmesh::mesh::samples::{names, sample};
use rtfmesh::mesh::topology::topology;

/// Every triangle with corners of its own, their coordinates off by up to this share.
fn soup(mesh: &TriMesh, jitter: f64) -> TriMesh {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let mut off = |x: f64| x * (1.0 + rng.random_range(-jitter..=jitter));
    let corners = mesh.triangles.as_flattened().iter().map(|v| mesh.vertices[*v as usize]);
    let vertices = corners.map(|p| DVec3::from_array(p.to_array().map(&mut off))).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriMesh { vertices, triangles }
}

#[test]
fn corners_that_differ_by_rounding_are_one() {
    for name in ["torus", "sphere", "genus3", "box", "thin-plate", "open-hemisphere", "two-components"] {
        let clean = sample(name).unwrap();
        for (jitter, far, size) in [(1e-16, 0.0, 1.0), (1e-7, 0.0, 1.0), (1e-7, 5.0, 1.0), (1e-7, 0.0, 1e80)]
        {
            let placed = moved(&clean, |v| size * (v + far));
            let broken = soup(&placed, jitter);
            let repaired = repair(&broken).unwrap();
            assert_eq!(topology(&repaired.mesh), topology(&placed), "{name} {jitter:e} {far} {size:e}");
            let counts = repaired.counts;
            let welded = counts.crack_vertices_welded + counts.duplicate_vertices_welded;
            assert_eq!(broken.vertices.len() - welded, clean.vertices.len(), "{name}");
            let expected = RepairCounts::default().notes();
            assert_eq!(counts.notes() != expected, counts.crack_vertices_welded > 0);
            // Attributes find the same edges.
            let at_places = repaired.at_welded_places(&broken);
            let again = repair(at_places.as_ref().unwrap_or(&broken)).unwrap();
            assert_eq!((again.counts.crack_vertices_welded, again.mesh), (0, repaired.mesh), "{name}");
        }
    }
}

#[test]
fn vertices_on_edges_are_joined_where_rounding_is_more_than_the_mesh() {
    let far = |mesh: &TriMesh, y: f64| moved(mesh, |v| v + DVec3::new(450_000.0, y, 0.0));
    let both = union(&far(&plane(1, 0.0), 5_400_000.0), &far(&plane(2, 0.0), 5_400_001.0));
    let repaired = repair(&both).unwrap();
    assert_eq!(repaired.counts.edges_joined, 1);
    let got = topology(&repaired.mesh);
    assert_eq!((got.components, got.boundary_loops, got.vertices), (1, 1, 11));
}

#[test]
fn what_rounding_does_not_explain_stays() {
    let jittered = repair(&soup(&sphere(1.0, 2), 1e-4)).unwrap();
    assert_eq!(topology(&jittered.mesh).components, sphere(1.0, 2).triangles.len());
    // Two corners that touch but for rounding share no edge.
    let corner = |x: f64, side: f64| {
        let vertices = [[x, 0.0, 0.0], [x + side, 0.5, 0.0], [x + side, -0.5, 0.0]];
        TriMesh { vertices: vertices.map(DVec3::from_array).to_vec(), triangles: vec![[0, 1, 2]] }
    };
    let touching = union(&corner(1.0, 1.0), &corner(1.0 - 1e-9, -1.0));
    let repaired = repair(&touching).unwrap();
    assert_eq!((repaired.counts.crack_vertices_welded, repaired.mesh.vertices.len()), (0, 6));
    // The third sheet at an edge would be one too many.
    let sheet = |z: f64| moved(&plane(1, 0.0), |v| DVec3::new(v.x, v.y * z.cos(), v.y * z.sin() + 1e-9 * z));
    let three = union(&union(&sheet(0.0), &sheet(1.0)), &sheet(2.0));
    let got = topology(&repair(&three).unwrap().mesh);
    assert_eq!((got.nonmanifold_edges, got.components), (0, 3));
    // So far from the origin that rounding is no small share of the edges.
    let tiny = moved(&soup(&sphere(1e-4, 1), 0.1), |v| v + 100.0);
    assert_eq!(repair(&tiny).unwrap().counts.crack_vertices_welded, 0);
}

/// A coarse and a fine strip side by side, with the middle vertices of the fine one this far off the edge.
fn strips(off: f64) -> TriMesh {
    let fine = moved(&plane(6, 0.0), |v| {
        let bend = if v.x == 0.0 && v.y > 0.1 && v.y < 0.9 { off } else { 0.0 };
        DVec3::new(1.0 + v.x + bend, v.y, 0.0)
    });
    union(&plane(2, 0.0), &fine)
}

#[test]
fn vertices_on_edges_but_for_rounding_are_joined_to_them() {
    for (off, joined) in [(0.0, 4), (1e-9, 4), (-1e-7, 4), (1e-5, 0)] {
        let repaired = repair(&strips(off)).unwrap();
        let got = topology(&repaired.mesh);
        assert_eq!((repaired.counts.edges_joined, got.nonmanifold_edges), (joined, 0), "{off:e}");
        assert_eq!(got.boundary_edges, if joined > 0 { 24 } else { 32 }, "{off:e}");
    }
}

#[test]
fn small_parts_far_from_the_origin_are_joined_within_a_share_of_their_own_edges() {
    let far = |off: f64| repair(&moved(&strips(off), |v| 1e-4 * v + 100.0)).unwrap().counts.edges_joined;
    assert_eq!((far(0.0), far(0.01)), (4, 0));
}

#[test]
fn wider_cracks_are_found_with_what_closes_them() {
    let want = topology(&sphere(1.0, 2));
    for jitter in [6e-6, 1e-5, 4e-5] {
        let broken = repair(&soup(&sphere(1.0, 2), jitter)).unwrap().mesh;
        let found = cracks(&broken).unwrap();
        let closed = repair_with(&broken, &RepairOptions::default().weld(found.weld)).unwrap();
        assert_eq!(topology(&closed.mesh), want, "{jitter:e}: {found:?}");
        assert!(found.edges > 100 && found.weld < 10.0 * jitter, "{jitter:e}: {found:?}");
    }
    let found = cracks(&strips(1e-4)).unwrap();
    let closed = repair_with(&strips(1e-4), &RepairOptions::default().weld(found.weld)).unwrap();
    assert_eq!((closed.counts.edges_joined, cracks(&closed.mesh)), (4, None), "{found:?}");
    // As it is written.
    assert!(format!("{:e}", found.weld).len() <= 5, "{:e}", found.weld);
}

#[test]
fn clean_boundaries_are_no_cracks() {
    for (name, _) in names() {
        assert_eq!(cracks(&sample(name).unwrap()), None, "{name}");
    }
    // Sheets, and a ribbon, closer than cracks are wide.
    let sheets = union(&plane(2, 0.0), &moved(&plane(2, 1e-4), |v| v));
    let ribbon = moved(&plane(4, 0.0), |v| DVec3::new(v.x, 1e-4 * v.y, 0.0));
    let wide = moved(&plane(1, 0.0), |v| DVec3::new(v.x, 1e-4 * v.y, 0.0));
    for mesh in [sheets, ribbon, wide] {
        assert_eq!(cracks(&mesh), None);
    }
}
