//! Edges split one by one: the surface and its curves stay as they are.

use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::mesh::polyline::Polyline;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, CurveEdge, SlidingCurve};

/// A square of two triangles with a curve, which bends, for its diagonal.
fn square() -> ConstrainedMesh {
    let vertices = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let mesh = TriMesh { vertices: vertices.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
    let line = Polyline::new(vec![vertices[0], DVec3::new(1.0, 1.0, 0.5), vertices[2]], false);
    let edge = CurveEdge { ends: [0, 2], curve: 0, from: 0.0, to: line.length() };
    ConstrainedMesh {
        mesh,
        patches: vec![4, 7],
        fixed: vec![true; 4],
        curve_edges: vec![edge],
        sliding_curves: vec![SlidingCurve { line, sliders: Vec::new() }],
        lengths: vec![1.0, 2.0, 3.0, 2.0],
        ..Default::default()
    }
}

#[test]
fn a_vertex_on_a_curve_is_in_the_middle_of_its_part() {
    let mut local = square();
    local.split_edges(&[[2, 0], [1, 2]]);
    let [on_curve, on_side] = [local.mesh.vertices[4], local.mesh.vertices[5]];
    assert!(on_curve.distance(DVec3::new(1.0, 1.0, 0.5)) < 1e-12, "{on_curve}");
    assert_eq!(on_side, DVec3::new(2.0, 1.0, 0.0));
    assert_eq!(local.lengths, [1.0, 2.0, 3.0, 2.0, 2.0, 2.5]);
    let [sliders] = [&local.sliding_curves[0].sliders];
    assert!(sliders.len() == 1 && sliders[0].0 == 4 && (sliders[0].1 - 1.5).abs() < 1e-12, "{sliders:?}");
    assert_eq!(local.curve_edges.len(), 2);
    assert_eq!(local.fixed, [true, true, true, true, true, false]);
    let found = topology(&local.mesh);
    assert_eq!((found.faces, found.euler, found.boundary_edges, found.inconsistent_edges), (5, 1, 5, 0));
    assert_eq!(local.patches.iter().filter(|patch| **patch == 4).count(), 3);
}

#[test]
fn nothing_split_is_the_same_again() {
    let mut local = square();
    local.split_edges(&[]);
    assert_eq!((local.mesh, local.patches), (square().mesh, square().patches));
}
