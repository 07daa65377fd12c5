//! Components inside closed ones.

use crate::support::shapes::{moved, plane, sphere, union};
use glam::DVec3;
use rtfmesh::mesh::repair::{RepairOptions, Repaired, repair_with};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Length, TriMesh};

fn outer(mesh: &TriMesh) -> Repaired {
    repair_with(mesh, &RepairOptions::default().outer(true)).unwrap()
}

fn turned(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

#[test]
fn shells_and_parts_inside_go_and_the_rest_stays_bit_by_bit() {
    let ball = sphere(1.0, 3);
    let cavity = turned(sphere(0.5, 2));
    let core = sphere(0.2, 1);
    // Boxes whose corners, edges and centres lie on lines of symmetry of one another.
    let [block, inner] = [2.0, 1.0].map(|size| {
        let mut mesh = sample("box").unwrap();
        mesh.vertices.iter_mut().for_each(|v| *v = (*v - DVec3::splat(0.5)) * size);
        mesh
    });
    let sheet = moved(&plane(2, 0.75), |p| p - DVec3::new(0.5, 0.5, 0.0));
    for (whole, inside, count) in [
        (&ball, union(&cavity, &core), 2),
        (&ball, moved(&core, |p| p + DVec3::X * 0.7), 1),
        (&block, inner, 1),
        (&block, sheet, 1),
        (&turned(ball.clone()), core.clone(), 1),
    ] {
        for mesh in [union(whole, &inside), union(&inside, whole)] {
            let result = outer(&mesh);
            assert_eq!(result.counts.hidden_components_removed, count);
            assert_eq!(result.mesh, *whole);
            assert!(result.origin.is_sorted_by(|a, b| a < b));
        }
    }
}

#[test]
fn what_touches_lies_beside_or_is_inside_an_open_surface_stays() {
    let ball = sphere(1.0, 3);
    let small = sphere(0.2, 1);
    let mut open = ball.clone();
    open.triangles.remove(7);
    for mesh in [
        union(&ball, &moved(&small, |p| p + DVec3::X * 1.1)),
        union(&ball, &moved(&small, |p| p + DVec3::X * 1.5)),
        union(&open, &small),
        union(&ball, &moved(&plane(2, 0.0), |p| p + DVec3::X * 0.5)),
        // In the hole of a ring: inside its box, but not inside it.
        union(&sample("torus").unwrap(), &small),
        ball.clone(),
    ] {
        let mesh = repair_with(&mesh, &RepairOptions::default()).unwrap().mesh;
        let result = outer(&mesh);
        assert_eq!((result.counts.hidden_components_removed, &result.mesh), (0, &mesh));
    }
}

#[test]
fn holes_are_filled_first() {
    let mut open = sphere(1.0, 3);
    open.triangles.remove(7);
    let options = RepairOptions::default().outer(true).fill_holes(Length::OfDiagonal(1.0));
    let result = repair_with(&union(&sphere(0.2, 1), &open), &options).unwrap();
    assert_eq!((result.counts.holes_filled, result.counts.hidden_components_removed), (1, 1));
    let found = topology(&result.mesh);
    assert!(found.is_closed_manifold() && found.components == 1, "{found:?}");
}
