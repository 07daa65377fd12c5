//! Curves, corners and patches of surfaces whose creases are known.

use glam::DVec3;
use rtfmesh::mesh::features::{CurveKind, FeatureOptions, Features, find_features, spacing_of, user_edges};
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Error, TriMesh};

use crate::support::shapes::{Random, cube, gear, mesh, moved, plane, sphere, tetrahedron, torus, union};

fn flipped(mesh: &TriMesh) -> TriMesh {
    TriMesh {
        vertices: mesh.vertices.clone(),
        triangles: mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
    }
}

fn welded(parts: &[TriMesh]) -> TriMesh {
    let all = parts.iter().fold(TriMesh::default(), |all, part| union(&all, part));
    repair(&all).unwrap().mesh
}

/// The unit cube of `n` by `n` quads a side.
fn grid_cube(n: u32) -> TriMesh {
    let sides: Vec<TriMesh> = (0..3)
        .flat_map(|turns| {
            let turned = move |v: DVec3| match turns {
                0 => v,
                1 => DVec3::new(v.z, v.x, v.y),
                _ => DVec3::new(v.y, v.z, v.x),
            };
            [moved(&plane(n, 1.0), turned), moved(&flipped(&plane(n, 0.0)), turned)]
        })
        .collect();
    welded(&sides)
}

