//! Flips, relaxation and the worst triangles: better angles, same topology, on the surface; and degenerate
//! meshes.

use glam::DVec3;
use rtfmesh::mesh::distance::distances_sampled;
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::polyline::Polyline;
use rtfmesh::mesh::quality::{quality, valence};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, FitOptions, PolishOptions, SlidingCurve, Target};
use rtfmesh::{ProgressToken, TriMesh};

use crate::support::passes::polish;
use crate::support::shapes::{Random, cube, mesh, moved, plane, sphere, tetrahedron, torus, union};

/// The mesh with its vertices shifted by up to `amount`, the same way each time.
pub fn shaken(mesh: &TriMesh, amount: f64) -> TriMesh {
    let mut random = Random(7);
    let vertices = mesh.vertices.iter().map(|&v| v + random.point() * amount).collect();
    TriMesh { vertices, triangles: mesh.triangles.clone() }
}

/// What `work` gives in a pool of its own.
pub fn in_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// Degenerate meshes: none has much to polish, and none may make anything panic.
pub fn odd_meshes() -> Vec<(&'static str, TriMesh)> {
    let octahedron = {
        let vertices = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let upper = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let lower = [[1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]];
        TriMesh { vertices: vertices.to_vec(), triangles: [upper, lower].concat() }
    };
    let isolated = {
        let mut mesh = sphere(1.0, 2);
        mesh.vertices.push(DVec3::splat(0.3));
        mesh
    };
    let coincident = {
        let mut mesh = sphere(1.0, 2);
        let [a, b, _] = mesh.triangles[5];
        mesh.vertices[a as usize] = mesh.vertices[b as usize];
        mesh
    };
    let three_on_an_edge = mesh(
        &[[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-0.5, 0.9, 0.0], [-0.5, -0.9, 0.0]],
        &[[0, 1, 2], [0, 1, 3], [0, 1, 4]],
    );
    let inconsistent =
        mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], &[[0, 1, 2], [1, 2, 3]]);
    let twice_a_vertex = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 1], [0, 1, 2]]);
    vec![
        ("nothing", TriMesh::default()),
        ("tetrahedron", tetrahedron()),
        ("octahedron", octahedron),
        ("cube", cube()),
        ("isolated vertex", isolated),
        ("coincident vertices", coincident),
        ("open hemisphere", sample("open-hemisphere").unwrap()),
        ("three faces on an edge", three_on_an_edge),
        ("two faces that turn against each other", inconsistent),
        ("a face that repeats a vertex", twice_a_vertex),
        ("one point", mesh(&[[1.0; 3]; 3], &[[0, 1, 2]])),
        ("two spheres", union(&sphere(1.0, 2), &moved(&sphere(1.0, 2), |p| p + DVec3::X * 3.0))),
    ]
}

/// The mesh polished within its constraints.
fn polished(mut mesh: ConstrainedMesh, target: &Target) -> ConstrainedMesh {
    let options = PolishOptions::default();
    rtfmesh::polish::polish(&mut mesh, target, &options, &ProgressToken::default()).unwrap();
    mesh
}

#[test]
fn uneven_samples_get_better_triangles_and_keep_their_shape() {
    for name in ["torus", "genus3", "bumpy-sphere"] {
        let surface = sample(name).unwrap();
        let mut mesh = surface.clone();
        let counts = polish(&mut mesh, &Target::new(&surface), &PolishOptions::default());
        let (before, after) = (quality(&surface).unwrap(), quality(&mesh).unwrap());
        assert!(counts.flips > 0 || name == "bumpy-sphere", "{name}");
        assert_eq!(mesh.vertices.len(), surface.vertices.len(), "{name}");
        assert_eq!(topology(&mesh), topology(&surface), "{name}");
        assert!(
            after.mean_quality > before.mean_quality + 0.02,
            "{name}: {} after {}",
            after.mean_quality,
            before.mean_quality
        );
        assert!(
            after.min_angle >= before.min_angle,
            "{name}: {} after {}",
            after.min_angle,
            before.min_angle
        );
        assert!(valence(&mesh).fraction_6 >= valence(&surface).fraction_6, "{name}");
        assert!(intersecting_faces(&mesh, &ProgressToken::default()).unwrap().is_empty(), "{name}");
        let distances = distances_sampled(&mesh, &surface, 20_000, &ProgressToken::default()).unwrap();
        assert!(distances.rms < 0.15, "{name}: {} %", distances.rms);
    }
}

#[test]
fn a_shaken_torus_is_smooth_again() {
    let target = Target::new(&torus(120, 48));
    let mut mesh = shaken(&torus(40, 16), 0.04);
    polish(&mut mesh, &target, &PolishOptions { rounds: 30, ..PolishOptions::default() });
    let (fraction_6, shape) = (valence(&mesh).fraction_6.unwrap(), quality(&mesh).unwrap());
    assert!(fraction_6 > 0.95 && shape.min_angle > 38.0, "{fraction_6}, {shape:?}");
    for p in &mesh.vertices {
        let off = (p.x.hypot(p.y) - 1.0).hypot(p.z) - 0.4;
        assert!(off.abs() < 0.002, "a vertex is {off} off the torus");
    }
}

