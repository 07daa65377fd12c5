//! Certified Hausdorff distances: known answers, a plain search, and meshes that are hard to compare.

use std::f64::consts::PI;

use glam::{DVec3, Vec3Swizzles};
use rtfmesh::mesh::bvh::Bvh;
use rtfmesh::mesh::distance::{distances, distances_within};
use rtfmesh::mesh::hausdorff::{Effort, Indexed, Interval, one_sided};
use rtfmesh::{Error, ProgressToken, TriMesh};

use crate::reference::hausdorff::{distance, hausdorff};
use crate::support::shapes::{Random, cube, globe, mesh, moved, plane, sphere, torus, union};

const RELATIVE: f64 = 0.01;
const ABSOLUTE: f64 = 1e-6;

fn with_steps(from: &TriMesh, to: &TriMesh, steps: usize) -> Interval {
    let [a, b] = [from, to].map(Bvh::new);
    let effort = Effort { relative: RELATIVE, absolute: ABSOLUTE, steps };
    let (from, to) = (Indexed { mesh: from, bvh: &a }, Indexed { mesh: to, bvh: &b });
    one_sided(from, to, effort, &ProgressToken::default()).unwrap()
}

/// The interval, which is as close as asked for, and whose farthest point is as far as its lower end says.
fn interval(from: &TriMesh, to: &TriMesh) -> Interval {
    let found = with_steps(from, to, Effort::usual_steps(from, to));
    assert!(found.close && found.upper - found.lower <= (RELATIVE * found.upper).max(ABSOLUTE), "{found:?}");
    assert!(distance(found.farthest, to) >= found.lower, "{found:?}");
    assert!(distance(found.farthest, from) <= 1e-12 * found.farthest.length().max(1.0), "{found:?}");
    found
}

fn assert_contains(found: Interval, expected: f64) {
    assert!((found.lower..=found.upper).contains(&expected), "{expected} is not in {found:?}");
}

/// Triangles with corners in a cube of this size around random points.
fn soup(random: &mut Random, count: u32, size: f64) -> TriMesh {
    let vertices = (0..count).flat_map(|_| {
        let centre = random.point();
        [0; 3].map(|_| centre + size * random.point())
    });
    TriMesh {
        vertices: vertices.collect(),
        triangles: (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    }
}

/// The faces of a convex body with triangular faces of one edge length, each split into `n * n` triangles
/// whose corners are moved onto the unit sphere.
fn ball(corners: &[DVec3], n: u32) -> TriMesh {
    let mut ball = TriMesh::default();
    let length = |i: usize, j: usize| corners[i].distance(corners[j]);
    let edge = (1..corners.len()).map(|j| length(0, j)).fold(f64::INFINITY, f64::min);
    let joined = |i: usize, j: usize| length(i, j) < 1.01 * edge;
    for i in 0..corners.len() {
        for j in i + 1..corners.len() {
            for k in (j + 1..corners.len()).filter(|&k| joined(i, j) && joined(j, k) && joined(k, i)) {
                let at = |b: u32, c: u32| {
                    let a = n - b - c;
                    let weighted = [(i, a), (j, b), (k, c)].map(|(v, w)| corners[v] * f64::from(w));
                    weighted.into_iter().sum::<DVec3>().normalize()
                };
                let small = (0..n).flat_map(|b| (0..n - b).map(move |c| (b, c))).flat_map(|(b, c)| {
                    let up = [at(b, c), at(b + 1, c), at(b, c + 1)];
                    let down = (b + c + 1 < n).then(|| [at(b + 1, c), at(b + 1, c + 1), at(b, c + 1)]);
                    [Some(up), down].into_iter().flatten()
                });
                for triangle in small.collect::<Vec<_>>() {
                    let first = ball.vertices.len() as u32;
                    ball.vertices.extend(triangle);
                    ball.triangles.push([first, first + 1, first + 2]);
                }
            }
        }
    }
    ball
}

#[test]
fn the_reference_knows_simple_answers() {
    let raised = moved(&plane(2, 0.0), |v| v * DVec3::new(0.5, 1.0, 1.0) + DVec3::Z);
    let [lower, upper] = hausdorff(&plane(2, 0.0), &raised, 1e-3);
    assert!((lower..=upper).contains(&1.25f64.sqrt()) && upper - lower <= 1e-3, "{lower} {upper}");
}

#[test]
fn parallel_planes() {
    for gap in [1.0, 0.25, 1e-3, 3e-5, 1e-9, 0.0] {
        for (n, m) in [(1, 1), (3, 5), (7, 40)] {
            assert_contains(interval(&plane(n, gap), &plane(m, 0.0)), gap);
        }
    }
}

#[test]
fn a_triangle_that_is_moved() {
    let low = mesh(&[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]], &[[0, 1, 2]]);
    for (offset, expected) in [
        ([0.0, 0.0, 0.5], 0.5),
        ([0.5, 0.0, 0.0], 0.5),
        ([-2.0, 0.0, 0.0], 2.0),
        // The hypotenuse is moved by half of this across.
        ([1.0, 0.75, 0.0], 1.25),
        ([0.3, 0.0, 0.4], 0.5),
    ] {
        let found = interval(&moved(&low, |v| v + DVec3::from_array(offset)), &low);
        assert_contains(found, expected);
    }
}

