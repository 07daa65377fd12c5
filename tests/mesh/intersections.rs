//! Intersecting faces: pairs in every relative position, and whole meshes.

use glam::{DMat3, DVec3};
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::{ProgressToken, TriMesh};

use crate::support::shapes::{Random, cube, mesh, moved, plane, sphere, tetrahedron, torus, union};

/// Whether faces 0 and 1 intersect, asked with both in all orders and from several sides.
fn pair(vertices: &[[f64; 3]], first: [u32; 3], second: [u32; 3]) -> bool {
    let mut answers = Vec::new();
    for permutation in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]] {
        let turned = second.map(|_| 0).iter().zip(permutation).map(|(_, k)| second[k]).collect::<Vec<_>>();
        let turned = [turned[0], turned[1], turned[2]];
        for faces in [[first, turned], [turned, first]] {
            for map in [DMat3::IDENTITY, axes_to([1, 2, 0]), axes_to([2, 0, 1]), axes_to([1, 0, 2])] {
                let found = intersecting_faces(
                    &moved(&mesh(vertices, &faces), |v| map * v),
                    &ProgressToken::default(),
                )
                .unwrap();
                assert!(found.is_empty() || found == [0, 1]);
                answers.push(!found.is_empty());
            }
        }
    }
    assert!(answers.iter().all(|&a| a == answers[0]), "the answer depends on the order or on the axes");
    answers[0]
}

fn axes_to(order: [usize; 3]) -> DMat3 {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    DMat3::from_cols(axes[order[0]], axes[order[1]], axes[order[2]])
}

/// A right triangle with legs of 4 in the ground plane, and three more points.
fn over_a_triangle(others: [[f64; 3]; 3]) -> Vec<[f64; 3]> {
    [[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]], others].concat()
}

fn apart(others: [[f64; 3]; 3]) -> bool {
    pair(&over_a_triangle(others), [0, 1, 2], [3, 4, 5])
}

#[test]
fn pairs_without_a_common_vertex() {
    assert!(apart([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 1.0]]), "an edge pierces the face");
    assert!(!apart([[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [9.0, 9.0, 0.5]]), "it passes beside it");
    assert!(!apart([[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]]), "parallel planes");
    assert!(!apart([[1.0, 1.0, 1e-300], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]]), "hardly above");
    assert!(apart([[1.0, 1.0, 0.0], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]]), "a corner on the face");
    assert!(apart([[2.0, 2.0, 0.0], [2.0, 1.0, 1.0], [1.0, 2.0, 1.0]]), "a corner on an edge");
    assert!(apart([[4.0, 0.0, 0.0], [5.0, 1.0, 1.0], [5.0, 2.0, 1.0]]), "equal corners, not joined");
    assert!(apart([[2.0, -1.0, -1.0], [2.0, 1.0, 1.0], [2.0, -3.0, 0.0]]), "edges cross");
}

#[test]
fn coplanar_pairs_without_a_common_vertex() {
    assert!(apart([[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 9.0, 0.0]]), "overlap");
    assert!(apart([[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]]), "one inside the other");
    assert!(apart([[-1.0, -1.0, 0.0], [9.0, -1.0, 0.0], [-1.0, 9.0, 0.0]]), "the other around the one");
    assert!(apart([[2.0, 2.0, 0.0], [9.0, 2.0, 0.0], [9.0, 9.0, 0.0]]), "touching an edge");
    assert!(!apart([[3.0, 3.0, 0.0], [9.0, 3.0, 0.0], [9.0, 9.0, 0.0]]), "boxes overlap, faces do not");
    assert!(apart([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, -2.0, 0.0]]), "edges on one line, overlapping");
    assert!(!apart([[5.0, 0.0, 0.0], [7.0, 0.0, 0.0], [6.0, -2.0, 0.0]]), "edges on one line, apart");
}

/// Faces `0 1 2` and `0 3 4` around the origin.
fn at_origin(others: [[f64; 3]; 2]) -> bool {
    let vertices = [over_a_triangle([[0.0; 3]; 3])[..3].to_vec(), others.to_vec()].concat();
    pair(&vertices, [0, 1, 2], [0, 3, 4])
}

