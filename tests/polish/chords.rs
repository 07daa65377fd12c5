//! Edges between vertices on curves.

use glam::DVec3;
use rtfmesh::mesh::polyline::Polyline;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, CurveEdge, PolishOptions, SlidingCurve, Target, polish};
use rtfmesh::{ProgressToken, TriMesh};

/// A strip between two rows of vertices, with the diagonals aslant by so many vertices.
fn strip(length: u32, aslant: u32) -> TriMesh {
    let row = |y: f64| (0..length).map(move |x| DVec3::new(f64::from(x), y, 0.0));
    let mut triangles = Vec::new();
    for x in 0..length - 1 - aslant {
        let [a, b, c, d] = [x, x + 1, length + x + aslant, length + x + 1 + aslant];
        triangles.extend([[a, b, c], [b, d, c]]);
    }
    TriMesh { vertices: row(0.0).chain(row(0.9)).collect(), triangles }
}

#[test]
fn edges_across_a_strip_between_two_curves_flip_and_those_along_it_stay() {
    let before = strip(24, 2);
    let fixed = vec![true; before.vertices.len()];
    // Both rows are curves.
    let curve = |first: u32| {
        let points = (first..first + 24).map(|v| before.vertices[v as usize]).collect();
        SlidingCurve { line: Polyline::new(points, false), sliders: Vec::new() }
    };
    let edges = |(curve, first): (u32, u32)| {
        let edge = move |k: u32| {
            let ends = [first + k, first + k + 1];
            CurveEdge { ends, curve, from: f64::from(k), to: f64::from(k + 1) }
        };
        (0..23).map(edge)
    };
    let sliding_curves = vec![curve(0), curve(24)];
    let curve_edges: Vec<CurveEdge> = [(0, 0), (1, 24)].into_iter().flat_map(edges).collect();
    let run = |curve_edges: &[CurveEdge], keeps_chords: bool| {
        let mut mesh = ConstrainedMesh {
            fixed: fixed.clone(),
            curve_edges: curve_edges.to_vec(),
            sliding_curves: sliding_curves.clone(),
            ..before.clone().into()
        };
        let options = PolishOptions { keeps_chords, ..PolishOptions::default() };
        polish(&mut mesh, &Target::new(&before), &options, &ProgressToken::default()).unwrap();
        assert_eq!(mesh.curve_edges, curve_edges);
        mesh.mesh
    };
    let flipped = run(&curve_edges, false);
    assert_eq!((topology(&flipped), &flipped.vertices), (topology(&before), &before.vertices));
    let mean = |mesh: &TriMesh| quality(mesh).unwrap().mean_quality;
    assert!(mean(&flipped) > mean(&before) + 0.1, "{} {}", mean(&before), mean(&flipped));
    // Where nothing is known of curves, all stay; or if that is asked for.
    assert_eq!(run(&[], false), before);
    assert_eq!(run(&curve_edges, true), before);
}
