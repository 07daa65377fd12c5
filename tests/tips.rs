//! Vertices on tips that the mesh misses.

use rtfmesh::TriMesh;
use rtfmesh::mesh::samples::sample;
use rtfmesh::polish::reach_tips;

/// The typical edge of the sample `sphere`.
fn edge(mesh: &TriMesh) -> f64 {
    let [a, b, _] = mesh.corners(0);
    a.distance(b)
}

#[test]
fn a_spike_gets_its_vertex() {
    let mesh = sample("sphere").unwrap();
    let edge = edge(&mesh);
    let mut surface = mesh.clone();
    let spike = 700;
    let radius = surface.vertices[spike].length();
    surface.vertices[spike] *= 1.0 + 0.5 * edge / radius;
    let mut reached = mesh.clone();
    let moved = reach_tips(&mut reached, &surface, edge);
    assert_eq!((0..moved.len()).filter(|v| moved[*v]).collect::<Vec<_>>(), [spike]);
    assert_eq!(reached, surface);
}

#[test]
fn what_is_met_or_folded_away_moves_nothing() {
    let mesh = sample("torus").unwrap();
    let mut same = mesh.clone();
    assert!(!reach_tips(&mut same, &mesh, 0.05).contains(&true));
    assert_eq!(same, mesh);
    // The same surface inside out: nothing on it faces as the mesh does.
    let sphere = sample("sphere").unwrap();
    let edge = edge(&sphere);
    let mut inside_out = sphere.clone();
    inside_out.vertices[300] *= 1.5;
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let mut still = sphere.clone();
    assert!(!reach_tips(&mut still, &inside_out, edge).contains(&true));
    assert_eq!(still, sphere);
}

#[test]
fn empty_meshes_and_tips_too_far_away() {
    let mut nothing = TriMesh::default();
    assert!(reach_tips(&mut nothing, &sample("box").unwrap(), 0.1).is_empty());
    let sphere = sample("sphere").unwrap();
    let edge = edge(&sphere);
    let mut far = sphere.clone();
    far.vertices[10] *= 3.0;
    let mut still = sphere.clone();
    reach_tips(&mut still, &far, edge);
    assert_eq!(still, sphere);
}
