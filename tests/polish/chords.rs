//! Edges between vertices on curves.

use std::collections::HashSet;

use glam::DVec3;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{MeshCache, PolishOptions, Target, polish};
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
    let along = |from: u32| (from..from + 23).map(|v| (v, v + 1));
    let curve_edges: HashSet<(u32, u32)> = along(0).chain(along(24)).collect();
    let run = |curve_edges: HashSet<(u32, u32)>| {
        let mut mesh = before.clone();
        let options = PolishOptions { fixed: fixed.clone(), curve_edges, ..PolishOptions::default() };
        polish(
            &mut mesh,
            &Target::new(&before),
            &options,
            &mut MeshCache::default(),
            &ProgressToken::default(),
        )
        .unwrap();
        mesh
    };
    let flipped = run(curve_edges);
    assert_eq!((topology(&flipped), &flipped.vertices), (topology(&before), &before.vertices));
    let mean = |mesh: &TriMesh| quality(mesh).unwrap().mean_quality;
    assert!(mean(&flipped) > mean(&before) + 0.1, "{} {}", mean(&before), mean(&flipped));
    // Where nothing is known of curves, all stay.
    assert_eq!(run(HashSet::new()), before);
}
