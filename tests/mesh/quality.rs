//! Triangle quality and valences with known values.

use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::mesh::quality::{TriangleQuality, quality, valence};

use crate::support::shapes::{Random, cube, mesh, moved, plane, torus};

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
}

fn shape(corners: [[f64; 3]; 3]) -> TriangleQuality {
    TriangleQuality::new(corners.map(DVec3::from_array))
}

#[test]
fn equilateral_triangle_is_best() {
    let best = shape([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.75f64.sqrt(), 0.0]]);
    close(best.q, 1.0);
    close(best.min_angle(), 60.0);
    close(best.max_angle(), 60.0);
}

#[test]
fn right_triangle() {
    let right = shape([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
    close(right.q, 6.0 / 3f64.sqrt() * 6.0 / (6.0 * 5.0));
    close(right.angles[0], 90.0);
    close(right.angles[1], (3.0f64 / 4.0).atan().to_degrees());
    close(right.angles[2], (4.0f64 / 3.0).atan().to_degrees());
    assert_eq!(right.lengths, [5.0, 3.0, 4.0]);
}

#[test]
fn triangles_without_area() {
    let line = shape([[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    assert_eq!((line.q, line.min_angle(), line.max_angle()), (0.0, 0.0, 180.0));
    let needle = shape([[0.0; 3], [0.0; 3], [1.0, 2.0, 3.0]]);
    assert_eq!((needle.q, needle.min_angle(), needle.max_angle()), (0.0, 0.0, 90.0));
    let point = shape([[1.0; 3]; 3]);
    assert_eq!((point.q, point.min_angle(), point.max_angle()), (0.0, 90.0, 90.0));
}

#[test]
fn summary_of_two_triangles() {
    let two = mesh(&[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0], [-1.0, 0.0, 0.0]], &[[0, 1, 2], [1, 2, 3]]);
    let found = quality(&two).unwrap();
    let right = 6.0 / 3f64.sqrt() * 6.0 / 30.0;
    let hypotenuses = 5.0 + 10f64.sqrt();
    let other = 6.0 / 3f64.sqrt() * 7.5 / ((5.0 + hypotenuses) / 2.0 * 5.0);
    close(found.min_quality, right.min(other));
    close(found.mean_quality, (right + other) / 2.0);
    let small = (3.0f64 / 4.0).atan().to_degrees();
    close(found.min_angle, small);
    close(found.mean_min_angle, small);
    assert_eq!((found.fraction_below_30, found.fraction_above_90), (0.0, 0.0));
    let lengths = [5.0, 3.0, 4.0, 10f64.sqrt(), 5.0, 5.0];
    let mean = lengths.iter().sum::<f64>() / 6.0;
    let spread = lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 6.0;
    close(found.edge_cv, spread.sqrt() / mean);
}

#[test]
fn shares_count_thin_and_blunt_triangles() {
    let three = mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.1, 0.0], [0.5, 0.8, 0.0], [0.1, 0.4, 0.0]],
        &[[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 3]],
    );
    let found = quality(&three).unwrap();
    assert_eq!((found.fraction_below_30, found.fraction_above_90), (0.5, 0.25));
}

#[test]
fn scale_changes_nothing() {
    let random = std::cell::RefCell::new(Random(7));
    let rough = moved(&torus(9, 7), |v| v + 0.1 * random.borrow_mut().point());
    let expected = quality(&rough).unwrap();
    for exponent in [-900, -100, 100, 660] {
        let scaled = moved(&rough, |v| v * 2f64.powi(exponent));
        assert_eq!(quality(&scaled), Some(expected), "at 2^{exponent}");
    }
    for scale in [1e-30, 1e30, 1e200, 1e-200] {
        let found = quality(&moved(&rough, |v| v * scale)).unwrap();
        close(found.mean_quality, expected.mean_quality);
        close(found.min_angle, expected.min_angle);
        close(found.edge_cv, expected.edge_cv);
    }
}

#[test]
fn unused_vertices_do_not_spoil_the_scale() {
    let mut padded = torus(9, 7);
    let expected = quality(&padded);
    padded.vertices.push(DVec3::splat(1e200));
    assert_eq!(quality(&padded), expected);
}

#[test]
fn valences_of_cube_and_torus() {
    let found = valence(&cube());
    assert_eq!(found.interior_vertices, 8);
    assert_eq!(found.histogram.values().sum::<usize>(), 8);
    assert_eq!(found.histogram.iter().map(|(k, n)| *k as usize * n).sum::<usize>(), 36);
    let regular = valence(&torus(9, 7));
    assert_eq!(regular.histogram.into_iter().collect::<Vec<_>>(), [(6, 63)]);
    assert_eq!((regular.fraction_6, regular.fraction_outside_5_to_7), (Some(1.0), Some(0.0)));
}

#[test]
fn valence_leaves_the_boundary_out() {
    let found = valence(&plane(3, 0.0));
    assert_eq!(found.histogram.into_iter().collect::<Vec<_>>(), [(6, 4)]);
    let single = valence(&mesh(&[[0.0; 3]; 3], &[[0, 1, 2]]));
    assert_eq!(
        (single.interior_vertices, single.fraction_6, single.fraction_outside_5_to_7),
        (0, None, None)
    );
}

#[test]
fn nothing_has_no_quality() {
    assert_eq!(quality(&TriMesh::default()), None);
    assert_eq!(valence(&TriMesh::default()).interior_vertices, 0);
}