fn noisy(mesh: &TriMesh, by: f64) -> TriMesh {
    let mut random = Random(7);
    TriMesh {
        vertices: mesh.vertices.iter().map(|&v| v + by * random.point()).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// A flat grid folded by `angle` degrees along x = 0.5.
fn wedge(n: u32, angle: f64) -> TriMesh {
    let (sin, cos) = angle.to_radians().sin_cos();
    moved(&plane(n, 0.0), |v| {
        let beyond = (v.x - 0.5).max(0.0);
        DVec3::new(v.x.min(0.5) + beyond * cos, v.y, -beyond * sin)
    })
}

/// A flat grid whose fold along x = 0.5 fades from `angle` degrees at y = 0 to none at y = 0.7.
fn fading(n: u32, angle: f64) -> TriMesh {
    moved(&plane(n, 0.0), |v| {
        let fold = (0.5 * angle.to_radians()).tan() * (1.0 - v.y / 0.7).max(0.0);
        DVec3::new(v.x, v.y, -fold * (v.x - 0.5).abs())
    })
}

/// The features for an output of `vertices`, after the checks that hold for all features.
#[track_caller]
fn found(mesh: &TriMesh, vertices: usize) -> Features {
    found_with(mesh, &FeatureOptions::new(spacing_of(mesh, vertices).unwrap()))
}

#[track_caller]
fn found_with(mesh: &TriMesh, options: &FeatureOptions) -> Features {
    let found = find_features(mesh, options).unwrap();
    assert_eq!(find_features(mesh, options).unwrap(), found, "twice the same");
    assert_eq!(found.patches.len(), mesh.triangles.len());
    let is_corner = |v: &u32| found.corners.binary_search(v).is_ok();
    assert!(found.corners.is_sorted_by(|a, b| a < b));
    let mut edges = Vec::new();
    for curve in &found.curves {
        let v = &curve.vertices;
        let inner = if curve.closed { v.as_slice() } else { &v[1..v.len() - 1] };
        assert!(!inner.iter().any(is_corner), "a corner inside {curve:?}");
        assert!(curve.closed || (is_corner(&v[0]) && is_corner(&v[v.len() - 1])), "{curve:?}");
        let again = v.iter().take(usize::from(curve.closed));
        let all: Vec<u32> = v.iter().chain(again).copied().collect();
        assert_eq!(all.len(), curve.edges() + 1);
        let length: f64 = all
            .windows(2)
            .map(|pair| mesh.vertices[pair[0] as usize].distance(mesh.vertices[pair[1] as usize]))
            .sum();
        assert!((length - curve.length).abs() <= 1e-9 * length);
        edges.extend(all.windows(2).map(|pair| (pair[0].min(pair[1]), pair[0].max(pair[1]))));
    }
    let count = edges.len();
    edges.sort_unstable();
    edges.dedup();
    assert_eq!(edges.len(), count, "every edge is in one curve");
    // Patches are what is left between curves, numbered as they come.
    let mut next = 0;
    for &patch in &found.patches {
        assert!(patch <= next, "patches in the order of their first triangles");
        next = next.max(patch + 1);
    }
    assert_eq!(next as usize, found.patch_count);
    found
}

/// Patches, corners, curves and loops among them.
fn counts(s: &Features) -> [usize; 4] {
    [s.patch_count, s.corners.len(), s.curves.len(), s.curves.iter().filter(|c| c.closed).count()]
}

fn kinds(s: &Features) -> Vec<CurveKind> {
    s.curves_by_kind().map(|(kind, _)| kind).collect()
}

#[test]
fn cubes_have_twelve_creases() {
    for mesh in [cube(), grid_cube(2), grid_cube(8), noisy(&grid_cube(12), 0.1 / 12.0)] {
        for vertices in [30, 1000, 100_000] {
            let s = found(&mesh, vertices);
            assert_eq!((counts(&s), kinds(&s)), ([6, 8, 12, 0], vec![CurveKind::Sharp]), "{vertices}");
            assert!(s.curves.iter().all(|c| (c.length - 1.0).abs() < 0.1), "{vertices}");
        }
    }
    let mut options = FeatureOptions::new(0.1);
    options.feature_angle = 180.0;
    assert_eq!(counts(&found_with(&cube(), &options)), [1, 0, 0, 0]);
    options.feature_angle = 91.0;
    assert_eq!(counts(&found_with(&cube(), &options)), [1, 0, 0, 0]);
}

#[test]
fn plates_of_any_thickness_keep_their_edges() {
    let plate = sample("thin-plate").unwrap();
    for vertices in [30, 300, 30_000] {
        assert_eq!(counts(&found(&plate, vertices)), [6, 8, 12, 0], "{vertices}");
    }
}

/// A sheet that is flat between lines through these points of x and z.
fn sheet(profile: &[[f64; 2]]) -> TriMesh {
    let n = profile.len() as u32 - 1;
    moved(&plane(n, 0.0), |v| {
        let [x, z] = profile[(v.x * f64::from(n)).round() as usize];
        DVec3::new(x, v.y, z)
    })
}

#[test]
fn strips_narrower_than_triangles_lose_what_nobody_sees() {
    const W: f64 = 0.005;
    let step = sheet(&[[0.0, 0.0], [0.5, 0.0], [0.5, -W], [1.0, -W]]);
    let chamfer = sheet(&[[0.0, 0.0], [0.5, 0.0], [0.5 + W, -W], [0.5 + W, -0.5]]);
    // Steep, so that the upper edge is the sharper one, but not so much that the lower one is none.
    let uneven = sheet(&[[0.0, 0.0], [0.5, 0.0], [0.5 + 0.9 * W, -W], [0.5 + 0.9 * W, -0.5]]);
    let plate = sheet(&[[0.0, 0.0], [0.5, 0.0], [0.5, -W], [0.0, -W]]);
    for (mesh, coarse) in [(&step, 0), (&chamfer, 1), (&uneven, 1), (&plate, 2)] {
        for (vertices, sharp) in [(500, coarse), (100_000, 2)] {
            let s = found(mesh, vertices);
            let curves = s.curves.iter().filter(|c| c.kind == CurveKind::Sharp).count();
            assert_eq!(curves, sharp, "{vertices}");
            let discarded = (s.discarded.strips, s.discarded.strip_length.round() as usize);
            assert_eq!(discarded, (usize::from(sharp < 2), 2 - sharp), "{vertices}");
        }
    }
    let found = found(&uneven, 500);
    let kept = found.curves.iter().find(|c| c.kind == CurveKind::Sharp).unwrap();
    assert!(kept.vertices.iter().all(|v| uneven.vertices[*v as usize].z == 0.0));
}

#[test]
fn arms_of_a_patch_narrower_than_triangles_lose_their_edges() {
    const N: u32 = 40;
    // A ledge between two walls down; from y = 0.5 on it becomes wider.
    let ledge = repair(&moved(&plane(N, 0.0), |v| {
        let x = 0.5 + 0.004 + (v.y - 0.5).max(0.0);
        match (v.x * f64::from(N)).round() as u32 {
            column @ 0..=19 => DVec3::new(f64::from(column) / 38.0, v.y, 0.0),
            20 => DVec3::new(0.5, v.y, -0.5),
            21 => DVec3::new(x, v.y, -0.5),
            column => DVec3::new(x + f64::from(column - 22) / 40.0, v.y, -1.0),
        }
    }))
    .unwrap()
    .mesh;
    let sharp = |features: &Features| -> f64 {
        features.curves.iter().filter(|c| c.kind == CurveKind::Sharp).map(|c| c.length).sum()
    };
    let [coarse, fine] = [500, 100_000].map(|vertices| found(&ledge, vertices));
    assert_eq!((coarse.discarded.strips, fine.discarded.strips), (1, 0));
    assert!((coarse.discarded.strip_length - 1.0).abs() < 0.1, "{:?}", coarse.discarded);
    assert!((sharp(&fine) - sharp(&coarse) - coarse.discarded.strip_length).abs() < 1e-9);
}

/// A cube of edge length 2 with chamfers of this width, along the faces, at all its edges.
fn chamfered_cube(width: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    let signs = [1.0, -1.0];
    // The corner of the face across `axis`, next to the cube's corner with these signs.
    let at = |axis: usize, corner: [f64; 3]| {
        let in_from_edge = |k: usize| if k == axis { 1.0 } else { 1.0 - width };
        DVec3::from_array([0, 1, 2].map(|k| corner[k] * in_from_edge(k)))
    };
    let mut polygon = |points: &[DVec3]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(points);
        let out = (points[1] - points[0]).cross(points[2] - points[0]).dot(points[0]) > 0.0;
        for k in 1..points.len() as u32 - 1 {
            let [a, b] = if out { [k, k + 1] } else { [k + 1, k] };
            mesh.triangles.push([first, first + a, first + b]);
        }
    };
    let axes = |axis: usize| [(axis + 1) % 3, (axis + 2) % 3];
    for axis in 0..3 {
        let [u, v] = axes(axis);
        for s in signs {
            let corner = |a: f64, b: f64| {
                let mut corner = [s; 3];
                (corner[u], corner[v]) = (a, b);
                at(axis, corner)
            };
            polygon(&[corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)]);
        }
        for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let corner = |face: usize, s: f64| {
                let mut corner = [s; 3];
                (corner[u], corner[v]) = (a, b);
                at(face, corner)
            };
            polygon(&[corner(u, 1.0), corner(u, -1.0), corner(v, -1.0), corner(v, 1.0)]);
        }
    }
    for corner in (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|bit| signs[bit as usize])) {
        polygon(&[at(0, corner), at(1, corner), at(2, corner)]);
    }
    repair(&mesh).unwrap().mesh
}

