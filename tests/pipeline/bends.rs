//! Whole runs in which edges are shorter at the bends of CAD parts.

use crate::support::shapes::{filleted_block, moved, union};
use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{MeasureDepth, Options, Remeshed, Sizing, TriMesh, remesh};

/// Half the sides of the block, without its fillets.
const HALF: DVec3 = DVec3::new(1.0, 0.7, 0.5);
const VERTICES: usize = 1200;

fn run(mesh: &TriMesh, sizing: Sizing) -> Remeshed {
    let options = Options::new(VERTICES).sizing(sizing).measures(MeasureDepth::Full);
    let result = remesh(device(), mesh, &options).unwrap();
    assert_valid(device());
    let got = topology(&result.mesh);
    assert_eq!((got.vertices, got.euler), (VERTICES, 2), "{:?}", result.summary.warnings);
    result
}

#[test]
fn fillets_hardly_wider_than_an_edge_get_shorter_ones() {
    const RADIUS: f64 = 0.1;
    let block = filleted_block(HALF, RADIUS, 6);
    let [even, shorter] = [Sizing::Uniform, Sizing::Automatic].map(|sizing| run(&block, sizing));
    // That of the input as it is, and not of its divided planes.
    assert_eq!(even.summary.input, shorter.summary.input);
    let of =
        |result: &Remeshed| (result.summary.output.distances.unwrap().rms, result.summary.output.quality);
    let ((before, _), (after, quality)) = (of(&even), of(&shorter));
    assert!(after < 0.8 * before, "RMS {after} instead of {before}");
    assert!(quality.min_angle > 28.0 && quality.mean_quality > 0.92, "{quality:?}");
    assert_eq!(even.summary.edge_lengths, None);
    let [least, largest] = shorter.summary.edge_lengths.unwrap();
    assert!((0.75..0.85).contains(&(least / largest)), "{least} to {largest}");
    // On fillets and in planes.
    let (mut bent, mut flat) = ((0.0, 0), (0.0, 0));
    for corners in &shorter.mesh.triangles {
        let [a, b, c] = corners.map(|v| shorter.mesh.vertices[v as usize]);
        let middle = (a + b + c) / 3.0;
        let beyond = (0..3).filter(|k| middle[*k].abs() > HALF[*k]).count();
        let sum = if beyond > 1 { &mut bent } else { &mut flat };
        *sum = (sum.0 + a.distance(b) + b.distance(c) + c.distance(a), sum.1 + 3);
    }
    let [bent, flat] = [bent, flat].map(|(sum, count)| sum / f64::from(count));
    assert!(bent < 0.9 * flat, "{bent} on fillets, {flat} in planes");
}

#[test]
fn edges_are_even_on_surfaces_without_planes_or_bends() {
    for mesh in ["bumpy-sphere", "box"].map(|name| sample(name).unwrap()) {
        let [even, automatic] = [Sizing::Uniform, Sizing::Automatic].map(|sizing| run(&mesh, sizing));
        assert_eq!(even.mesh, automatic.mesh);
        assert_eq!(automatic.summary.edge_lengths, None);
    }
}

#[test]
fn faces_of_the_input_are_counted_before_planes_are_divided() {
    let block = filleted_block(HALF, 0.1, 6);
    let both = union(&block, &moved(&block, |p| p + DVec3::new(0.9, 0.5, 0.3)));
    let [even, shorter] = [Sizing::Uniform, Sizing::Automatic].map(|sizing| {
        let options = Options::new(VERTICES).sizing(sizing).measures(MeasureDepth::Full);
        remesh(device(), &both, &options).unwrap().summary
    });
    assert!(even.edge_lengths.is_none() && shorter.edge_lengths.is_some());
    let [before, after] = [even, shorter].map(|summary| summary.input_self_intersecting_faces);
    assert!(before > Some(10) && after == before, "{after:?} instead of {before:?}");
}
