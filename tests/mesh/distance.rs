//! Closest points against brute force, and distances between surfaces whose distance is known.

use glam::DVec3;
use rtfmesh::mesh::bvh::{Aabb, Bvh};
use rtfmesh::mesh::distance::{Distances, distances, distances_sampled};
use rtfmesh::mesh::triangle::closest_on_triangle;
use rtfmesh::{ProgressToken, TriMesh};
use std::sync::Mutex;

use crate::support::shapes::{Random, mesh, moved, plane, sphere, torus};

/// Distance to a triangle by its plane and, where the foot is outside, its three edges.
fn oracle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let to_edge = |from: DVec3, to: DVec3| {
        let edge = to - from;
        let t = (p - from).dot(edge) / edge.length_squared();
        p.distance(from + edge * if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) })
    };
    let edges = to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a));
    let normal = (b - a).cross(c - a);
    let inside =
        [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| (to - from).cross(p - from).dot(normal) > 0.0);
    if inside { edges.min((p - a).dot(normal.normalize()).abs()) } else { edges }
}

fn soup(random: &mut Random, count: usize, triangle: impl Fn(&mut Random) -> [DVec3; 3]) -> TriMesh {
    let vertices: Vec<DVec3> = (0..count).flat_map(|_| triangle(random)).collect();
    TriMesh { vertices, triangles: (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect() }
}

/// Compares the hierarchies' answers with a search through all triangles, to `tolerance` of the distances'
/// scale.
fn compare(mesh: &TriMesh, queries: &[DVec3], tolerance: f64) {
    let (bvh, in_order) = (Bvh::new(mesh), Bvh::in_order(mesh));
    let mut rank = usize::MAX;
    for &p in queries {
        let expected =
            (0..mesh.triangles.len()).map(|t| oracle(p, mesh.corners(t))).fold(f64::INFINITY, f64::min);
        let Some(found) = bvh.closest(p) else { panic!("no triangle is closest") };
        let bound = tolerance * (1.0 + p.length());
        assert!((found.distance_sq.sqrt() - expected).abs() <= bound, "{p}: {found:?} instead of {expected}");
        assert!((found.point.distance(p) - expected).abs() <= bound);
        let [a, b, c] = mesh.corners(found.triangle as usize);
        let [u, v, w] = found.barycentric;
        assert!((a * u + b * v + c * w).distance(found.point) <= 1e-12);
        assert!(found.barycentric.iter().all(|x| (0.0..=1.0).contains(x)) && (u + v + w - 1.0).abs() < 1e-12);
        assert_eq!(bvh.closest_from(p, &mut rank), Some(found));
        assert_eq!(in_order.closest(p), Some(found));
    }
}

#[test]
fn all_seven_regions_of_a_triangle() {
    let corners = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0)];
    for (p, expected) in [
        ([-1.0, -2.0, 5.0], [0.0, 0.0, 0.0]),
        ([6.0, -1.0, 5.0], [4.0, 0.0, 0.0]),
        ([-1.0, 5.0, 5.0], [0.0, 3.0, 0.0]),
        ([2.0, -3.0, 5.0], [2.0, 0.0, 0.0]),
        ([-2.0, 1.0, 5.0], [0.0, 1.0, 0.0]),
        ([2.0 + 3.0, 1.5 + 4.0, 5.0], [2.0, 1.5, 0.0]),
        ([1.0, 0.5, -5.0], [1.0, 0.5, 0.0]),
    ] {
        let (p, expected) = (DVec3::from_array(p), DVec3::from_array(expected));
        for turn in 0..3 {
            let turned = [corners[turn], corners[(turn + 1) % 3], corners[(turn + 2) % 3]];
            let found = closest_on_triangle(p, turned);
            assert!(found.point.distance(expected) < 1e-14, "{p}: {found:?}");
            assert!((p.distance(found.point) - oracle(p, turned)).abs() < 1e-14);
        }
    }
}

#[test]
fn random_triangles() {
    let mut random = Random(1);
    let mesh = soup(&mut random, 300, |random| {
        let centre = random.point();
        [0; 3].map(|_| centre + 0.2 * random.point())
    });
    let queries: Vec<DVec3> = (0..1000).map(|_| 1.5 * random.point()).collect();
    compare(&mesh, &queries, 1e-13);
}

