//! The rotation system built from hand-made fans.

use glam::{DVec3, Vec2};
use rtfmesh::TriMesh;
use rtfmesh::mesh::topology::topology;
use rtfmesh::sites::connect::connect;
use rtfmesh::sites::fans::{Fans, clustered_fan};

fn points(list: &[[f64; 3]]) -> Vec<DVec3> {
    list.iter().map(|p| DVec3::from_array(*p)).collect()
}

fn octahedron() -> (Vec<DVec3>, Vec<Vec<u32>>) {
    let sites = points(&[
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ]);
    let fans = vec![
        vec![2, 4, 3, 5],
        vec![2, 5, 3, 4],
        vec![0, 5, 1, 4],
        vec![0, 4, 1, 5],
        vec![0, 2, 1, 3],
        vec![0, 3, 1, 2],
    ];
    (sites, fans)
}

#[test]
fn agreeing_fans_make_a_closed_outward_surface() {
    let (sites, fans) = octahedron();
    let (triangles, counts) = connect(&sites, &Fans::from_lists(&fans));
    assert_eq!(counts, Default::default());
    assert_eq!(triangles.len(), 8);
    for t in &triangles {
        let [a, b, c] = t.map(|v| sites[v as usize]);
        assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{t:?} points inwards");
    }
    let t = topology(&TriMesh { vertices: sites, triangles });
    assert!(t.is_closed_manifold());
    assert_eq!(t.euler, 2);
}

#[test]
fn one_sided_and_foreign_entries_are_dropped() {
    let (sites, mut fans) = octahedron();
    fans[0].insert(1, 1);
    fans[3].push(u32::MAX);
    fans[5].push(5);
    let (triangles, counts) = connect(&sites, &Fans::from_lists(&fans));
    assert_eq!((counts.one_sided_edges, triangles.len()), (3, 8));
}

#[test]
fn four_cocircular_sites_are_split_by_the_better_diagonal() {
    // A pyramid whose base is a rhombus: four faces around the tip and one of four corners below.
    let sites =
        points(&[[1.0, 0.0, 0.0], [0.0, 0.6, 0.0], [-1.0, 0.0, 0.0], [0.0, -0.6, 0.0], [0.0, 0.0, 1.0]]);
    let fans =
        Fans::from_lists([vec![1, 4, 3], vec![0, 2, 4], vec![1, 3, 4], vec![0, 4, 2], vec![0, 1, 2, 3]]);
    let (triangles, counts) = connect(&sites, &fans);
    assert_eq!((counts.split_faces, counts.unfilled_faces, triangles.len()), (1, 0, 6));
    let has = |a: u32, b: u32| triangles.iter().filter(|t| t.contains(&a) && t.contains(&b)).count();
    assert_eq!((has(1, 3), has(0, 2)), (2, 0), "the short diagonal of the rhombus");
    assert!(topology(&TriMesh { vertices: sites, triangles }).is_closed_manifold());
}

#[test]
fn short_edges_belong_to_a_cluster() {
    let corners =
        [(1.0, 0.0), (0.0, 1.0), (-0.05, 0.97), (-1.0, 0.0), (0.0, -1.0)].map(|(x, y)| Vec2::new(x, y));
    assert_eq!(clustered_fan(&corners, &[10, 11, 12, 13, 14]), [10, 11, 13, 14]);
    assert!(clustered_fan(&[], &[]).is_empty());
}

#[test]
fn a_face_is_never_split_along_an_edge_that_exists() {
    // A tetrahedron with one edge missing from the fans: both faces beside it merge into one of four corners
    // whose other diagonal is an edge already.
    let sites = points(&[[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]);
    let fans = Fans::from_lists([vec![2, 3], vec![2, 3], vec![0, 1, 3], vec![0, 2, 1]]);
    let (triangles, counts) = connect(&sites, &fans);
    let t = topology(&TriMesh { vertices: sites, triangles: triangles.clone() });
    assert_eq!(t.nonmanifold_edges, 0);
    assert_eq!(counts.unconnected_sites, 0);
    assert_eq!(t.duplicate_faces, 0, "{triangles:?}");
}

#[test]
fn nothing_and_lonely_sites_are_counted() {
    assert_eq!(connect(&[], &Fans::default()).0.len(), 0);
    let sites = points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let (triangles, counts) = connect(&sites, &Fans::from_lists([vec![1], vec![0], vec![]]));
    assert_eq!((triangles.len(), counts.unconnected_sites), (0, 3));
}
