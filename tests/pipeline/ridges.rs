//! Whole runs of surfaces with ridges that no curve marks.

use crate::support::shapes::filleted_block;
use crate::support::{assert_valid, device};
use glam::DVec3;
use rtfmesh::mesh::topology::topology;
use rtfmesh::{MeasureDepth, Options, Remeshed, Sizing, TriMesh, remesh};

/// Half the sides of the block, without its fillets,
const HALF: DVec3 = DVec3::new(1.0, 0.7, 0.5);
/// the radius of these, and the facets across each half of them.
const RADIUS: f64 = 0.02;
const ACROSS: u32 = 4;

fn run(mesh: &TriMesh, feature_angle: f64) -> Remeshed {
    let options = Options::new(400).feature_angle(feature_angle).measures(MeasureDepth::Full);
    // With shorter edges at the fillets, these would be nearly straight without ridges.
    let options = options.sizing(Sizing::Uniform);
    let result = remesh(device(), mesh, &options).unwrap();
    assert_valid(device());
    let got = topology(&result.mesh);
    assert_eq!((got.vertices, got.euler), (400, 2), "{:?}", result.summary.warnings);
    assert_eq!(result.summary.output.self_intersecting_faces, Some(0));
    result
}

/// The distances from the lines where the block's sides would meet, in edge lengths, of the vertices that are
/// near one and not near its ends.
fn off_ridges(mesh: &TriMesh) -> Vec<f64> {
    let half = HALF + RADIUS;
    let edge = (2.0 * mesh.area() / (3f64.sqrt() * mesh.vertices.len() as f64)).sqrt();
    let mut off = Vec::new();
    for p in &mesh.vertices {
        for axis in 0..3 {
            let [u, v] = [1, 2].map(|k| p[(axis + k) % 3].abs() - half[(axis + k) % 3]);
            let distance = u.hypot(v) / edge;
            if p[axis].abs() < half[axis] - 2.0 * edge && distance < 0.5 {
                off.push(distance);
            }
        }
    }
    off
}

#[test]
fn fillets_narrower_than_an_edge_are_straight() {
    let block = filleted_block(HALF, RADIUS, ACROSS);
    // With no features at all, vertices stand on either side of the fillets.
    let [zigzag, straight] = [180.0, 40.0].map(|angle| run(&block, angle));
    let rms = |result: &Remeshed| result.summary.output.distances.unwrap().rms;
    let (before, after) = (rms(&zigzag), rms(&straight));
    assert!(before > 0.4 && after < 0.2, "RMS {after} instead of {before}");
    // Of the vertices within half an edge of a ridge, the share that is on it.
    let on_ridges = |result: &Remeshed| {
        let off = off_ridges(&result.mesh);
        assert!(off.len() > 20, "{off:?}");
        off.iter().filter(|off| **off < 0.1).count() as f64 / off.len() as f64
    };
    let (before, after) = (on_ridges(&zigzag), on_ridges(&straight));
    assert!(before < 0.6 && after > 0.9, "{after} of the vertices are on ridges, and {before} were");
    let quality = straight.summary.output.quality;
    assert!(quality.min_angle > 25.0 && quality.mean_quality > 0.87, "{quality:?}");
    // No vertex is on a curve, since there is none.
    assert_eq!(straight.summary.features.unwrap().curve_sites, 0);
}