#[test]
fn slivers_of_all_thicknesses() {
    let mut random = Random(2);
    let mesh = soup(&mut random, 200, |random| {
        let (a, along) = (random.point(), random.point());
        let thickness = 10f64.powi(-(random.below(18) as i32));
        [a, a + along, a + along * random.unit() + thickness * random.point()]
    });
    let queries: Vec<DVec3> = (0..500).map(|_| 1.5 * random.point()).collect();
    compare(&mesh, &queries, 1e-10);
    let mut thin = mesh.clone();
    for t in 0..200 {
        thin.triangles = vec![mesh.triangles[t]];
        let [a, b, c] = mesh.corners(t);
        let near: Vec<DVec3> = (0..20)
            .map(|_| a + (b - a) * random.unit() + (c - a) * random.unit() + 1e-3 * random.point())
            .collect();
        compare(&thin, &near, 1e-10);
    }
}

#[test]
fn triangles_without_area_and_duplicates() {
    let mut random = Random(3);
    let mut mesh = soup(&mut random, 60, |random| {
        let (a, b) = (random.point(), random.point());
        [[a, a, a], [a, b, b], [a, b, 0.5 * (a + b)], [a, b, random.point()]][random.below(4) as usize]
    });
    mesh.triangles.extend_from_within(..);
    let queries: Vec<DVec3> = (0..300).map(|_| 1.5 * random.point()).collect();
    compare(&mesh, &queries, 1e-13);
    let bvh = Bvh::new(&mesh);
    assert!(queries.iter().all(|&p| bvh.closest(p).unwrap().triangle < 60), "the first of equals wins");
}

#[test]
fn points_far_off_and_on_the_surface() {
    let torus = torus(20, 12);
    let mut random = Random(4);
    let far: Vec<DVec3> = (0..200).map(|k| random.point() * 10f64.powi(k % 7)).collect();
    compare(&torus, &far, 1e-13);
    let centres: Vec<DVec3> =
        (0..torus.triangles.len()).map(|t| torus.corners(t).iter().sum::<DVec3>() / 3.0).collect();
    compare(&torus, &centres, 1e-15);
    compare(&torus, &torus.vertices, 1e-15);
}

#[test]
fn coordinates_that_defeat_the_splitting_heuristic() {
    let mut shrinking = TriMesh::default();
    for k in 0..900 {
        let size = 0.5f64.powi(k);
        shrinking.vertices.extend([DVec3::X * size, DVec3::Y * size, DVec3::Z * size]);
        shrinking.triangles.push([3 * k as u32, 3 * k as u32 + 1, 3 * k as u32 + 2]);
    }
    compare(&shrinking, &[DVec3::ONE, DVec3::ZERO, DVec3::splat(1e-3), -DVec3::ONE], 1e-15);
    let stacked = TriMesh { triangles: vec![[0, 1, 2]; 5000], ..plane(1, 0.0) };
    compare(&stacked, &[DVec3::ONE, DVec3::ZERO], 1e-15);
}