#[test]
fn an_icosahedron_and_its_sphere() {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let corners = signs.map(|(s, t)| DVec3::new(0.0, s, t * golden).normalize());
    let corners: Vec<DVec3> = corners.iter().flat_map(|p| [*p, p.yzx(), p.zxy()]).collect();
    let icosahedron = ball(&corners, 1);
    assert_eq!(icosahedron.triangles.len(), 20);
    // With a vertex above the middle of each face, which no face of the sphere reaches beyond.
    let sphere = ball(&corners, 12);
    let inner = icosahedron.corners(0).into_iter().sum::<DVec3>().length() / 3.0;
    assert_contains(interval(&sphere, &icosahedron), 1.0 - inner);
    // The other way, the middle of a face is the farthest of the icosahedron from the round sphere. The mesh
    // is inside that by less than its edges' sagitta.
    let found = interval(&icosahedron, &sphere);
    assert!(found.lower <= 1.0 - inner && found.upper > 1.0 - inner - 0.01, "{found:?}");
}

#[test]
fn concentric_spheres() {
    let (inner, outer) = (sphere(0.5, 4), sphere(1.0, 4));
    let found = interval(&outer, &inner);
    // The corners are 1/2 apart, faces less.
    assert_contains(found, 0.5);
    let back = interval(&inner, &outer);
    assert!(back.lower <= 0.5 && back.upper > 0.4, "{back:?}");
}

#[test]
fn a_hole_that_sampling_misses() {
    // A square with a hole of side 2e-5: the middle of the hole is 1e-5 from it.
    let (small, large) = (1e-5, 1.0);
    let ring = |side: f64| [[-side, -side, 0.0], [side, -side, 0.0], [side, side, 0.0], [-side, side, 0.0]];
    let vertices = [ring(large), ring(small)].concat();
    let triangles: Vec<[u32; 3]> =
        (0..4).flat_map(|k| [[k, (k + 1) % 4, 4 + k], [(k + 1) % 4, 4 + (k + 1) % 4, 4 + k]]).collect();
    let with_hole = mesh(&vertices, &triangles);
    let whole = moved(&plane(1, 0.0), |v| 2.0 * v - DVec3::new(1.0, 1.0, 0.0));
    assert_contains(interval(&whole, &with_hole), 1e-5);
    assert!(interval(&with_hole, &whole).upper < 1e-9);
}

#[test]
fn a_spike_and_the_pit_that_it_would_fill() {
    // A needle on a plane: its tip is a vertex. The plane has no point near the tip, but is all there.
    let needle = mesh(&[[0.5, 0.5, 0.0], [0.501, 0.5, 0.0], [0.5, 0.5, 0.7]], &[[0, 1, 2]]);
    let spiked = union(&plane(4, 0.0), &needle);
    assert_contains(interval(&spiked, &plane(4, 0.0)), 0.7);
    assert!(interval(&plane(4, 0.0), &spiked).upper < 1e-9);
}

#[test]
fn random_soups_against_a_plain_search() {
    let mut random = Random(11);
    for (sizes, counts) in
        [([0.3, 0.3], [30, 30]), ([0.05, 1.0], [60, 10]), ([1.0, 0.05], [10, 60]), ([1.5, 1.5], [12, 8])]
    {
        for _ in 0..4 {
            let [from, to] = [0, 1].map(|k| soup(&mut random, counts[k], sizes[k]));
            let [lower, upper] = hausdorff(&from, &to, 2e-3);
            let found = interval(&from, &to);
            assert!(found.lower <= upper && lower <= found.upper, "{found:?} instead of {lower} to {upper}");
        }
    }
}

