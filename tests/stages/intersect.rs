//! Pairs of triangles that may intersect, against exact predicates.

use crate::stages::polish::fixture::uneven;
use crate::support::shapes::{moved, plane, tetrahedron, torus};
use crate::support::{assert_valid, device, rng, rounded};
use glam::DVec3;
use rand::RngExt;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::stages::intersect::IntersectingPairs;
use rtfmesh::{Options, ProgressToken, TriMesh, remesh};

fn search(mesh: &TriMesh, rounding: f64, workgroup: Option<u32>) -> (IntersectingPairs, Recorder) {
    let device = device();
    let pairs = IntersectingPairs::new(device, mesh, rounding, workgroup).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    pairs.record(&mut recorder).unwrap();
    (pairs, recorder)
}

/// The pairs that the device finds, in order.
fn found(mesh: &TriMesh, workgroup: Option<u32>) -> Option<Vec<[u32; 2]>> {
    sorted(search(mesh, 0.0, workgroup))
}

fn sorted((pairs, recorder): (IntersectingPairs, Recorder)) -> Option<Vec<[u32; 2]>> {
    let found = pairs.found(device(), recorder).unwrap();
    assert_valid(device());
    let mut found = found?;
    found.sort_unstable();
    assert!(found.windows(2).all(|pair| pair[0] != pair[1]), "a pair was found twice");
    assert!(found.iter().all(|[s, t]| s < t));
    Some(found)
}

/// All faces that intersect others, by the device and exact predicates, and the pairs that it found.
fn checked(mesh: &TriMesh) -> (Vec<u32>, usize) {
    let progress = ProgressToken::default();
    let pairs = sorted(search(mesh, 0.0, None)).expect("too many pairs");
    let (searched, recorder) = search(mesh, 0.0, None);
    let faces = searched.triangles(device(), recorder, mesh).unwrap().unwrap();
    assert_eq!(faces, intersecting_faces(mesh, &progress).unwrap());
    (faces, pairs.len())
}

fn in_unit_frame(mesh: &TriMesh) -> TriMesh {
    let frame = UnitFrame::of(mesh).unwrap();
    moved(mesh, |p| frame.to_unit(p))
}

