//! Simplification by edge collapses: exact counts, and unchanged topology at any count.

use crate::support::shapes::{cube, moved, plane, sphere, torus, union};
use glam::DVec3;
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::simplify::{Preserved, with_vertices};
use rtfmesh::mesh::topology::{Topology, topology};
use rtfmesh::{ProgressToken, TriMesh};

fn figures(t: &Topology) -> [i64; 6] {
    let junctions = i64::from(t.nonmanifold_edges > 0);
    let counts = [t.components, t.boundary_loops, t.nonmanifold_vertices, t.duplicate_faces];
    let [a, b, c, d] = counts.map(|count| count as i64);
    [t.euler, a, b, c, d, junctions]
}

fn pages() -> TriMesh {
    let page = |angle: f64| moved(&plane(6, 0.0), |v| DVec3::new(v.x * angle.cos(), v.y, v.x * angle.sin()));
    repair(&union(&union(&page(0.0), &page(2.0)), &page(4.0))).unwrap().mesh
}

#[test]
fn the_topology_stays_down_to_the_least_count() {
    let touching = repair(&union(&cube(), &moved(&cube(), |v| v + DVec3::ONE))).unwrap().mesh;
    let models = [
        (sphere(1.0, 3), 4),
        (torus(20, 10), 10),
        (sample("genus3").unwrap(), 40),
        (plane(8, 0.0), 3),
        (pages(), 5),
        (touching, 7),
        (sample("open-hemisphere").unwrap(), 3),
    ];
    for (k, (mesh, least)) in models.iter().enumerate() {
        let want = topology(mesh);
        for count in [0, 30, 60, want.vertices - 1, want.vertices, want.vertices + 1, 3 * want.vertices] {
            let made = with_vertices(mesh, Preserved::default(), count, &ProgressToken::default()).unwrap();
            let got = topology(&made.mesh);
            assert_eq!(figures(&got), figures(&want), "model {k} with {count}");
            assert_eq!(made.mesh.vertices.len(), got.vertices, "model {k} with {count}");
            assert_eq!((made.origin.len(), made.fixed.len()), (got.faces, got.vertices));
            assert!(
                got.vertices == count || (count < 60 && got.vertices <= *least),
                "model {k} with {count}: {got:?}"
            );
        }
    }
}

#[test]
fn curves_and_corners_stay() {
    let mesh = sample("box").unwrap();
    let [low, high] = mesh.bounds().unwrap();
    // On two or more of the box's sides.
    let sides = |v: DVec3| (v.cmpeq(low) | v.cmpeq(high)).bitmask().count_ones();
    let at = |v: u32| mesh.vertices[v as usize];
    let is_edge = |a: u32, b: u32| sides(at(a)) > 1 && sides(at(b)) > 1 && sides(0.5 * (at(a) + at(b))) > 1;
    let halves = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let curves: Vec<bool> = halves.map(|[a, b]| is_edge(a, b)).collect();
    let corners: Vec<u32> = (0..mesh.vertices.len() as u32).filter(|v| sides(at(*v)) == 3).collect();
    for count in [8, 9, 20, 100] {
        let made = with_vertices(
            &mesh,
            Preserved { curves: &curves, corners: &corners, ..Default::default() },
            count,
            &ProgressToken::default(),
        )
        .unwrap()
        .mesh;
        assert_eq!(made.vertices.len(), count);
        let volume: f64 = (0..made.triangles.len())
            .map(|t| {
                let [a, b, c] = made.corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let size = high - low;
        assert!((volume / (size.x * size.y * size.z) - 1.0).abs() < 1e-9, "{count}: {volume}");
    }
}