#[test]
fn triangles_of_any_shape_against_a_plain_search() {
    let mut random = Random(12);
    for round in 0..12 {
        let mut odd = |count: u32| {
            let mut odd = soup(&mut random, count, 0.5);
            for t in 0..count as usize {
                let [a, b] = [odd.vertices[3 * t], odd.vertices[3 * t + 1]];
                let thin =
                    a + (b - a) * random.unit() + 10f64.powi(-(random.below(14) as i32)) * random.point();
                odd.vertices[3 * t + 2] = [thin, a, 0.5 * (a + b)][random.below(3) as usize];
                if random.below(8) == 0 {
                    odd.vertices[3 * t + 1] = a;
                }
            }
            odd
        };
        let (from, to) = (odd(10), odd(12));
        let [lower, upper] = hausdorff(&from, &to, 2e-3);
        let found = interval(&from, &to);
        assert!(found.lower <= upper && lower <= found.upper, "{round}: {found:?}, not {lower} to {upper}");
    }
}

#[test]
fn smooth_surfaces_against_dense_samples() {
    let rough = moved(&torus(24, 16), |v| v * (1.0 + 0.01 * (9.0 * v.x).sin()));
    for (from, to) in [(&rough, &torus(40, 24)), (&torus(40, 24), &rough), (&globe(30, 16), &sphere(1.0, 3))]
    {
        let found = interval(from, to);
        let bvh = Bvh::new(to);
        let mut most = 0f64;
        for t in 0..from.triangles.len() {
            let [a, b, c] = from.corners(t);
            for i in 0..=12 {
                for j in 0..=12 - i {
                    let p = a + (b - a) * (f64::from(i) / 12.0) + (c - a) * (f64::from(j) / 12.0);
                    most = most.max(bvh.closest(p).unwrap().distance_sq.sqrt());
                }
            }
        }
        assert!((most..=1.06 * most).contains(&found.upper), "{most} {found:?}");
    }
}

#[test]
fn equal_surfaces_with_other_triangles() {
    let turned = |n: u32| {
        let (sin, cos) = (PI / 5.0).sin_cos();
        moved(&plane(n, 0.0), |v| DVec3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z))
    };
    let wide = moved(&plane(9, 0.0), |v| 4.0 * v - 2.0 * DVec3::new(1.0, 1.0, 0.0));
    for (from, to) in
        [(&plane(50, 0.0), &plane(7, 0.0)), (&plane(7, 0.0), &plane(50, 0.0)), (&turned(40), &wide)]
    {
        assert!(interval(from, to).upper <= ABSOLUTE);
    }
    let torus = torus(60, 40);
    assert!(interval(&torus, &torus).upper < 1e-9);
    let mut inverted = cube();
    inverted.triangles.reverse();
    inverted.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(interval(&cube(), &inverted).upper < 1e-9);
}

#[test]
fn sizes_and_places_that_differ_much() {
    let fine = plane(120, 0.0);
    let huge = mesh(&[[-50.0, -50.0, 0.1], [90.0, -50.0, 0.1], [-50.0, 90.0, 0.1]], &[[0, 1, 2]]);
    assert_contains(interval(&fine, &huge), 0.1);
    assert_contains(interval(&huge, &fine), DVec3::new(89.0, 50.0, 0.1).length());
    // The triangle covers the plane but for its corners.
    let large = mesh(&[[0.0, 0.0, 0.1], [1.0, 0.0, 0.1], [0.0, 1.0, 0.1]], &[[0, 1, 2]]);
    assert_contains(interval(&large, &fine), 0.1);
    assert_contains(interval(&fine, &large), 0.51f64.sqrt());
    let speck = moved(&torus(9, 7), |v| 1e-6 * v);
    assert!((1.0..1.5).contains(&interval(&torus(30, 20), &speck).lower));
    for far in [10.0, 1e3, 1e6, 1e12] {
        let away = moved(&fine, |v| v + DVec3::new(0.0, 0.0, far));
        assert_contains(interval(&away, &plane(3, 0.0)), far);
        let found = interval(&away, &union(&torus(9, 7), &speck));
        assert!((far - 2.0..far + 2.0).contains(&found.lower), "{found:?}");
    }
}

#[test]
fn parts_that_only_one_has() {
    let two = union(&sphere(1.0, 3), &moved(&sphere(1.0, 3), |v| v + DVec3::X * 5.0));
    assert!(interval(&sphere(1.0, 3), &two).upper < 1e-9);
    // From the far pole of the other one.
    assert_contains(interval(&two, &sphere(1.0, 3)), 5.0);
}

#[test]
fn points_and_segments_have_distances() {
    let point = mesh(&[[2.0, 0.0, 0.0]; 3], &[[0, 1, 2]]);
    let segment = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]], &[[0, 1, 2]]);
    assert_contains(interval(&point, &segment), 1.0);
    assert_contains(interval(&segment, &point), 2.0);
    assert_contains(interval(&plane(1, 0.0), &segment), 1.0);
    assert_contains(interval(&segment, &plane(1, 0.0)), 0.0);
    assert_contains(interval(&point, &point), 0.0);
}

