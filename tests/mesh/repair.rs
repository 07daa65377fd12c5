//! Repair and the unit frame: what is dropped and why, at every scale and position that f64 can hold.

use glam::DVec3;
use rtfmesh::mesh::repair::{RepairCounts, repair};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::{Error, TriMesh};

fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriMesh {
    let vertices = vertices.iter().copied().map(DVec3::from_array).collect();
    TriMesh { vertices, triangles: triangles.to_vec() }
}

fn input_error(error: Error) -> (String, String) {
    match error {
        Error::Input { place, problem, .. } => (place.unwrap_or_default(), problem),
        other => panic!("not an input error: {other:?}"),
    }
}

#[test]
fn clean_meshes_stay_as_they_are() {
    for name in ["torus", "genus3", "open-hemisphere", "thin-plate"] {
        let clean = sample(name).unwrap();
        let repaired = repair(&clean).unwrap();
        assert_eq!(repaired.mesh, clean, "{name}");
        assert_eq!(repaired.counts, RepairCounts::default(), "{name}");
    }
}

#[test]
fn each_fault_is_counted_and_the_order_kept() {
    let vertices = [
        [9.0, 9.0, 9.0], // unused
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-0.0, 0.0, -0.0], // 1 again
        [0.0, 0.0, 1.0],
        [2.0, 0.0, 0.0], // used by a flat face only
    ];
    let triangles = [
        [3, 4, 2], // kept
        [1, 2, 6], // three points on a line
        [1, 4, 3], // one point twice after welding
        [1, 3, 5], // kept
        [2, 3, 1], // the first again
        [1, 3, 2], // and again, turned over
        [5, 5, 5], // one point
        [2, 5, 4], // kept
    ];
    let repaired = repair(&mesh(&vertices, &triangles)).unwrap();
    let expected =
        mesh(&[vertices[1], vertices[2], vertices[3], vertices[5]], &[[2, 0, 1], [0, 2, 3], [1, 0, 3]]);
    assert_eq!(repaired.mesh, expected);
    let counts = &repaired.counts;
    assert_eq!(counts.duplicate_vertices_welded, 1);
    assert_eq!(counts.unreferenced_vertices_removed, 2);
    assert_eq!(counts.degenerate_faces_removed, 3);
    assert_eq!((counts.duplicate_faces_removed, counts.opposite_faces_merged), (1, 1));
    // The last disagrees with both others.
    assert_eq!(counts.faces_turned, 1);
    let others = [counts.near_vertices_welded, counts.edges_joined, counts.components_removed];
    assert_eq!((others, counts.unorientable_components), ([0; 3], 0));
    let json = serde_json::to_value(repaired.counts).unwrap();
    assert_eq!(json["unreferenced_vertices_removed"], 2);
}

#[test]
fn flatness_does_not_depend_on_size_or_place() {
    let thin = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1e-9, 0.0], [0.25, 0.0, 0.0]];
    for scale in [1e-320, 1e-300, 1e-30, 1.0, 1e30, 1e300, 1.7e308] {
        let mut vertices = thin.map(|position| position.map(|value| value * scale));
        if scale < 1e-307 {
            // There are no finer steps down here.
            vertices[2][1] = 5e-324;
        }
        let repaired = repair(&mesh(&vertices, &[[0, 1, 2], [0, 1, 3]])).unwrap();
        assert_eq!(repaired.mesh.triangles, [[0, 1, 2]], "{scale:e}");
        assert_eq!(repaired.counts.degenerate_faces_removed, 1, "{scale:e}");
    }
    // Across the whole range, where differences overflow.
    let wide = [[-1.7e308, 0.0, 0.0], [1.7e308, 0.0, 0.0], [0.0, 1.7e308, 0.0], [5.0, 0.0, 0.0]];
    let repaired = repair(&mesh(&wide, &[[0, 1, 2], [0, 1, 3]])).unwrap();
    assert_eq!(repaired.mesh.triangles, [[0, 1, 2]]);
    // A unit triangle, tiny against its distance from the origin, with a stray vertex far beyond.
    let far = [[1e15, 1e15, 0.0], [1e15 + 1.0, 1e15, 0.0], [1e15, 1e15 + 1.0, 0.0], [1e300, 0.0, 0.0]];
    let repaired = repair(&mesh(&far, &[[0, 1, 2]])).unwrap();
    assert_eq!(repaired.mesh, mesh(&far[..3], &[[0, 1, 2]]));
}

#[test]
fn slivers_are_kept_down_to_rounding() {
    let with_height = |height: f64| {
        let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, height, 0.0], [0.0, 0.0, 1.0]];
        repair(&mesh(&vertices, &[[0, 1, 2], [0, 1, 3]])).unwrap().mesh.triangles.len()
    };
    assert_eq!(with_height(1e-13), 2);
    assert_eq!(with_height(1e-15), 1);
}

#[test]
fn unusable_meshes_are_refused() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let refused = |vertices: &[[f64; 3]], triangles: &[[u32; 3]]| {
        input_error(repair(&mesh(vertices, triangles)).unwrap_err())
    };
    let (place, problem) = refused(&corners, &[[0, 1, 2], [0, 1, 3]]);
    assert_eq!((place.as_str(), problem.as_str()), ("face 1", "there is no vertex 3, the mesh has 3"));
    let (place, _) = refused(&[[0.0; 3], [0.0, f64::NAN, 0.0]], &[]);
    assert_eq!(place, "vertex 1");
    let (place, _) = refused(&[[f64::INFINITY, 0.0, 0.0]], &[]);
    assert_eq!(place, "vertex 0");
    for triangles in [&[][..], &[[0, 1, 2]], &[[0, 0, 1]]] {
        assert_eq!(refused(&corners, triangles).1, "the mesh has no faces with an area");
    }
    assert_eq!(refused(&[], &[]).1, "the mesh has no faces with an area");
}