#[test]
fn narrow_chamfers_that_meet_become_one_edge_each() {
    let mesh = chamfered_cube(0.01);
    let length = |vertices| -> f64 {
        let features = found(&mesh, vertices);
        features.curves.iter().filter(|c| c.kind == CurveKind::Sharp).map(|c| c.length).sum()
    };
    // Both sides of each where they are wide enough, one elsewhere.
    assert!((length(200_000) - 24.0 * 1.98).abs() < 0.2, "{}", length(200_000));
    assert!((length(500) - 12.0 * 1.98).abs() < 0.2, "{}", length(500));
}

/// A sheet with a crease that becomes a chamfer at y = 0.3, whose edges part at about this angle in degrees.
fn opening(angle: f64) -> TriMesh {
    const N: u32 = 40;
    let slope = angle.to_radians().tan() / std::f64::consts::SQRT_2;
    let grid = moved(&plane(N, 0.0), |v| {
        let w = slope * (v.y - 0.3).max(0.0);
        match (v.x * f64::from(N)).round() as u32 {
            column @ 0..=19 => DVec3::new(f64::from(column) / 40.0, v.y, 0.0),
            20 => DVec3::new(0.5, v.y, 0.0),
            21 => DVec3::new(0.5 + w, v.y, -w),
            column => DVec3::new(0.5 + w, v.y, -w - f64::from(column - 21) / 40.0),
        }
    });
    repair(&grid).unwrap().mesh
}