#[test]
fn too_few_steps_give_a_wider_interval() {
    let (from, to) = (torus(90, 60), torus(70, 50));
    let [exact, wide, without] = [1_000_000, 12_000, 0].map(|steps| with_steps(&from, &to, steps));
    assert!(exact.close && !wide.close && !without.close, "{exact:?} {wide:?} {without:?}");
    for rough in [wide, without] {
        assert!(
            rough.lower <= exact.upper && rough.upper >= exact.lower && rough.upper.is_finite(),
            "{rough:?}"
        );
    }
    assert!(without.upper > wide.upper || wide.lower > without.lower);
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let from = moved(&torus(80, 50), |v| v * (1.0 + 0.01 * (9.0 * v.x).sin()));
    let to = torus(90, 60);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (interval(&from, &to), with_steps(&from, &to, 12_000)))
    };
    let first = run(1);
    assert_eq!(run(2), first);
    assert_eq!(run(5), first);
}

#[test]
fn powers_of_two_change_nothing_and_other_scales_little() {
    let rough = moved(&torus(24, 16), |v| v * (1.0 + 0.01 * (9.0 * v.x).sin()));
    let of = |scale: f64, shift: DVec3| {
        let at = |mesh: &TriMesh| moved(mesh, |v| v * scale + shift);
        distances(&at(&rough), &at(&torus(40, 24)), &ProgressToken::default()).unwrap()
    };
    let plain = of(1.0, DVec3::ZERO);
    for exponent in [-800, -20, 20, 660] {
        assert_eq!(of(2f64.powi(exponent), DVec3::ZERO), plain);
    }
    for (scale, shift) in [(1e6, 0.0), (1e-6, 0.0), (1e200, 0.0), (1e-300, 0.0), (1.0, 1e5)] {
        let found = of(scale, DVec3::new(shift, -shift, 0.5 * shift));
        // Both contain the one distance.
        assert!(
            found.hausdorff_close && found.hausdorff_lower <= plain.hausdorff + 1e-6,
            "{scale} {found:?}"
        );
        assert!(found.hausdorff >= plain.hausdorff_lower - 1e-6, "{scale} {found:?}");
    }
}

#[test]
fn the_other_way_round_the_distances_swap() {
    let (rough, smooth) = (torus(24, 16), torus(40, 24));
    let diagonal = |mesh: &TriMesh| mesh.bounds().map(|[lo, hi]| lo.distance(hi)).unwrap();
    let there = distances(&rough, &smooth, &ProgressToken::default()).unwrap();
    let back = distances(&smooth, &rough, &ProgressToken::default()).unwrap();
    let share = diagonal(&smooth) / diagonal(&rough);
    for (a, b) in [
        (there.hausdorff_to_reference, back.hausdorff_from_reference),
        (there.hausdorff_from_reference, back.hausdorff_to_reference),
        (there.hausdorff_lower, back.hausdorff_lower),
        (there.hausdorff, back.hausdorff),
    ] {
        assert!((a * share - b).abs() < 2.0 * RELATIVE * b, "{there:?} {back:?}");
    }
    assert_eq!(there.hausdorff, there.hausdorff_to_reference.max(there.hausdorff_from_reference));
    let lower = there.hausdorff_to_reference_lower.max(there.hausdorff_from_reference_lower);
    assert_eq!(there.hausdorff_lower, lower);
}

#[test]
fn the_accuracy_is_kept_and_checked() {
    let (rough, smooth) = (torus(24, 16), torus(40, 24));
    let run = |accuracy| distances_within(&rough, &smooth, accuracy, &ProgressToken::default());
    let mut gap = f64::INFINITY;
    for accuracy in [0.5, 0.1, 0.01, 1e-3, 1e-4] {
        let found = run(accuracy).unwrap();
        for (lower, upper) in [
            (found.hausdorff_to_reference_lower, found.hausdorff_to_reference),
            (found.hausdorff_from_reference_lower, found.hausdorff_from_reference),
        ] {
            assert!(lower > 0.0 && upper - lower <= (accuracy * upper).max(5e-5), "{accuracy}: {found:?}");
        }
        gap = gap.min(found.hausdorff - found.hausdorff_lower);
    }
    assert!(gap < 1e-3);
    for accuracy in [0.0, -0.1, 0.9, 1e-7, f64::NAN, f64::INFINITY] {
        assert!(matches!(run(accuracy), Err(Error::Usage { field: Some("accuracy"), .. })), "{accuracy}");
    }
}

#[test]
fn what_is_cancelled_stops() {
    let token = ProgressToken::default();
    token.cancel();
    assert_eq!(distances(&torus(9, 7), &torus(8, 6), &token), Err(Error::Cancelled));
}
