//! Triangles with two sides on curves.

use std::collections::HashSet;

use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::mesh::quality::quality;
use rtfmesh::sites::ears::turn_ears;

use crate::support::shapes::mesh;

/// A flat ear under a triangle: the curve runs from 0 over 2 to 1.
fn flat_ear(more: &[[u32; 3]]) -> (TriMesh, HashSet<(u32, u32)>) {
    let vertices = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, -0.1, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.5]];
    (mesh(&vertices, &[&[[0, 1, 3], [0, 2, 1]], more].concat()), HashSet::from([(0, 2), (1, 2)]))
}

/// Whether no edge has more than two triangles.
fn is_uncrowded(mesh: &TriMesh) -> bool {
    let mut count = std::collections::HashMap::new();
    for [a, b, c] in &mesh.triangles {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            *count.entry((p.min(q), p.max(q))).or_insert(0) += 1;
        }
    }
    count.values().all(|n| *n <= 2)
}

#[test]
fn a_flat_ear_is_turned() {
    let (mut flat, curve) = flat_ear(&[]);
    let before = quality(&flat).unwrap().min_angle;
    turn_ears(&mut flat.triangles, &flat.vertices, &curve);
    let after = quality(&flat).unwrap().min_angle;
    assert!(before < 6.0 && after > 40.0, "{before} {after}");
    assert!(flat.triangles.iter().all(|t| t.contains(&2) && t.contains(&3)));
}

#[test]
fn an_ear_on_both_sides_of_its_curve_is_turned_whatever_the_angles() {
    let (mut crowded, curve) = flat_ear(&[[1, 0, 4]]);
    // So that the angles would be worse.
    crowded.vertices[2] = DVec3::new(1.0, -1.0, 0.0);
    crowded.vertices[3] = DVec3::new(1.0, 0.2, 0.0);
    assert!(!is_uncrowded(&crowded));
    turn_ears(&mut crowded.triangles, &crowded.vertices, &curve);
    assert!(is_uncrowded(&crowded), "{:?}", crowded.triangles);
}

#[test]
fn ears_that_two_patches_share_are_told_apart() {
    // Another patch behind the same ear.
    let (mut twins, curve) = flat_ear(&[[0, 1, 4], [0, 2, 1]]);
    assert!(!is_uncrowded(&twins));
    turn_ears(&mut twins.triangles, &twins.vertices, &curve);
    assert!(is_uncrowded(&twins), "{:?}", twins.triangles);
    assert!([3, 4].iter().all(|v| twins.triangles.iter().filter(|t| t.contains(v)).count() >= 1));
    // Without a second ear nobody knows which patch this one is of.
    let (mut one, curve) = flat_ear(&[[0, 1, 4], [1, 0, 3]]);
    let before = one.triangles.clone();
    turn_ears(&mut one.triangles, &one.vertices, &curve);
    assert_eq!(one.triangles, before);
}

#[test]
fn good_ears_and_other_triangles_stay() {
    // With a right angle the ear is as good as it can be, and turned it would stick out.
    let (mut good, curve) = flat_ear(&[]);
    good.vertices[2] = DVec3::new(1.0, -1.0, 0.0);
    for curve in
        [curve.clone(), HashSet::new(), HashSet::from([(0, 2)]), HashSet::from([(0, 1), (0, 2), (1, 2)])]
    {
        let before = good.triangles.clone();
        turn_ears(&mut good.triangles, &good.vertices, &curve);
        assert_eq!(good.triangles, before);
    }
    // Where the new edge is there already, or the ear has nothing beside it.
    for more in [&[[2, 3, 4]][..], &[]] {
        let (mut other, curve) = flat_ear(more);
        if more.is_empty() {
            other.triangles.remove(0);
        }
        let before = other.triangles.clone();
        turn_ears(&mut other.triangles, &other.vertices, &curve);
        assert_eq!(other.triangles, before);
    }
}