#[test]
fn edges_that_part_at_an_acute_angle_begin_where_they_are_wide_enough() {
    for (angle, parts_at_once) in [(3.0, false), (8.0, false), (16.0, true), (25.0, true)] {
        let mesh = opening(angle);
        for vertices in [1000, 4000] {
            let s = found(&mesh, vertices);
            let spacing = spacing_of(&mesh, vertices).unwrap();
            // On the grid of the surface.
            let narrow = 0.25 * spacing / f64::to_radians(angle).sin();
            let expected = if parts_at_once { 0.0 } else { narrow };
            let length = s.discarded.strip_length;
            assert!((length - expected).abs() < 1.5 / 40.0, "{angle} {vertices}: {length} for {expected}");
            let sharp = s.curves.iter().filter(|c| c.kind == CurveKind::Sharp);
            let whole: f64 = sharp.map(|curve| curve.length).sum();
            assert!(
                (whole + length - 1.0 - 0.7 / f64::to_radians(angle).cos()).abs() < 0.05,
                "{angle}: {whole}"
            );
        }
    }
}

#[test]
fn a_hole_in_a_box_has_two_closed_curves() {
    const AROUND: u32 = 24;
    // A square frame with a round hole, above and below, and the two walls.
    let ring = |step: u32| {
        let turn = f64::from(step % AROUND) / f64::from(AROUND) * std::f64::consts::TAU;
        let (sin, cos) = turn.sin_cos();
        let out = 1.0 / cos.abs().max(sin.abs());
        [DVec3::new(0.2 * cos, 0.2 * sin, 0.0), DVec3::new(out * cos, out * sin, 0.0)]
    };
    let mut mesh = TriMesh::default();
    let mut quad = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend([a, b, c, d]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    for step in 0..AROUND {
        let ([a, b], [d, c], up) = (ring(step), ring(step + 1), 0.5 * DVec3::Z);
        quad(a + up, b + up, c + up, d + up);
        quad(a - up, d - up, c - up, b - up);
        quad(b - up, c - up, c + up, b + up);
        quad(d - up, a - up, a + up, d + up);
    }
    let mesh = repair(&mesh).unwrap().mesh;
    // Up to where the hole is but a few edges round.
    for vertices in [120, 150, 250, 1000, 30_000] {
        assert_eq!(counts(&found(&mesh, vertices)), [7, 8, 14, 2], "{vertices}");
    }
}

#[test]
fn a_net_of_creases_stays_where_narrow_strips_in_it_were_given_up() {
    // The tops of the teeth are strips; without them both rims bend at every tooth.
    let gear = gear(12, 0.7, 0.3);
    let rims: f64 = (0..36).map(|k: usize| gear.vertices[k].distance(gear.vertices[(k + 1) % 36])).sum();
    for vertices in [60, 100, 1000] {
        let found = found(&gear, vertices);
        let length: f64 = found.curves.iter().map(|curve| curve.length).sum();
        assert!(length > 1.8 * rims, "{vertices}: {length} of {rims}, {:?}", found.discarded);
    }
}

#[test]
fn a_keyway_keeps_its_edges_where_triangles_are_long() {
    // A bore of 48 flat strips, each one pair of triangles from end to end, open where the keyway begins.
    let keyway = [[1.0, -0.15], [1.0, 0.15]];
    let on_bore = |k: u32| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 48.0).sin_cos();
        [0.8 * cos, 0.8 * sin]
    };
    let bore: Vec<[f64; 2]> = [[0.785, 0.15]].into_iter().chain((2..47).map(on_bore)).collect();
    let profile = [[0.785, -0.15], keyway[0], keyway[1]].into_iter().chain(bore);
    let vertices: Vec<[f64; 3]> = profile.flat_map(|[x, y]| [[x, y, 0.0], [x, y, 0.8]]).collect();
    let count = vertices.len() as u32;
    let strips = (0..count).step_by(2).map(|k| [k, k + 1, (k + 2) % count, (k + 3) % count]);
    let triangles: Vec<[u32; 3]> = strips.flat_map(|[a, b, c, d]| [[a, c, b], [c, d, b]]).collect();
    let mesh = mesh(&vertices, &triangles);
    for vertices in [500, 5000, 50_000] {
        let sharp = found(&mesh, vertices).curves.iter().filter(|c| c.kind == CurveKind::Sharp).count();
        assert_eq!(sharp, 4, "{vertices}");
    }
}