#[test]
fn flips_even_out_valences() {
    // Splitting faces into three leaves valences of 3 and far above 6, which Delaunay flips alone mend in
    // part only.
    let surface = sphere(1.0, 4);
    let mut split = surface.clone();
    for &[a, b, c] in surface.triangles.iter().step_by(7) {
        let middle = [a, b, c].iter().map(|&v| surface.vertices[v as usize]).sum::<DVec3>().normalize();
        let new = split.vertices.len() as u32;
        split.vertices.push(middle);
        let t = split.triangles.iter().position(|t| *t == [a, b, c]).unwrap();
        split.triangles[t] = [a, b, new];
        split.triangles.extend([[b, c, new], [c, a, new]]);
    }
    let target = Target::new(&surface);
    let regular = |valence_weight| {
        let mut mesh = split.clone();
        polish(&mut mesh, &target, &PolishOptions { valence_weight, ..PolishOptions::default() });
        assert!(quality(&mesh).unwrap().min_angle > quality(&split).unwrap().min_angle);
        valence(&mesh).fraction_6.unwrap()
    };
    let before = valence(&split).fraction_6.unwrap();
    assert!(regular(0.0) > before);
    assert!(regular(1.0) > regular(0.0));
}

#[test]
fn boundaries_and_fixed_vertices_stay() {
    let flat = plane(12, 0.0);
    let is_rim = |p: DVec3| p.x.min(p.y) <= 0.0 || p.x.max(p.y) >= 1.0;
    let mut mesh = shaken(&flat, 0.025);
    for (new, old) in mesh.vertices.iter_mut().zip(&flat.vertices) {
        *new = if is_rim(*old) { *old } else { DVec3::new(new.x, new.y, 0.0) };
    }
    let fixed: Vec<bool> = mesh.vertices.iter().map(|p| p.x < 0.4).collect();
    let before = mesh.clone();
    let mesh = polished(ConstrainedMesh { fixed: fixed.clone(), ..mesh.into() }, &Target::new(&flat)).mesh;
    assert_eq!(topology(&mesh), topology(&before));
    let mut moved = 0;
    for ((old, new), fixed) in before.vertices.iter().zip(&mesh.vertices).zip(&fixed) {
        assert!(old == new || !(is_rim(*old) || *fixed));
        assert!(new.z.abs() < 1e-12);
        moved += usize::from(old != new);
    }
    assert!(moved > 20);
    for triangle in before.triangles.iter().filter(|t| t.iter().all(|&v| fixed[v as usize])) {
        let kept = mesh.triangles.iter().any(|t| (0..3).all(|k| triangle.contains(&t[k])));
        assert!(kept, "an edge between fixed vertices was flipped");
    }
}

