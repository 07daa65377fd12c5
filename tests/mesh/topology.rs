//! Topology counts of meshes small enough to count by hand.

use rtfmesh::TriMesh;
use rtfmesh::mesh::topology::{Topology, topology};

use crate::support::shapes::{cube, mesh, moved, plane, tetrahedron, torus, union};

fn closed(vertices: usize, edges: usize, faces: usize, euler: i64, genus: i64) -> Topology {
    Topology {
        vertices,
        edges,
        faces,
        components: 1,
        euler,
        genus: Some(genus),
        boundary_edges: 0,
        boundary_loops: 0,
        nonmanifold_edges: 0,
        nonmanifold_vertices: 0,
        inconsistent_edges: 0,
        duplicate_faces: 0,
    }
}

fn with_faces(mut mesh: TriMesh, more: &[[u32; 3]]) -> TriMesh {
    mesh.triangles.extend(more);
    mesh
}

#[test]
fn closed_surfaces() {
    for (mesh, expected) in [
        (tetrahedron(), closed(4, 6, 4, 2, 0)),
        (cube(), closed(8, 18, 12, 2, 0)),
        (torus(7, 5), closed(35, 105, 70, 0, 1)),
    ] {
        assert_eq!(topology(&mesh), expected);
        assert!(topology(&mesh).is_closed_manifold());
    }
}

#[test]
fn components_add_up() {
    let found = topology(&union(&union(&torus(7, 5), &torus(4, 3)), &cube()));
    assert_eq!((found.components, found.euler, found.genus), (3, 2, Some(2)));
    assert!(found.is_closed_manifold());
}

#[test]
fn open_disc() {
    let found = topology(&plane(3, 0.0));
    let expected = Topology { boundary_edges: 12, boundary_loops: 1, ..closed(16, 33, 18, 1, 0) };
    assert_eq!(found, expected);
    assert!(!found.is_closed_manifold());
}

#[test]
fn ring_with_two_boundaries() {
    let mut ring = plane(3, 0.0);
    ring.triangles.drain(8..10);
    let found = topology(&ring);
    assert_eq!((found.boundary_edges, found.boundary_loops), (16, 2));
    assert_eq!((found.euler, found.genus), (0, Some(0)));
}

#[test]
fn handle_with_a_hole() {
    let mut open = torus(7, 5);
    open.triangles.pop();
    let found = topology(&open);
    assert_eq!((found.boundary_edges, found.boundary_loops, found.genus), (3, 1, Some(1)));
}

#[test]
fn bow_tie_vertex() {
    let mut two = union(&tetrahedron(), &moved(&tetrahedron(), |v| v + 2.0));
    two.triangles.iter_mut().flatten().filter(|v| **v == 7).for_each(|v| *v = 0);
    let found = topology(&two);
    assert_eq!((found.vertices, found.components, found.euler), (7, 1, 3));
    assert_eq!((found.nonmanifold_vertices, found.nonmanifold_edges), (1, 0));
    assert_eq!(found.genus, None);
    assert!(!found.is_closed_manifold());
}

#[test]
fn bow_tie_of_open_fans_has_one_loop_component() {
    let found = topology(&mesh(&[[0.0; 3]; 5], &[[0, 1, 2], [0, 3, 4]]));
    assert_eq!((found.boundary_edges, found.boundary_loops), (6, 1));
    assert_eq!((found.nonmanifold_vertices, found.components), (1, 1));
}

#[test]
fn three_faces_on_an_edge() {
    let found = topology(&mesh(&[[0.0; 3]; 5], &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]));
    assert_eq!((found.edges, found.boundary_edges, found.nonmanifold_edges), (7, 6, 1));
    assert_eq!((found.inconsistent_edges, found.nonmanifold_vertices), (1, 0));
    assert_eq!(found.genus, None);
}

#[test]
fn four_faces_on_an_edge_turn_both_ways() {
    let found = topology(&mesh(&[[0.0; 3]; 6], &[[0, 1, 2], [1, 0, 3], [0, 1, 4], [1, 0, 5]]));
    assert_eq!((found.nonmanifold_edges, found.inconsistent_edges), (1, 2));
}

#[test]
fn flipped_face() {
    let mut flipped = cube();
    flipped.triangles[5].swap(0, 1);
    let found = topology(&flipped);
    assert_eq!((found.inconsistent_edges, found.boundary_edges, found.nonmanifold_edges), (3, 0, 0));
    assert_eq!((found.euler, found.genus), (2, None));
    assert!(!found.is_closed_manifold());
}

#[test]
fn duplicate_faces_count_beyond_the_first() {
    let found = topology(&with_faces(cube(), &[[2, 3, 0], [3, 2, 0]]));
    assert_eq!(found.duplicate_faces, 2);
    assert_eq!((found.nonmanifold_edges, found.edges, found.faces), (3, 18, 14));
    assert_eq!(found.inconsistent_edges, 6);
}

#[test]
fn unused_vertices_do_not_count() {
    let mut padded = tetrahedron();
    padded.vertices.insert(2, glam::DVec3::ZERO);
    padded.triangles.iter_mut().flatten().filter(|v| **v >= 2).for_each(|v| *v += 1);
    assert_eq!(topology(&padded), closed(4, 6, 4, 2, 0));
}

#[test]
fn repeated_vertices_make_an_edge_to_itself() {
    let found = topology(&mesh(&[[0.0; 3]; 2], &[[0, 0, 1]]));
    assert_eq!((found.vertices, found.edges, found.boundary_edges), (2, 2, 1));
    assert_eq!((found.nonmanifold_vertices, found.inconsistent_edges), (0, 0));
    let found = topology(&mesh(&[[0.0; 3]], &[[0, 0, 0]]));
    assert_eq!((found.vertices, found.edges, found.components), (1, 1, 1));
    assert_eq!((found.nonmanifold_edges, found.nonmanifold_vertices, found.inconsistent_edges), (1, 1, 1));
}

#[test]
fn nothing_and_a_single_triangle() {
    let nothing = topology(&TriMesh::default());
    assert_eq!((nothing.faces, nothing.edges, nothing.components, nothing.euler), (0, 0, 0, 0));
    assert!(!nothing.is_closed_manifold());
    let single = topology(&mesh(&[[0.0; 3]; 3], &[[0, 1, 2]]));
    assert_eq!((single.boundary_edges, single.boundary_loops, single.genus), (3, 1, Some(0)));
}