#[test]
fn single_triangles_that_are_folded_over_are_no_features() {
    // A vertex in a triangle, but beyond one of its sides.
    let mut ball = sphere(1.0, 4);
    let [a, b, c] = ball.triangles[100];
    let [p, q, r] = ball.corners(100);
    let beyond = p.midpoint(q) + 0.3 * (p.midpoint(q) - r);
    let new = ball.vertices.len() as u32;
    ball.vertices.push(beyond);
    ball.triangles[100] = [a, b, new];
    ball.triangles.extend([[b, c, new], [c, a, new]]);
    for vertices in [1000, 10_000, 100_000] {
        assert_eq!(counts(&found(&ball, vertices)), [1, 0, 0, 0], "{vertices}");
    }
}

#[test]
fn folds_are_creases_from_the_feature_angle_on() {
    for angle in (10..=170).step_by(10) {
        let s = found(&wedge(4, f64::from(angle)), 500);
        let folded = angle >= 40;
        // The rim has four corners and, where the crease meets it, two more.
        let expected = if folded { [2, 6, 7, 0] } else { [1, 4, 4, 0] };
        // A rim that is folded back runs on where the fold is.
        assert_eq!(counts(&s), expected, "{angle}");
    }
}

#[test]
fn a_crease_is_followed_until_it_fades() {
    for (n, vertices) in [(20, 600), (20, 3000), (60, 1000)] {
        let s = found(&fading(n, 80.0), vertices);
        assert_eq!(counts(&s), [1, 6, 6, 0], "{n} {vertices}");
        let (_, creases) = s.curves_by_kind().last().unwrap();
        let reached =
            creases[0].vertices.iter().map(|&v| fading(n, 80.0).vertices[v as usize].y).fold(0.0, f64::max);
        // It has 40 degrees at half of its way and less than a sixth of its angle, 16 degrees, at 0.57.
        assert!((0.5..0.7).contains(&reached), "{reached}");
    }
}

#[test]
fn smooth_and_noisy_surfaces_have_none() {
    let edge = |mesh: &TriMesh| spacing_of(mesh, mesh.vertices.len()).unwrap();
    for smooth in [sphere(1.0, 5), torus(60, 30), sample("bumpy-sphere").unwrap()] {
        for vertices in [300, 1000, 10_000] {
            assert_eq!(counts(&found(&smooth, vertices)), [1, 0, 0, 0], "{vertices}");
            let rough = noisy(&smooth, 0.1 * edge(&smooth));
            assert_eq!(counts(&found(&rough, vertices)), [1, 0, 0, 0], "{vertices}");
        }
    }
    // So rough that edges are sharp all over: they are found, and discarded with a reason.
    let rough = sphere(1.0, 5);
    let s = found(&noisy(&rough, 0.3 * edge(&rough)), 2000);
    assert_eq!(counts(&s), [1, 0, 0, 0]);
    assert!(s.discarded.short_chains > 0 && s.discarded.short_length > 0.0, "{:?}", s.discarded);
}