/// Triangles of up to `size` anywhere in the unit-diagonal frame.
fn soup(count: u32, size: f64, seed: u64) -> TriMesh {
    let mut rng = rng(seed);
    let mut within =
        |reach: f64| DVec3::from_array(std::array::from_fn(|_| reach * (2.0 * rng.random::<f64>() - 1.0)));
    let vertices = (0..count)
        .flat_map(|_| {
            let middle = within(0.28);
            [(); 3].map(|()| middle + within(size))
        })
        .collect();
    TriMesh { vertices, triangles: (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect() }
}

#[test]
fn sound_meshes_have_few_pairs_and_results_none() {
    for (jitter, most) in [(0.0, 0), (0.1, 10), (0.2, 40)] {
        let mesh = uneven(80, 40, jitter, 4);
        let (_, pairs) = checked(&mesh);
        assert!(100 * pairs <= most * mesh.triangles.len(), "{jitter}: {pairs} pairs");
    }
    let input = sample("genus3").unwrap();
    let result = remesh(device(), &input, &Options::new(2000)).unwrap().mesh;
    assert_eq!(checked(&in_unit_frame(&result)), (vec![], 0));
}

#[test]
fn all_that_intersect_are_found() {
    for (count, size) in
        [(1, 0.1), (2, 0.3), (3, 0.3), (63, 0.1), (64, 0.1), (65, 0.1), (2000, 0.02), (80, 0.2)]
    {
        let (faces, _) = checked(&soup(count, size, u64::from(count)));
        assert!(count < 60 || !faces.is_empty(), "{count}");
    }
    // Two tori through each other, folded ones, and vertices that are off by more than an edge.
    let mut both = torus(24, 12);
    let other = moved(&both, |p| DVec3::new(p.x + 0.3, p.z, p.y));
    let first = both.vertices.len() as u32;
    both.vertices.extend(other.vertices);
    both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    assert!(!checked(&in_unit_frame(&both)).0.is_empty());
    for jitter in [0.4, 0.6] {
        assert!(!checked(&uneven(24, 12, jitter, 2)).0.is_empty());
    }
}

#[test]
fn what_touches_or_lies_on_each_other_is_found() {
    let flat = |mesh: &TriMesh| moved(mesh, |p| DVec3::new(0.1 * p.x, 0.1 * p.y, 0.0));
    assert_eq!(checked(&flat(&plane(5, 0.0))), (vec![], 0));
    assert_eq!(checked(&in_unit_frame(&tetrahedron())), (vec![], 0));
    let [o, x, y, z] = [DVec3::ZERO, 0.25 * DVec3::X, 0.25 * DVec3::Y, 0.25 * DVec3::Z];
    let of = |vertices: &[DVec3], triangles: &[[u32; 3]]| {
        checked(&TriMesh { vertices: vertices.to_vec(), triangles: triangles.to_vec() }).0
    };
    // Twice the same, the same corners, a fold, and folds of less and less.
    assert_eq!(of(&[o, x, y], &[[0, 1, 2], [0, 1, 2]]), [0, 1]);
    assert_eq!(of(&[o, x, y, o, x, y], &[[0, 1, 2], [3, 5, 4]]), [0, 1]);
    assert_eq!(of(&[o, x, y, (x + y) * 0.4], &[[0, 1, 2], [1, 0, 3]]), [0, 1]);
    for off in [1e-2, 1e-5, 1e-8, 1e-12, 0.0] {
        let folds = of(&[o, x, y, (x + y) * 0.4 + z * off], &[[0, 1, 2], [1, 0, 3]]);
        assert_eq!(folds.len(), if off > 0.0 { 0 } else { 2 }, "{off}");
        // A corner near a face and in it, and a common corner with the other two near it.
        let touches = of(&[o, x, y, (x + y) * 0.3 + z * off, z + x, z + y], &[[0, 1, 2], [3, 4, 5]]);
        assert_eq!(touches.len(), if off > 0.0 { 0 } else { 2 }, "{off}");
        let fan = of(&[o, x, y, (x + y) * 0.3 + z * off, z + x], &[[0, 1, 2], [0, 3, 4]]);
        assert_eq!(fan.len(), if off > 0.0 { 0 } else { 2 }, "{off}");
    }
    // Slivers and points, which have no area.
    let sliver = [o, x, x * 0.5 + y * 1e-9, x * 0.5 - y * 1e-9];
    assert!(of(&sliver, &[[0, 1, 2], [1, 0, 3]]).is_empty());
    assert!(of(&[o, x, y, z, z, z], &[[0, 1, 2], [3, 4, 5]]).is_empty());
    assert_eq!(of(&[o, x, y, (x + y) * 0.3, (x + y) * 0.3, (x + y) * 0.3], &[[0, 1, 2], [3, 4, 5]]), [0, 1]);
}

#[test]
fn what_rounding_may_join_is_found() {
    let most = IntersectingPairs::MOST_ROUNDING;
    let mut corners = soup(1, 0.2, 7).vertices;
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
    for (gap, pairs) in [(2.0 * most, 1), (1e-4, 0)] {
        corners.truncate(3);
        corners.extend_from_within(..);
        corners[3..].iter_mut().for_each(|p| *p += gap * normal);
        let mesh = TriMesh { vertices: corners.clone(), triangles: vec![[0, 1, 2], [3, 4, 5]] };
        assert_eq!(sorted(search(&mesh, most, None)).map(|found| found.len()), Some(pairs), "{gap}");
    }
    // Also if only their boxes meet when both are off.
    let flat = |z: f64| [DVec3::ZERO, 0.2 * DVec3::X, 0.2 * DVec3::Y].map(|p| p + z * DVec3::Z);
    for k in 0..50 {
        let z = 1e-3 * f64::from(k) * 0.317;
        let vertices = [flat(z), flat(z + 2.0 * most)].concat();
        let mesh = TriMesh { vertices, triangles: vec![[0, 1, 2], [3, 4, 5]] };
        assert_eq!(sorted(search(&mesh, most, None)).map(|found| found.len()), Some(1), "{z}");
    }
}

#[test]
fn every_workgroup_finds_the_same() {
    let mesh = uneven(24, 12, 1.0, 2);
    let mesh = TriMesh { vertices: rounded(&mesh.vertices), ..mesh };
    let wanted = found(&mesh, None);
    for workgroup in [8, 16, 128] {
        assert_eq!(found(&mesh, Some(workgroup)), wanted);
    }
}

#[test]
fn more_pairs_than_the_list_holds_are_told() {
    // Each triangle intersects each other.
    assert_eq!(found(&soup(200, 0.2, 1), None).map(|pairs| pairs.len() > 100), Some(true));
    let mut all = soup(1, 0.2, 1);
    all.triangles = vec![[0, 1, 2]; 200];
    assert_eq!(found(&all, None), None);
}
