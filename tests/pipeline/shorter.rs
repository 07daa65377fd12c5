//! Whole runs in which edges are shorter around what even edges leave out.

use crate::support::shapes::sphere;
use crate::support::{assert_valid, device};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{MeasureDepth, Options, Remeshed, Sizing, TriMesh, remesh};

/// A sphere with a groove along half its equator, narrower than the edges of a mesh of 1,500 vertices and as
/// deep as two of them.
fn grooved() -> TriMesh {
    let mut mesh = sphere(1.0, 7);
    for p in &mut mesh.vertices {
        let along = (1.0 + p.x).clamp(0.0, 1.0);
        let depth = 0.2 * along * (-(p.z / 0.04).powi(2)).exp();
        *p *= 1.0 - depth;
    }
    mesh
}

fn run(mesh: &TriMesh, sizing: Sizing, seed: u64) -> Remeshed {
    // Without features, along which vertices would be put.
    let options =
        Options::new(1500).feature_angle(180.0).sizing(sizing).seed(seed).measures(MeasureDepth::Full);
    let result = remesh(device(), mesh, &options).unwrap();
    assert_valid(device());
    let got = topology(&result.mesh);
    assert_eq!((got.vertices, got.euler), (1500, 2), "{:?}", result.summary.warnings);
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    result
}

#[test]
fn a_groove_narrower_than_an_edge_is_reached() {
    let mesh = grooved();
    // Further attempts may be worse, and are not taken then. Which ones are depends on the device's rounding.
    let (seed, automatic, shorter) = (1..=4)
        .find_map(|seed| {
            let automatic = run(&mesh, Sizing::Automatic, seed);
            automatic.summary.shorter_edges.clone().map(|shorter| (seed, automatic, shorter))
        })
        .expect("no edges are shorter with any seed");
    let even = run(&mesh, Sizing::Uniform, seed);
    assert_eq!((even.summary.shorter_edges, even.summary.attempts), (None, 1));
    let [before, after] = [even.summary.output, automatic.summary.output]
        .map(|m| m.distances.unwrap().hausdorff_from_reference);
    assert!(after < 0.85 * before, "{after} instead of {before}");
    assert!(shorter.shortest < 0.8 && (1..750).contains(&shorter.vertices), "{shorter:?}");
    // On the bottom of the groove.
    let is_in_it = |[x, y, z]: &[f64; 3]| z.abs() < 0.04 && (x * x + y * y).sqrt() < 0.99;
    assert!(shorter.places.iter().all(is_in_it) && automatic.summary.attempts > 1, "{shorter:?}");
}

#[test]
fn where_nothing_is_left_out_edges_are_even() {
    let mesh = sample("torus").unwrap();
    let [even, automatic] = [Sizing::Uniform, Sizing::Automatic].map(|sizing| run_torus(&mesh, sizing));
    assert_eq!(even.mesh, automatic.mesh);
    assert_eq!((automatic.summary.shorter_edges, automatic.summary.attempts), (None, 1));
}

fn run_torus(mesh: &TriMesh, sizing: Sizing) -> Remeshed {
    remesh(device(), mesh, &Options::new(500).sizing(sizing)).unwrap()
}