#[test]
fn open_surfaces_have_boundary_curves() {
    let s = found(&plane(5, 0.0), 100);
    assert_eq!((counts(&s), kinds(&s)), ([1, 4, 4, 0], vec![CurveKind::Boundary]));
    assert_eq!(
        counts(&found(&mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]), 100)),
        [1, 3, 3, 0]
    );
    let s = found(&sample("open-hemisphere").unwrap(), 500);
    assert_eq!((counts(&s), s.curves[0].edges()), ([1, 0, 1, 1], 64));
}

#[test]
fn sheets_that_meet_are_patches() {
    // Three half planes at one edge; a plane with another one standing on it.
    let fold = |angle: f64| {
        let (sin, cos) = f64::to_radians(angle).sin_cos();
        moved(&plane(4, 0.0), |v| DVec3::new(v.x * cos, v.y, v.x * sin))
    };
    let three = welded(&[fold(0.0), fold(120.0), fold(240.0)]);
    let s = found(&three, 200);
    assert_eq!((s.patch_count, s.corners.len()), (3, 8));
    assert_eq!(kinds(&s), [CurveKind::Boundary, CurveKind::NonManifold]);
    // Inside a larger plane, the standing one's foot ends freely: two corners where its rim begins.
    let standing = moved(&plane(2, 0.0), |v| DVec3::new(0.5, 0.25 + 0.5 * v.y, 0.5 * v.x));
    let s = found(&welded(&[plane(4, 0.0), standing]), 200);
    assert_eq!((s.patch_count, s.corners.len()), (2, 8));
    let foot = s.curves.iter().find(|c| c.kind == CurveKind::NonManifold).unwrap();
    assert!((foot.length - 0.5).abs() < 1e-12);
}

