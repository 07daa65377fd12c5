//! Bisecting long edges: same surface, same topology, and no edge longer than asked.

use crate::support::shapes::{cube, moved, plane, torus, union};
use glam::DVec3;
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::subdivide::{halve_long_edges, halved_count};
use rtfmesh::mesh::topology::topology;
use rtfmesh::{ProgressToken, TriMesh};

const MOST: usize = usize::MAX;

fn longest(mesh: &TriMesh) -> f64 {
    let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let long = |[a, b]: [u32; 2]| mesh.vertices[a as usize].distance(mesh.vertices[b as usize]);
    mesh.triangles.iter().flat_map(sides).map(long).fold(0.0, f64::max)
}

/// Three pages along one edge.
fn pages() -> TriMesh {
    let page = |angle: f64| moved(&plane(3, 0.0), |v| DVec3::new(v.x * angle.cos(), v.y, v.x * angle.sin()));
    repair(&union(&union(&page(0.0), &page(2.0)), &page(4.0))).unwrap().mesh
}

#[test]
fn surfaces_stay_what_they_are() {
    let needles = moved(&torus(40, 3), |v| DVec3::new(v.x, v.y, 50.0 * v.z));
    for (name, mesh) in [
        ("cube", cube()),
        ("needles", needles),
        ("pages", pages()),
        ("open", sample("open-hemisphere").unwrap()),
        ("genus3", sample("genus3").unwrap()),
    ] {
        let was = topology(&mesh);
        for share in [0.9, 0.5, 0.3, 0.07] {
            let length = share * longest(&mesh);
            let made = halve_long_edges(&mesh, length, MOST, &ProgressToken::default()).unwrap().unwrap();
            assert!(longest(&made) <= length, "{name} {share}: an edge of {}", longest(&made));
            assert_eq!(made.vertices[..mesh.vertices.len()], mesh.vertices, "{name} {share}");
            let about = halved_count(&mesh, length) / made.triangles.len() as f64;
            assert!((0.4..2.5).contains(&about), "{name} {share}: {about} of them");
            let area = mesh.area();
            assert!((made.area() - area).abs() < 1e-12 * area, "{name} {share}");
            let is = topology(&made);
            let figures = |t: &rtfmesh::mesh::topology::Topology| {
                [
                    t.components,
                    t.boundary_loops,
                    t.nonmanifold_vertices,
                    t.duplicate_faces,
                    usize::from(t.inconsistent_edges > 0),
                ]
            };
            assert_eq!((is.euler, figures(&is)), (was.euler, figures(&was)), "{name} {share}");
        }
    }
}

#[test]
fn triangles_face_the_same_way_and_lie_in_their_own() {
    let mesh = cube();
    let made = halve_long_edges(&mesh, 0.3, MOST, &ProgressToken::default()).unwrap().unwrap();
    let volume = |mesh: &TriMesh| -> f64 {
        (0..mesh.triangles.len()).map(|t| mesh.corners(t)).map(|[a, b, c]| a.cross(b).dot(c) / 6.0).sum()
    };
    assert!((volume(&made) - volume(&mesh)).abs() < 1e-12);
    for t in 0..made.triangles.len() {
        let [a, b, c] = made.corners(t);
        let normal = (b - a).cross(c - a);
        assert!(normal.abs().max_element() > 0.999_999 * normal.length(), "triangle {t} lies across an edge");
    }
}

#[test]
fn nothing_to_do_gives_nothing() {
    assert_eq!(halve_long_edges(&TriMesh::default(), 1.0, MOST, &ProgressToken::default()).unwrap(), None);
    let mesh = cube();
    assert_eq!(
        halve_long_edges(&mesh, longest(&mesh), MOST, &ProgressToken::default()).unwrap(),
        None,
        "no edge is longer than the longest"
    );
    assert_eq!(
        halve_long_edges(&mesh, 0.1, mesh.triangles.len(), &ProgressToken::default()).unwrap(),
        None,
        "no room for more"
    );
}

#[test]
fn the_longest_go_first_up_to_the_limit() {
    let mesh = torus(40, 3);
    let whole = longest(&mesh);
    let mut last = f64::INFINITY;
    for most in [240, 1_000, 4_000, 16_000] {
        let made = halve_long_edges(&mesh, whole / 1e9, most, &ProgressToken::default()).unwrap();
        let made = made.as_ref().unwrap_or(&mesh);
        assert!(made.triangles.len() <= most && longest(made) <= last, "{most}: {}", longest(made));
        last = longest(made);
    }
    assert!(last < 0.2 * whole, "{last} of {whole}");
}

#[test]
fn edges_without_a_middle_stay() {
    // Numbers there are 2 apart.
    let far = moved(&cube(), |v| 16.0 * v + DVec3::splat(1e16));
    assert!(longest(&far) > 16.0);
    let made = halve_long_edges(&far, 1e-3, MOST, &ProgressToken::default()).unwrap().unwrap();
    assert!(longest(&made) < 4.0, "{}", longest(&made));
    assert!(made.triangles.len() < 2_000, "{}", made.triangles.len());
}