#[test]
fn pairs_with_one_common_vertex() {
    assert!(!at_origin([[-1.0, 0.0, 1.0], [0.0, -1.0, 1.0]]), "neighbours in a fan");
    assert!(at_origin([[1.0, 1.0, 1.0], [1.0, 1.0, -1.0]]), "the opposite edge pierces the face");
    assert!(at_origin([[9.0, 9.0, 1.0], [9.0, 9.0, -1.0]]), "the face's edge pierces the other one");
    assert!(!at_origin([[-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]]), "planes cross on the far side");
    assert!(at_origin([[1.0, 1.0, 0.0], [2.0, 1.0, 1.0]]), "an edge lies in the face");
    assert!(!at_origin([[2.0, 0.0, 0.0], [1.0, -1.0, 1.0]]), "a shorter edge lies on an edge");
    assert!(!at_origin([[9.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), "a longer edge lies on an edge");
}

#[test]
fn coplanar_pairs_with_one_common_vertex() {
    assert!(!at_origin([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), "opposite");
    assert!(!at_origin([[-1.0, 0.0, 0.0], [-1.0, 3.0, 0.0]]), "beside");
    assert!(!at_origin([[0.0, 2.0, 0.0], [-1.0, 3.0, 0.0]]), "beside, with edges on each other");
    assert!(at_origin([[1.0, 2.0, 0.0], [-1.0, 3.0, 0.0]]), "overlapping");
    assert!(at_origin([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0]]), "inside");
    assert!(at_origin([[-1.0, 5.0, 0.0], [5.0, -1.0, 0.0]]), "around");
    assert!(at_origin([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), "the same corner, smaller");
    assert!(at_origin([[9.0, 0.0, 0.0], [1.0, 1.0, 0.0]]), "one leg in common");
}

#[test]
fn pairs_with_a_common_edge() {
    let hinge = |apex: [f64; 3]| {
        let vertices = [over_a_triangle([[0.0; 3]; 3])[..3].to_vec(), vec![apex]].concat();
        pair(&vertices, [0, 1, 2], [1, 0, 3])
    };
    assert!(!hinge([1.0, -1.0, 0.0]), "flat");
    assert!(!hinge([1.0, 1.0, 1e-9]), "folded, but open by a hair");
    assert!(hinge([1.0, 1.0, 0.0]), "folded onto each other");
    assert!(!hinge([2.0, 0.0, 0.0]), "one has no area");
}

#[test]
fn pairs_with_three_common_vertices() {
    assert!(pair(&over_a_triangle([[0.0; 3]; 3]), [0, 1, 2], [0, 1, 2]));
}

#[test]
fn faces_without_area() {
    assert!(apart([[1.0, 1.0, -1.0], [1.0, 1.0, 0.5], [1.0, 1.0, 1.0]]), "a needle through a face");
    assert!(!apart([[3.0, 3.0, -1.0], [3.0, 3.0, 0.5], [3.0, 3.0, 1.0]]), "a needle beside it");
    assert!(apart([[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [3.0, 1.0, 0.0]]), "a needle in its plane");
    let cap = mesh(
        &[[0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]],
        &[[0, 1, 2], [2, 1, 3], [0, 2, 3], [1, 0, 4]],
    );
    // The cap's corner splits the large face's edge, along which the faces beyond the cap touch it.
    assert_eq!(intersecting_faces(&cap, &ProgressToken::default()).unwrap(), [0u32; 0]);
    assert!(!pair(&over_a_triangle([[1.0, 1.0, 1.0]; 3]), [0, 1, 2], [0, 0, 3]), "a repeated vertex");
}

#[test]
fn sound_meshes_have_none() {
    for sound in [tetrahedron(), cube(), torus(12, 8), sphere(1.0, 3), plane(6, 1.0 / 3.0)] {
        assert_eq!(intersecting_faces(&sound, &ProgressToken::default()).unwrap(), [0u32; 0]);
    }
    assert_eq!(intersecting_faces(&TriMesh::default(), &ProgressToken::default()).unwrap(), [0u32; 0]);
    assert_eq!(
        intersecting_faces(&mesh(&over_a_triangle([[0.0; 3]; 3]), &[[0, 1, 2]]), &ProgressToken::default())
            .unwrap(),
        [0u32; 0]
    );
}

#[test]
fn two_cubes_through_each_other() {
    let shifted = moved(&cube(), |v| v * 0.5 + DVec3::new(0.25, 0.3, 0.75));
    // The small cube comes out of the top: its four sides and the top's faces meet.
    let found = intersecting_faces(&union(&cube(), &shifted), &ProgressToken::default()).unwrap();
    assert_eq!(found, [2, 3, 16, 17, 18, 19, 20, 21, 22, 23]);
}

#[test]
fn the_hierarchy_misses_no_pair_and_scale_changes_nothing() {
    let random = std::cell::RefCell::new(Random(11));
    let rough = moved(&torus(14, 9), |v| v + 0.3 * random.borrow_mut().point());
    let count = rough.triangles.len();
    let mut expected = vec![false; count];
    for s in 0..count {
        for t in 0..s {
            let two = TriMesh {
                vertices: rough.vertices.clone(),
                triangles: vec![rough.triangles[s], rough.triangles[t]],
            };
            if !intersecting_faces(&two, &ProgressToken::default()).unwrap().is_empty() {
                expected[s] = true;
                expected[t] = true;
            }
        }
    }
    let expected: Vec<u32> = (0..count as u32).filter(|&t| expected[t as usize]).collect();
    assert!(expected.len() > 20 && expected.len() < count - 20, "{} faces are no test", expected.len());
    assert_eq!(intersecting_faces(&rough, &ProgressToken::default()).unwrap(), expected);
    for exponent in [-600, -100, 100, 600] {
        assert_eq!(
            intersecting_faces(&moved(&rough, |v| v * 2f64.powi(exponent)), &ProgressToken::default())
                .unwrap(),
            expected
        );
    }
}