#[test]
fn overlapping_boxes_equal_a_plain_search() {
    let mut random = Random(5);
    let mesh = soup(&mut random, 400, |random| {
        let centre = random.point();
        [0; 3].map(|_| centre + 0.1 * random.point())
    });
    let bvh = Bvh::new(&mesh);
    for _ in 0..100 {
        let centre = random.point();
        let wanted = Aabb { min: centre - 0.2 * random.unit(), max: centre + 0.2 * random.unit() };
        let mut found = Vec::new();
        bvh.overlapping(&wanted, |t| found.push(t));
        found.sort_unstable();
        let expected: Vec<u32> = (0..400)
            .filter(|&t| {
                let b = Aabb::of(mesh.corners(t as usize));
                (0..3).all(|k| b.min[k] <= wanted.max[k] && wanted.min[k] <= b.max[k])
            })
            .collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn overlapping_pairs_are_found_once() {
    let mut random = Random(6);
    // So many that threads share the work, of all sizes, and some of them equal.
    let mut mesh = soup(&mut random, 3000, |random| {
        let (centre, size) = (random.point(), 0.3 * random.unit().powi(4));
        [0; 3].map(|_| centre + size * random.point())
    });
    mesh.triangles.extend_from_within(..10);
    let boxes: Vec<Aabb> = (0..mesh.triangles.len()).map(|t| Aabb::of(mesh.corners(t))).collect();
    let meet = |a: &Aabb, b: &Aabb| (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k]);
    let expected: Vec<(u32, u32)> = (0..mesh.triangles.len())
        .flat_map(|s| (s + 1..mesh.triangles.len()).map(move |t| (s, t)))
        .filter(|(s, t)| meet(&boxes[*s], &boxes[*t]))
        .map(|(s, t)| (s as u32, t as u32))
        .collect();
    let found = Mutex::new(Vec::new());
    let visit = |s: u32, t: u32| found.lock().unwrap().push((s.min(t), s.max(t)));
    Bvh::new(&mesh).overlapping_pairs(&ProgressToken::default(), visit).unwrap();
    let mut found = found.into_inner().unwrap();
    found.sort_unstable();
    assert_eq!(found.len(), expected.len());
    assert_eq!(found, expected);
    let cancelled = ProgressToken::default();
    cancelled.cancel();
    assert!(Bvh::new(&mesh).overlapping_pairs(&cancelled, |_, _| ()).is_err());
}

#[test]
fn a_tree_follows_a_mesh_that_moves() {
    let mut random = Random(7);
    let mut mesh = torus(40, 30);
    let mut bvh = Bvh::new(&mesh);
    mesh.vertices.iter_mut().for_each(|v| *v = DVec3::new(v.y, 2.0 * v.z, v.x) + 0.1 * random.point());
    bvh.refit(&mesh);
    let anew = Bvh::new(&mesh);
    assert_eq!(bvh.bounds(), anew.bounds());
    for _ in 0..300 {
        let p = 2.0 * random.point();
        assert_eq!(bvh.closest(p), anew.closest(p));
    }
}

#[test]
fn an_empty_mesh_has_no_closest_point() {
    for bvh in [Bvh::new(&TriMesh::default()), Bvh::in_order(&TriMesh::default())] {
        assert_eq!(bvh.closest(DVec3::ZERO), None);
        bvh.overlapping(&Aabb { min: -DVec3::ONE, max: DVec3::ONE }, |_| panic!("there is nothing to visit"));
    }
}

/// The Hausdorff distance is between its ends, which are close.
fn assert_hausdorff(found: &Distances, expected: f64) {
    let [lower, upper] = [found.hausdorff_lower, found.hausdorff];
    assert!(lower <= expected && expected <= upper && upper <= 1.01 * lower + 1e-4, "{expected}: {found:?}");
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found} instead of {expected}");
}

#[test]
fn parallel_planes() {
    let found = distances_sampled(&plane(3, 0.25), &plane(5, 0.0), 2000, &ProgressToken::default()).unwrap();
    let expected = 100.0 * 0.25 / 2f64.sqrt();
    assert_hausdorff(&found, expected);
    for (lower, upper) in [
        (found.hausdorff_to_reference_lower, found.hausdorff_to_reference),
        (found.hausdorff_from_reference_lower, found.hausdorff_from_reference),
    ] {
        assert!(lower <= expected && expected <= upper, "{found:?}");
    }
    for distance in [found.rms, found.rms_to_reference, found.rms_from_reference] {
        close(distance, expected, 1e-12);
    }
}

#[test]
fn a_part_is_near_the_whole_but_not_the_other_way() {
    let half = moved(&plane(8, 0.0), |v| v * DVec3::new(0.5, 1.0, 1.0));
    let found = distances_sampled(&half, &plane(8, 0.0), 20_000, &ProgressToken::default()).unwrap();
    assert!(found.hausdorff_to_reference < 1e-4);
    assert_hausdorff(&found, 50.0 / 2f64.sqrt());
    assert_eq!(found.hausdorff, found.hausdorff_from_reference);
    // Half of the samples are 0 to 0.5 away: the mean square is 1/2 * 1/12.
    close(found.rms_from_reference, 100.0 * (1.0f64 / 24.0).sqrt() / 2f64.sqrt(), 0.02);
    assert!(found.rms_to_reference < 1e-12);
    assert_eq!(found.rms, found.rms_from_reference);
}

#[test]
fn concentric_spheres() {
    let (inner, outer) = (sphere(0.9, 5), sphere(1.0, 5));
    let found = distances_sampled(&inner, &outer, 20_000, &ProgressToken::default()).unwrap();
    let [lo, hi] = outer.bounds().unwrap();
    let expected = 100.0 * 0.1 / lo.distance(hi);
    close(found.rms, expected, 0.01);
    close(found.hausdorff, expected, 0.02);
}

#[test]
fn a_peak_inside_a_face_is_found() {
    // A tent over the middle of one large triangle: the triangle's farthest points are not its corners.
    let floor = mesh(&[[-3.0, -2.0, 0.0], [3.0, -2.0, 0.0], [0.0, 4.0, 0.0]], &[[0, 1, 2]]);
    let tent = mesh(
        &[[-3.0, -2.0, 0.0], [3.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 1.0]],
        &[[0, 1, 3], [1, 2, 3], [2, 0, 3]],
    );
    let found = distances_sampled(&tent, &floor, 5000, &ProgressToken::default()).unwrap();
    let [lo, hi] = floor.bounds().unwrap();
    assert_hausdorff(&found, 100.0 / lo.distance(hi));
    let reach = tent_distance(&tent, DVec3::ZERO);
    assert!(found.hausdorff_from_reference >= 100.0 * reach / lo.distance(hi), "{found:?}");
}