#[test]
fn frames_map_to_the_unit_box_and_back() {
    for scale in [1e-310, 1e-300, 1e-30, 1.0, 1e30, 1e300, 2e307] {
        for offset in [0.0, 1e3] {
            let place = |p: [f64; 3]| {
                (DVec3::from_array(p) + DVec3::splat(offset) * (scale < 1e300) as u8 as f64) * scale
            };
            let corners = [[-1.0, -2.0, -2.0], [1.0, 2.0, 2.0], [0.0, 0.5, 0.0]].map(place);
            let mesh = TriMesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] };
            let frame = UnitFrame::of(&mesh).unwrap();
            // The box is 2 x 4 x 4, so its diagonal is 6.
            assert!((frame.scale / scale - 6.0).abs() < 1e-9, "{scale:e}: {frame:?}");
            let unit = corners.map(|corner| frame.to_unit(corner));
            assert!((unit[0].distance(unit[1]) - 1.0).abs() < 1e-9, "{scale:e}: {unit:?}");
            assert!(
                (unit[0] + unit[1]).length() < 1e-9 && unit[2].distance(DVec3::Y / 12.0) < 1e-9,
                "{unit:?}"
            );
            for (corner, unit) in corners.iter().zip(unit) {
                let error = (frame.to_input_units(unit) / scale - *corner / scale).length();
                assert!(error < 1e-9, "{scale:e}: {error:e}");
            }
        }
    }
}

#[test]
fn frames_without_a_size_are_refused() {
    let problem = |vertices: &[[f64; 3]]| input_error(UnitFrame::of(&mesh(vertices, &[])).unwrap_err()).1;
    assert_eq!(problem(&[]), "the mesh has no vertices");
    assert_eq!(problem(&[[1.0; 3], [1.0; 3]]), "all vertices are at one point");
    assert_eq!(problem(&[[0.0; 3], [f64::NAN, 0.0, 0.0]]), "a coordinate is not finite");
    assert_eq!(problem(&[[-1.7e308; 3], [1.7e308; 3]]), "the coordinates are too large for 64-bit numbers");
}

fn six_volumes(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            a.dot(b.cross(c))
        })
        .sum()
}

#[test]
fn a_closed_body_with_half_of_its_faces_turned_over_faces_outwards() {
    let cube = sample("box").unwrap();
    for turned in [[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11], [1, 3, 5, 7, 9, 11], [0, 2, 4, 6, 8, 10]] {
        let mut mesh = cube.clone();
        turned.iter().for_each(|t| mesh.triangles[*t].swap(1, 2));
        let repaired = repair(&mesh).unwrap();
        assert_eq!(repaired.counts.faces_turned, 6);
        assert!((six_volumes(&repaired.mesh) - 6.0).abs() < 1e-12, "{turned:?}");
    }
}

#[test]
fn a_closed_body_faces_outwards_even_if_most_of_its_faces_do_not_but_a_cavity_inwards() {
    let mut body = sample("box").unwrap();
    (0..9).for_each(|t| body.triangles[t].swap(1, 2));
    assert!((six_volumes(&repair(&body).unwrap().mesh) - 6.0).abs() < 1e-12);
    // The same in a larger body.
    let mut outer = sample("box").unwrap();
    outer.vertices.iter_mut().for_each(|v| *v = 3.0 * *v - DVec3::ONE);
    outer.triangles.extend(body.triangles.iter().map(|t| t.map(|v| v + outer.vertices.len() as u32)));
    outer.vertices.extend(&body.vertices);
    assert!((six_volumes(&repair(&outer).unwrap().mesh) - 6.0 * 26.0).abs() < 1e-9);
}

#[test]
fn a_cavity_with_one_face_turned_over_stays_one() {
    let mut cavity = sample("sphere").unwrap();
    cavity.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let volume = six_volumes(&cavity);
    cavity.triangles[7].swap(1, 2);
    let repaired = repair(&cavity).unwrap();
    assert_eq!(repaired.counts.faces_turned, 1);
    assert!((six_volumes(&repaired.mesh) - volume).abs() < 1e-12 && volume < 0.0);
}

#[test]
fn a_flat_face_that_holds_its_neighbours_together_leaves_no_slit() {
    // A tetrahedron with a vertex in the middle of an edge, on one side only; a flat face closes the gap.
    let vertices = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]];
    let triangles = [[0, 2, 4], [4, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 4, 1]];
    let closed = mesh(&vertices, &triangles);
    assert!(topology(&closed).is_closed_manifold());
    for scale in [1.0, 1e-30, 1e30] {
        let mut scaled = closed.clone();
        scaled.vertices.iter_mut().for_each(|v| *v *= scale);
        let repaired = repair(&scaled).unwrap();
        assert_eq!((repaired.counts.degenerate_faces_removed, repaired.counts.edges_joined), (1, 1));
        let got = topology(&repaired.mesh);
        assert!(got.is_closed_manifold() && got.vertices == 5 && got.faces == 6, "{scale}: {got:?}");
    }
    // Without it, the vertex is on a boundary edge.
    let mut open = closed.clone();
    open.triangles.pop();
    let repaired = repair(&open).unwrap();
    assert_eq!((repaired.counts.edges_joined, topology(&repaired.mesh).boundary_loops), (1, 0));
}