#[test]
fn bands_and_faces_that_run_the_wrong_way() {
    const AROUND: u32 = 40;
    let mut band = TriMesh::default();
    for step in 0..AROUND {
        let turn = f64::from(step) / f64::from(AROUND) * std::f64::consts::TAU;
        for side in [-0.4, 0.0, 0.4] {
            let from_axis = 2.0 + side * (0.5 * turn).cos();
            band.vertices.push(DVec3::new(
                from_axis * turn.cos(),
                from_axis * turn.sin(),
                side * (0.5 * turn).sin(),
            ));
        }
        let at = |ahead: u32, across: u32| match step + ahead {
            AROUND => 2 - across,
            step => 3 * step + across,
        };
        for across in 0..2 {
            let [a, b, c, d] = [at(0, across), at(1, across), at(1, across + 1), at(0, across + 1)];
            band.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let s = found(&band, 500);
    assert_eq!(kinds(&s), [CurveKind::Boundary, CurveKind::Inconsistent]);
    // The one boundary is met twice by the line where the orientation turns over.
    assert_eq!(counts(&s), [1, 2, 3, 0]);
    let mut odd = plane(5, 0.0);
    odd.triangles[22].swap(0, 1);
    let s = found(&odd, 100);
    assert_eq!((s.patch_count, s.corners.len()), (2, 7));
}

#[test]
fn surfaces_that_touch_have_corners() {
    let mut two = union(&tetrahedron(), &moved(&tetrahedron(), |v| v + 2.0));
    two.triangles.iter_mut().flatten().filter(|v| **v == 7).for_each(|v| *v = 0);
    let two = repair(&two).unwrap().mesh;
    let mut options = FeatureOptions::new(0.5);
    options.feature_angle = 180.0;
    let s = found_with(&two, &options);
    assert_eq!((s.corners.as_slice(), counts(&s)), ([0].as_slice(), [2, 1, 0, 0]));
    // An open fan on a tip as well.
    let mut fan = two.clone();
    fan.vertices.extend([DVec3::new(3.0, 0.0, 0.0), DVec3::new(3.0, 1.0, 0.0)]);
    fan.triangles.push([0, 7, 8]);
    let s = found_with(&fan, &options);
    assert_eq!((s.corners.as_slice(), s.patch_count), ([0, 7, 8].as_slice(), 3));
}

#[test]
fn users_edges_are_curves_at_any_angle() {
    let flat = plane(4, 0.0);
    let mut options = FeatureOptions::new(0.1);
    options.user_edges = vec![[10, 11], [12, 11], [13, 12], [13, 14]];
    let s = found_with(&flat, &options);
    assert_eq!((counts(&s), kinds(&s)), ([2, 6, 7, 0], vec![CurveKind::Boundary, CurveKind::User]));
    // Twice the same, and one on the boundary: no more than that.
    options.user_edges.extend([[11, 10], [0, 1]]);
    assert_eq!(found_with(&flat, &options), s);
    // One edge in the middle is a curve; nothing of the user's is a crumb.
    options.user_edges = vec![[11, 12]];
    let s = found_with(&flat, &options);
    assert_eq!(counts(&s), [1, 6, 5, 0]);
    options.user_edges = vec![[0, 24]];
    let error = find_features(&flat, &options).unwrap_err();
    assert!(matches!(&error, Error::Input { problem, .. } if problem.contains("0 and 24")), "{error}");
}

#[test]
fn lines_are_matched_to_edges() {
    let line = |line, points: &[[f64; 3]]| rtfmesh::mesh::features::FeatureLine {
        line,
        points: points.iter().map(|&p| DVec3::from_array(p)).collect(),
    };
    let flat = plane(4, 3.0);
    let near = line(1, &[[0.5, 0.0, 3.0], [0.5, 0.25 + 1e-7, 3.0], [0.5, 0.5, 3.0 - 1e-7]]);
    assert_eq!(user_edges(&flat, &[near]).unwrap(), [[10, 11], [11, 12]]);
    for (points, says) in [
        ([[0.5, 0.0, 3.0], [0.5, 0.25 + 1e-5, 3.0]], "no vertex"),
        ([[0.5, 0.0, 3.0], [0.5, 0.5, 3.0]], "no edge"),
        ([[0.5, 0.0, 3.0], [0.5, 0.0, 3.0]], "no edge"),
    ] {
        let error = user_edges(&flat, &[line(7, &points)]).unwrap_err().to_string();
        assert!(error.contains(says) && error.starts_with("line 7: "), "{error}");
    }
}

#[test]
fn size_place_and_needles_do_not_matter() {
    let whole = grid_cube(5);
    for (scale, shift) in [(1e-30, 0.0), (1e30, 0.0), (1.0, 1e6)] {
        let other = moved(&whole, |v| v * scale + shift);
        assert_eq!(counts(&found(&other, 200)), [6, 8, 12, 0], "{scale} {shift}");
    }
    // A flat square whose middle line is a row of needles that stand on edge.
    let mut needles = plane(6, 0.0);
    let first = needles.vertices.len() as u32;
    let lifted = |v: u32| plane(6, 0.0).vertices[v as usize] + DVec3::new(0.0, 0.0, 1e-8);
    needles.vertices.extend((21..28).map(lifted));
    for t in needles.triangles.iter_mut().filter(|t| t.iter().any(|&v| v > 27)) {
        t.iter_mut().filter(|v| (21..28).contains(*v)).for_each(|v| *v = first + *v - 21);
    }
    for v in 0..6 {
        let (a, b, c, d) = (21 + v, 22 + v, first + v, first + v + 1);
        needles.triangles.extend([[a, d, b], [a, c, d]]);
    }
    assert_eq!(counts(&found(&needles, 200)), [1, 4, 4, 0]);
}

#[test]
fn nothing_and_bad_options() {
    assert_eq!(find_features(&TriMesh::default(), &FeatureOptions::new(1.0)).unwrap(), Features::default());
    for (feature_angle, spacing) in
        [(0.0, 1.0), (-3.0, 1.0), (181.0, 1.0), (f64::NAN, 1.0), (40.0, 0.0), (40.0, f64::INFINITY)]
    {
        let options = FeatureOptions { feature_angle, ..FeatureOptions::new(spacing) };
        assert!(matches!(find_features(&cube(), &options), Err(Error::Usage { .. })), "{options:?}");
    }
    let broken = mesh(&[[0.0; 3], [f64::NAN, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]);
    assert!(matches!(find_features(&broken, &FeatureOptions::new(1.0)), Err(Error::Input { .. })));
}
