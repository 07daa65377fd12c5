//! The measures of a mesh taken together: welding, volume, and meshes that cannot be measured.

use glam::DVec3;
use rtfmesh::measure::{measure, weld};
use rtfmesh::{Error, TriMesh};

use crate::support::shapes::{cube, mesh, moved, plane, torus};

/// Each triangle with vertices of its own.
fn split(mesh: &TriMesh) -> TriMesh {
    TriMesh {
        vertices: (0..mesh.triangles.len()).flat_map(|t| mesh.corners(t)).collect(),
        triangles: (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    }
}

#[test]
fn split_vertices_are_welded() {
    let whole = measure(&cube(), None).unwrap();
    assert!(whole.topology.is_closed_manifold());
    assert_eq!((whole.vertices, whole.faces, whole.self_intersecting_faces), (8, 12, Some(0)));
    assert_eq!(measure(&split(&cube()), None).unwrap(), whole);
}

#[test]
fn welding_merges_zeros_of_both_signs_and_nothing_else() {
    let near = f64::MIN_POSITIVE;
    let welded = weld(&mesh(&[[0.0; 3], [-0.0, 0.0, -0.0], [near, 0.0, 0.0]], &[[0, 1, 2]]));
    assert_eq!(welded.vertices, [DVec3::ZERO, DVec3::new(near, 0.0, 0.0)]);
    assert_eq!(welded.triangles, [[0, 0, 1]]);
}

#[test]
fn volume_has_the_sign_of_the_orientation() {
    let volume = |mesh: &TriMesh| measure(mesh, None).unwrap().relative_volume;
    let mut inverted = cube();
    inverted.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    for scale in [1.0, 1e30, 1e-30, 1e200] {
        let shift = |v: DVec3| (v + 3.0) * scale;
        assert!((volume(&moved(&cube(), shift)).unwrap() - 1.0).abs() < 1e-9);
        assert!((volume(&moved(&inverted, shift)).unwrap() + 1.0).abs() < 1e-9);
    }
    assert_eq!(volume(&plane(2, 0.0)), None);
    let pillow = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2], [0, 2, 1]]);
    assert_eq!(volume(&pillow), Some(0.0));
}

#[test]
fn folded_edges_are_counted() {
    assert_eq!(measure(&cube(), None).unwrap().folded_edges, 0.0);
    let fold = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 1.0, 0.1]], &[[0, 1, 2], [1, 0, 3]]);
    assert_eq!(measure(&fold, None).unwrap().folded_edges, 1.0);
}

#[test]
fn unusable_meshes_are_input_errors() {
    let fine = cube();
    let mut infinite = cube();
    infinite.vertices[3].y = f64::INFINITY;
    let mut not_a_number = cube();
    not_a_number.vertices[0].z = f64::NAN;
    let mut dangling = cube();
    dangling.triangles[7][2] = 8;
    let points = TriMesh { vertices: fine.vertices.clone(), triangles: Vec::new() };
    for bad in [TriMesh::default(), points, infinite, not_a_number, dangling] {
        assert!(matches!(measure(&bad, None), Err(Error::Input { .. })));
        assert!(matches!(measure(&fine, Some(&bad)), Err(Error::Input { .. })));
    }
    let speck = mesh(&[[1.0; 3]; 3], &[[0, 1, 2]]);
    assert!(matches!(measure(&fine, Some(&speck)), Err(Error::Input { .. })));
    assert!(matches!(measure(&moved(&fine, |v| v * 1e300), Some(&fine)), Err(Error::Input { .. })));
}

#[test]
fn degenerate_meshes_are_measured() {
    let speck = mesh(&[[1.0; 3]; 3], &[[0, 1, 2]]);
    let found = measure(&speck, None).unwrap();
    assert_eq!((found.vertices, found.quality.min_quality, found.quality.edge_cv), (1, 0.0, 0.0));
    let line = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[[0, 1, 2]]);
    let found = measure(&line, Some(&line)).unwrap();
    let distances = found.distances.unwrap();
    assert_eq!(
        (found.self_intersecting_faces, distances.hausdorff_lower, distances.rms),
        (Some(0), 0.0, 0.0)
    );
    assert!(distances.hausdorff < 1e-9, "{distances:?}");
    let huge = moved(&torus(5, 4), |v| v * 1e307);
    assert!(measure(&huge, Some(&huge)).unwrap().distances.unwrap().hausdorff < 1e-9);
}
