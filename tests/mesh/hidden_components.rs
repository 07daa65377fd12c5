//! Components inside closed ones.

use crate::support::shapes::{cube, moved, plane, sphere, union};
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

/// The surface of a cube of voxels from `low` to `low + n` along all axes.
fn voxels(low: f64, n: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for (axis, side) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 0), (axis, n)]) {
        let first = mesh.vertices.len() as u32;
        for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
            let mut p = [f64::from(i), f64::from(j)].to_vec();
            p.insert(axis, f64::from(side));
            mesh.vertices.push(DVec3::from_slice(&p) + low);
        }
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let at = |i: u32, j: u32| first + i * (n + 1) + j;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    repair_with(&mesh, &RepairOptions::default()).unwrap().mesh
}

#[test]
fn rays_that_run_in_faces_and_through_edges_count_right() {
    let (block, ball) = (voxels(0.0, 8), moved(&sphere(0.5, 1), |p| p + 12.0));
    for side in 0..6 {
        let mut inner = voxels(3.0, 2);
        inner.triangles.rotate_left(8 * side);
        // Along a diagonal of the block, but outside.
        let beside = moved(&inner, |p| p + 7.0);
        let sheet = moved(&plane(2, 4.0), |p| DVec3::new(p.x + 5.5, p.z, p.y + 5.5));
        for (mesh, count) in [
            (union(&inner, &block), 1),
            (union(&sheet, &union(&inner, &block)), 2),
            (union(&union(&block, &beside), &ball), 0),
        ] {
            assert_eq!(outer(&mesh).counts.hidden_components_removed, count, "side {side}");
        }
    }
}

#[test]
fn one_of_many_nested_shells_is_left_and_all_of_a_row() {
    let shell = |k: u32| moved(&cube(), |p| (p - 0.5) * f64::from(k + 1));
    let nest = (0..200).map(shell).reduce(|all, one| union(&all, &one)).unwrap();
    let result = outer(&nest);
    assert_eq!(result.counts.hidden_components_removed, 199);
    assert_eq!(result.mesh.vertices, shell(199).vertices);
    let row = (0..200).map(|k| moved(&cube(), |p| p + DVec3::X * 2.0 * f64::from(k)));
    let row = row.reduce(|all, one| union(&all, &one)).unwrap();
    assert_eq!(outer(&row).counts.hidden_components_removed, 0);
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