#[test]
fn the_other_side_of_a_thin_plate_is_out_of_reach() {
    let plate = sample("thin-plate").unwrap();
    let mut mesh = plate.clone();
    polish(&mut mesh, &Target::new(&plate), &PolishOptions::default());
    for (old, new) in plate.vertices.iter().zip(&mesh.vertices) {
        let inside = |p: &DVec3| p.x.abs().max(p.y.abs()) < 0.45;
        assert!(!inside(old) || old.z == new.z, "{old} went to {new}");
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let surface = sample("genus3").unwrap();
    let target = Target::new(&surface);
    let run = |threads| {
        let mut mesh = shaken(&surface, 0.01);
        let counts = in_threads(threads, || polish(&mut mesh, &target, &PolishOptions::default()));
        (mesh, counts)
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn odd_meshes_survive() {
    for (name, odd) in odd_meshes() {
        let mut mesh = odd.clone();
        polish(&mut mesh, &Target::new(&odd), &PolishOptions::default());
        assert_eq!(topology(&mesh), topology(&odd), "{name}");
        assert!(mesh.vertices.iter().all(|v| v.is_finite()), "{name}");
        polish(&mut mesh, &Target::new(&TriMesh::default()), &PolishOptions::default());
        assert_eq!(topology(&mesh), topology(&odd), "{name} without a surface");
    }
}

#[test]
fn no_rounds_change_nothing() {
    let surface = sample("genus3").unwrap();
    let mut mesh = surface.clone();
    let options = PolishOptions { rounds: 0, ..PolishOptions::default() };
    assert_eq!(polish(&mut mesh, &Target::new(&surface), &options), Default::default());
    assert_eq!(mesh, surface);
}

#[test]
fn vertices_and_edges_stay_in_their_patch() {
    // A roof: two patches with a ridge between them; what leaves its patch leaves its plane.
    let roof = moved(&plane(24, 0.0), |p| DVec3::new(p.x, p.y, -0.8 * (p.x - 0.5).abs()));
    let patch_of =
        |mesh: &TriMesh, t: usize| u32::from(mesh.corners(t).iter().map(|p| p.x).sum::<f64>() > 1.5);
    let patches: Vec<u32> = (0..roof.triangles.len()).map(|t| patch_of(&roof, t)).collect();
    let target = Target::new(&roof).in_patches(patches.clone());
    let fixed: Vec<bool> = roof.vertices.iter().map(|p| (p.x - 0.5).abs() < 1e-9).collect();
    assert_eq!(fixed.iter().filter(|f| **f).count(), 25);
    let mut random = Random(3);
    let mut mesh = roof.clone();
    for (p, fixed) in mesh.vertices.iter_mut().zip(&fixed) {
        let rim = |x: f64| !(1e-9..1.0 - 1e-9).contains(&x);
        if !fixed && !rim(p.x) && !rim(p.y) {
            let x = (p.x - 0.5) + (random.point().x * 0.015);
            *p = DVec3::new(0.5 + x, p.y + random.point().y * 0.015, -0.8 * x.abs());
        }
    }
    let mesh = ConstrainedMesh { fixed, patches: patches.clone(), ..mesh.into() };
    let mut mesh = polished(mesh, &target);
    rtfmesh::polish::fit(&mut mesh, &target, &FitOptions::default(), &ProgressToken::default()).unwrap();
    let mesh = mesh.mesh;
    for (t, patch) in patches.iter().enumerate() {
        assert_eq!(patch_of(&mesh, t), *patch);
        for p in mesh.corners(t) {
            assert!((p.z + 0.8 * (p.x - 0.5).abs()).abs() < 1e-6, "{p}");
        }
    }
}

/// A strip of `n` squares in the plane, cut by diagonals, whose upper rim is shifted by `shift`; and its rims
/// as sliding_curves, of which the upper one may slide.
fn strip(n: u32, shift: f64) -> (TriMesh, SlidingCurve) {
    let mut mesh = TriMesh::default();
    let end = f64::from(n);
    for i in 0..=n {
        let moved = if i == 0 || i == n { 0.0 } else { shift };
        mesh.vertices
            .extend([DVec3::new(f64::from(i), 0.0, 0.0), DVec3::new(f64::from(i) + moved, 1.0, 0.0)]);
    }
    for i in 0..n {
        mesh.triangles.extend([[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]]);
    }
    let sliders = (1..n).map(|i| (2 * i + 1, f64::from(i) + shift)).collect();
    let points = (0..=n).map(|i| DVec3::new(end * f64::from(i) / f64::from(n), 1.0, 0.0)).collect();
    (mesh, SlidingCurve { line: Polyline::new(points, false), sliders })
}

#[test]
fn vertices_on_rails_slide_to_better_triangles() {
    let (start, sliding_curve) = strip(12, -0.45);
    let sliding_curves = vec![sliding_curve];
    let mesh = ConstrainedMesh { sliding_curves, fixed: vec![true; 26], ..start.clone().into() };
    let mesh = polished(mesh, &Target::new(&start)).mesh;
    let q = |mesh| quality(mesh).unwrap();
    assert!(q(&mesh).mean_quality > q(&start).mean_quality + 0.02, "{:?} after {:?}", q(&mesh), q(&start));
    assert!(q(&mesh).min_angle > q(&start).min_angle, "{:?} after {:?}", q(&mesh), q(&start));
    for (v, (new, old)) in mesh.vertices.iter().zip(&start.vertices).enumerate() {
        let rides = v % 2 == 1 && v > 1 && v < 25;
        assert!(rides || new == old, "{v} has moved to {new}");
        assert!((new.y, new.z) == (old.y, 0.0), "{v} has left its sliding_curve: {new}");
    }
}

#[test]
fn vertices_on_closed_rails_go_round_and_keep_the_bends() {
    // The rim of a box's top, a square with the sites of its corners somewhat past them: they must not go
    // farther.
    let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
    let points: Vec<DVec3> = corners.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
    let on = |way: f64| {
        let side = (way / 4.0).floor();
        points[side as usize].lerp(points[side as usize + 1], way / 4.0 - side)
    };
    let ways: Vec<f64> = (0..16).map(|k| f64::from(k) + if k % 4 == 0 { 0.0 } else { 0.2 }).collect();
    let mut start = TriMesh { vertices: ways.iter().map(|way| on(*way)).collect(), triangles: Vec::new() };
    start.vertices.push(DVec3::new(2.0, 2.0, 0.0));
    start.triangles = (0..16).map(|k| [k, (k + 1) % 16, 16]).collect();
    let sliders = (0..16).zip(ways).collect();
    let sliding_curves = vec![SlidingCurve { line: Polyline::new(points.clone(), true), sliders }];
    let mesh = ConstrainedMesh { sliding_curves, fixed: vec![true; 17], ..start.clone().into() };
    let mesh = polished(mesh, &Target::new(&start)).mesh;
    for (v, p) in mesh.vertices[..16].iter().enumerate() {
        let on_rim = [p.x, p.y].iter().any(|c| *c == 0.0 || *c == 4.0);
        assert!(on_rim && p.z == 0.0, "{v}: {p}");
        assert!(v % 4 != 0 || p.distance(start.vertices[v]) < 0.05, "corner {v} went to {p}");
        assert!(v % 4 == 0 || *p != start.vertices[v], "{v} stayed");
    }
}