fn tent_distance(tent: &TriMesh, p: DVec3) -> f64 {
    (0..3).map(|t| oracle(p, tent.corners(t))).fold(f64::INFINITY, f64::min)
}

#[test]
fn samples_are_even_on_edges_and_faces() {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let ground = mesh(&[[-5.0, -5.0, 0.0], [9.0, -5.0, 0.0], [-5.0, 9.0, 0.0]], &[[0, 1, 2]]);
    let [lo, hi] = ground.bounds().unwrap();
    for raised in 0..3 {
        let mut tilted = corners;
        tilted[raised][2] = 1.0;
        let tilted = mesh(&tilted, &[[0, 1, 2]]);
        let length =
            |k: usize| tilted.vertices[(raised + k) % 3].distance(tilted.vertices[(raised + k + 1) % 3]);
        // The mean square height is 1/6 over the face, 1/3 along the two edges at the raised corner.
        let sloping = length(0) + length(2);
        let mean_square = (1.0 / 6.0 + sloping / (sloping + length(1)) / 3.0) / 2.0;
        let found = distances_sampled(&tilted, &ground, 20_000, &ProgressToken::default()).unwrap();
        close(found.rms_to_reference, 100.0 * mean_square.sqrt() / lo.distance(hi), 1e-3);
    }
}

fn sample_pair() -> (TriMesh, TriMesh) {
    let rough = moved(&torus(24, 16), |v| v * (1.0 + 0.01 * (9.0 * v.x).sin()));
    (rough, torus(40, 24))
}

#[test]
fn a_mesh_is_at_no_distance_from_itself() {
    let found = distances(&torus(9, 7), &torus(9, 7), &ProgressToken::default()).unwrap();
    assert!(found.hausdorff < 1e-9 && found.rms < 1e-12, "{found:?}");
}

#[test]
fn distances_do_not_depend_on_scale_or_place() {
    let (rough, smooth) = sample_pair();
    let expected = distances_sampled(&rough, &smooth, 5000, &ProgressToken::default()).unwrap();
    let with = |map: &dyn Fn(DVec3) -> DVec3| {
        distances_sampled(&moved(&rough, map), &moved(&smooth, map), 5000, &ProgressToken::default()).unwrap()
    };
    for exponent in [-800, -100, 100, 660] {
        assert_eq!(with(&|v| v * 2f64.powi(exponent)), expected);
    }
    // Rounding may reorder the hierarchy and with it the samples, which costs a share of the distances.
    for found in [
        with(&|v| v * 1e-30),
        with(&|v| v * 1e30),
        with(&|v| v * 1e200),
        with(&|v| v * 1e-250),
        with(&|v| v + DVec3::new(1e4, -1e5, 1e3)),
    ] {
        close(found.hausdorff, expected.hausdorff, 0.01);
        close(found.rms, expected.rms, 0.01);
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (rough, smooth) = sample_pair();
    let run = |threads| -> Distances {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| distances_sampled(&rough, &smooth, 20_000, &ProgressToken::default()).unwrap())
    };
    let first = run(1);
    assert_eq!(run(2), first);
    assert_eq!(run(5), first);
}

#[test]
fn unused_vertices_widen_the_reference_box_only() {
    let mut padded = plane(2, 0.0);
    padded.vertices.push(DVec3::new(2.0, 2.0, 1.0));
    let found = distances_sampled(&plane(3, 0.3), &padded, 1000, &ProgressToken::default()).unwrap();
    assert_hausdorff(&found, 100.0 * 0.3 / 3.0);
}

#[test]
fn one_triangle_against_another() {
    let low = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]);
    let found =
        distances_sampled(&moved(&low, |v| v + DVec3::Z), &low, 100, &ProgressToken::default()).unwrap();
    assert_hausdorff(&found, 100.0 / 2f64.sqrt());
    assert!(distances(&TriMesh::default(), &low, &ProgressToken::default()).is_err());
    assert!(distances(&low, &TriMesh::default(), &ProgressToken::default()).is_err());
    let broken = moved(&low, |v| v / 0.0);
    assert!(
        distances(&broken, &low, &ProgressToken::default()).is_err()
            && distances(&low, &broken, &ProgressToken::default()).is_err()
    );
}
