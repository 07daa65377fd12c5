//! Small angles are mended, and nothing else changes: the number of vertices, the topology, the curves.

use glam::{DVec2, DVec3};
use rtfmesh::local::{MendOptions, Mended, mend_angles};
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::polyline::Polyline;
use rtfmesh::mesh::quality::{TriangleQuality, quality};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::small_angles::{SmallAngles, small_angles};
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, CurveEdge, SlidingCurve, Target};
use rtfmesh::{Error, MeasureDepth, Options, ProgressToken, TriMesh, remesh};

use crate::support::shapes::{mesh, sphere};
use crate::support::{assert_valid, device};

/// A number that is no index.
const NONE: u32 = u32::MAX;

fn smallest(mesh: &TriMesh) -> f64 {
    quality(mesh).unwrap().min_angle
}

fn largest(mesh: &TriMesh) -> f64 {
    let angles = (0..mesh.triangles.len()).map(|t| TriangleQuality::new(mesh.corners(t)).max_angle());
    angles.fold(0.0, f64::max)
}

fn mended(local: &mut ConstrainedMesh, surface: &TriMesh, spacing: f64) -> Mended {
    let options = MendOptions { min_angle: 30.0, spacing, deviation: None };
    mend_angles(local, &Target::new(surface), &options, &ProgressToken::default()).unwrap()
}

/// A rectangle of equilateral triangles with sides of 1, each other row with a half at both ends.
fn rectangle(columns: u32, rows: u32) -> TriMesh {
    let height = 0.75f64.sqrt();
    let mut vertices = Vec::new();
    let mut first = Vec::new();
    for j in 0..=rows {
        first.push(vertices.len() as u32);
        let y = f64::from(j) * height;
        let inner = (0..columns).map(|i| f64::from(i) + 0.5);
        let row: Vec<f64> = if j % 2 == 0 {
            (0..=columns).map(f64::from).collect()
        } else {
            std::iter::once(0.0).chain(inner).chain([f64::from(columns)]).collect()
        };
        vertices.extend(row.into_iter().map(|x| DVec3::new(x, y, 0.0)));
    }
    let mut triangles = Vec::new();
    for j in 0..rows as usize {
        let (even, odd) = if j % 2 == 0 { (first[j], first[j + 1]) } else { (first[j + 1], first[j]) };
        for i in 0..columns {
            let mut quad = [[even + i, even + i + 1, odd + i + 1], [even + i, odd + i + 1, odd + i]];
            if i + 1 == columns {
                triangles.push(if j % 2 == 0 {
                    [even + i + 1, odd + i + 2, odd + i + 1]
                } else {
                    [even + i + 1, odd + i + 1, odd + i + 2]
                });
            }
            if j % 2 == 1 {
                quad.iter_mut().for_each(|t| t.swap(1, 2));
            }
            triangles.extend(quad);
        }
    }
    TriMesh { vertices, triangles }
}

/// The vertices of a flat mesh, of whatever kind, that are on the frame of a rectangle.
fn on_frame(mesh: &TriMesh, [width, height]: [f64; 2]) -> Vec<bool> {
    let is_on = |p: &DVec3| p.x < 1e-9 || p.y < 1e-9 || p.x > width - 1e-9 || p.y > height - 1e-9;
    mesh.vertices.iter().map(is_on).collect()
}

/// A rectangle whose frame stays.
fn framed(mesh: TriMesh, size: [f64; 2]) -> ConstrainedMesh {
    ConstrainedMesh { fixed: on_frame(&mesh, size), mesh, ..ConstrainedMesh::default() }
}

#[test]
fn a_vertex_out_of_place_moves_back() {
    let flat = rectangle(10, 8);
    let size = [10.0, 8.0 * 0.75f64.sqrt()];
    let mut crooked = flat.clone();
    let v = flat.vertices.iter().position(|p| p.distance(DVec3::new(5.0, size[1] / 2.0, 0.0)) < 0.1).unwrap();
    crooked.vertices[v] += DVec3::new(0.42, 0.5, 0.0);
    assert!(smallest(&flat) > 29.9 && smallest(&crooked) < 20.0);
    let mut local = framed(crooked, size);
    let done = mended(&mut local, &flat, 1.0);
    assert!(done.edits > 0 && smallest(&local.mesh) >= 29.9, "{} {done:?}", smallest(&local.mesh));
    assert_eq!(local.mesh.vertices.len(), flat.vertices.len());
    assert_eq!(topology(&local.mesh), topology(&flat));
    // Those on the frame are where they were.
    for (v, origin) in done.origins.iter().enumerate() {
        if *origin != NONE && on_frame(&flat, size)[*origin as usize] {
            assert_eq!(local.mesh.vertices[v], flat.vertices[*origin as usize]);
        }
    }
}

#[test]
fn obtuse_triangles_are_mended_at_curves_alone() {
    let flat = rectangle(10, 8);
    let size = [10.0, 8.0 * 0.75f64.sqrt()];
    let shifted = |at: DVec3| {
        let mut mesh = flat.clone();
        let v = mesh.vertices.iter().position(|p| p.distance(at) < 0.1).unwrap();
        mesh.vertices[v].y -= 0.44;
        assert!(largest(&mesh) > 95.0 && smallest(&mesh) > 25.0, "{} {}", largest(&mesh), smallest(&mesh));
        framed(mesh, size)
    };
    let height = 0.75f64.sqrt();
    let options = MendOptions { min_angle: 20.0, spacing: 1.0, deviation: None };
    let mend = |local: &mut ConstrainedMesh, options: &MendOptions| {
        mend_angles(local, &Target::new(&flat), options, &ProgressToken::default()).unwrap()
    };
    let mut beside = shifted(DVec3::new(4.5, height, 0.0));
    assert!(mend(&mut beside, &options).edits > 0);
    assert!(largest(&beside.mesh) <= 90.0 + 1e-9, "{}", largest(&beside.mesh));
    assert_eq!(topology(&beside.mesh), topology(&flat));
    let mut inside = shifted(DVec3::new(4.5, 3.0 * height, 0.0));
    assert_eq!(mend(&mut inside, &options), Mended::default());
    // With a deviation, and without mending, they stay.
    for options in
        [MendOptions { deviation: Some(0.1), ..options }, MendOptions { min_angle: 0.0, ..options }]
    {
        let mut beside = shifted(DVec3::new(4.5, height, 0.0));
        assert_eq!(mend(&mut beside, &options), Mended::default());
    }
}

#[test]
fn good_meshes_stay_as_they_are() {
    let ball = sphere(1.0, 3);
    let mut local = ConstrainedMesh { mesh: ball.clone(), ..ConstrainedMesh::default() };
    assert_eq!(mended(&mut local, &ball, 0.2), Mended::default());
    assert_eq!(local.mesh, ball);
    let empty = TriMesh::default();
    let mut nothing = ConstrainedMesh::default();
    assert_eq!(mended(&mut nothing, &empty, 1.0), Mended::default());
}

/// A sphere with an edge collapsed to almost nothing: two vertices lie side by side.
fn pinched() -> TriMesh {
    let mut ball = sphere(1.0, 3);
    let [a, b, _] = ball.triangles[40].map(|v| v as usize);
    ball.vertices[a] = ball.vertices[b].lerp(ball.vertices[a], 0.02).normalize();
    ball
}

#[test]
fn what_is_collapsed_in_one_place_is_split_in_another() {
    let (ball, bad) = (sphere(1.0, 5), pinched());
    assert!(smallest(&bad) < 5.0);
    let mut local = ConstrainedMesh { mesh: bad.clone(), ..ConstrainedMesh::default() };
    let done = mended(&mut local, &ball, 0.2);
    assert!(smallest(&local.mesh) >= 30.0, "{}", smallest(&local.mesh));
    assert_eq!(topology(&local.mesh), topology(&bad));
    assert_eq!(intersecting_faces(&local.mesh, &ProgressToken::default()).unwrap(), Vec::<u32>::new());
    let off = local.mesh.vertices.iter().map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max);
    let depth =
        (0..ball.triangles.len()).map(|t| 1.0 - (ball.corners(t).iter().sum::<DVec3>() / 3.0).length());
    let depth = depth.fold(0.0, f64::max);
    assert!(off <= depth + 1e-9, "off the sphere by {off}, {depth} deep");
    assert_eq!(done.origins.len(), bad.vertices.len());
    // Again, the same.
    let mut again = ConstrainedMesh { mesh: bad, ..ConstrainedMesh::default() };
    assert_eq!(mended(&mut again, &ball, 0.2), done);
    assert_eq!(again.mesh, local.mesh);
}

/// A strip of this width and a length of 12, whose long sides are curves with vertices at distances of 1,
/// those of one side above those of the other. A coarse field of triangles is beside it.
fn strip(width: f64) -> (ConstrainedMesh, TriMesh) {
    let length = 12u32;
    let row = |y: f64| (0..=length).map(move |x| DVec3::new(f64::from(x), y, 0.0));
    let heights = [-1.7, -0.85, 0.0, width, width + 0.85, width + 1.7];
    let vertices: Vec<DVec3> = heights.iter().flat_map(|y| row(*y)).collect();
    let count = length + 1;
    let mut triangles = Vec::new();
    let mut patches = Vec::new();
    for j in 0..heights.len() as u32 - 1 {
        for i in 0..length {
            let [a, b] = [j * count + i, j * count + i + 1];
            triangles.extend([[a, b, a + count], [b, b + count, a + count]]);
            patches.extend([u32::from(j == 2) + 2 * u32::from(j > 2); 2]);
        }
    }
    let surface = TriMesh { vertices, triangles };
    let mut fixed = on_frame(&moved_up(&surface), [12.0, width + 3.4]);
    let mut curve_edges = Vec::new();
    let mut sliding_curves = Vec::new();
    for (curve, j) in [(0, 2), (1, 3)] {
        let of = |i: u32| j * count + i;
        let line = Polyline::new((0..=length).map(|i| surface.vertices[of(i) as usize]).collect(), false);
        let edge =
            |i: u32| CurveEdge { ends: [of(i), of(i + 1)], curve, from: f64::from(i), to: f64::from(i + 1) };
        curve_edges.extend((0..length).map(edge));
        sliding_curves
            .push(SlidingCurve { line, sliders: (1..length).map(|i| (of(i), f64::from(i))).collect() });
        (0..=length).for_each(|i| fixed[of(i) as usize] = true);
    }
    let mesh = surface.clone();
    (ConstrainedMesh { mesh, patches, fixed, curve_edges, sliding_curves, ..Default::default() }, surface)
}

fn moved_up(mesh: &TriMesh) -> TriMesh {
    let vertices = mesh.vertices.iter().map(|p| *p + DVec3::new(0.0, 1.7, 0.0)).collect();
    TriMesh { vertices, ..mesh.clone() }
}

#[test]
fn narrow_strips_get_vertices_on_their_curves() {
    for width in [0.5, 0.3] {
        let (mut local, surface) = strip(width);
        assert!(smallest(&surface) < 27.0);
        let target = Target::new(&surface).in_patches(local.patches.clone());
        let options = MendOptions { min_angle: 30.0, spacing: 1.0, deviation: None };
        let done = mend_angles(&mut local, &target, &options, &ProgressToken::default()).unwrap();
        let before = small_angles(&surface, 30.0, 180.0).faces;
        let after = small_angles(&local.mesh, 30.0, 180.0).faces;
        assert!(done.edits > 0 && after * 4 < before, "{width}: {after} of {before}");
        assert_eq!(local.mesh.vertices.len(), surface.vertices.len());
        assert_eq!(topology(&local.mesh), topology(&surface));
        // Both curves are still there, whole and straight.
        for (curve, y) in [(0, 0.0), (1, width)] {
            let edges: Vec<&CurveEdge> =
                local.curve_edges.iter().filter(|edge| edge.curve == curve).collect();
            let ends = |edge: &&CurveEdge| edge.ends.map(|v| local.mesh.vertices[v as usize]);
            let covered: f64 = edges.iter().map(ends).map(|[p, q]| p.distance(q)).sum();
            assert!((covered - 12.0).abs() < 1e-9, "{width}: {covered}");
            assert!(edges.iter().flat_map(ends).all(|p| (p.y - y).abs() < 1e-12));
            for edge in edges {
                let [p, q] = ends(&edge);
                assert!((p.x - edge.from).abs() < 1e-9 && (q.x - edge.to).abs() < 1e-9, "{edge:?}");
            }
        }
        assert_eq!(done.curve_vertices, local.fixed.iter().filter(|fixed| **fixed).count());
    }
}

#[test]
fn with_a_deviation_the_number_of_vertices_is_free() {
    let (mut local, surface) = strip(0.3);
    let target = Target::new(&surface).in_patches(local.patches.clone());
    let options = MendOptions { min_angle: 30.0, spacing: 1.0, deviation: Some(1e-6) };
    let done = mend_angles(&mut local, &target, &options, &ProgressToken::default()).unwrap();
    assert!(done.added > 0, "{done:?}");
    assert_eq!(local.mesh.vertices.len() as i64, surface.vertices.len() as i64 + done.added);
    let after = small_angles(&local.mesh, 30.0, 180.0).faces;
    assert!(after * 10 < small_angles(&surface, 30.0, 180.0).faces, "{after}");
    assert!(local.mesh.vertices.iter().all(|p| p.z.abs() < 1e-12));
}

#[test]
fn it_can_be_cancelled() {
    let mut local = ConstrainedMesh { mesh: pinched(), ..ConstrainedMesh::default() };
    let progress = ProgressToken::default();
    progress.cancel();
    let options = MendOptions { min_angle: 30.0, spacing: 0.2, deviation: None };
    let result = mend_angles(&mut local, &Target::new(&sphere(1.0, 5)), &options, &progress);
    assert!(matches!(result, Err(Error::Cancelled)));
}

#[test]
fn thin_plates_have_hardly_any_small_angles() {
    for (name, count) in [("thin-plate", 1500), ("box", 700), ("open-hemisphere", 500)] {
        let input = sample(name).unwrap();
        let run = |min_angle: f64| {
            let options = Options::new(count).min_angle(min_angle).measures(MeasureDepth::Intersections);
            remesh(device(), &input, &options).unwrap()
        };
        let (without, with) = (run(0.0), run(30.0));
        assert_valid(device());
        assert_eq!(without.summary.small_angles, None);
        let summary = with.summary.small_angles.unwrap();
        let before = small_angles(&without.mesh, 30.0, 40.0).faces;
        assert_eq!(summary.left, small_angles(&with.mesh, 30.0, 40.0).faces);
        assert!(20 * summary.left <= before, "{name}: {before} before, {summary:?}");
        assert_eq!(summary.left == 0, smallest(&with.mesh) >= 30.0);
        assert_eq!(with.mesh.vertices.len(), count);
        assert_eq!(topology(&with.mesh), topology(&without.mesh), "{name}");
        assert!(with.summary.warnings.is_empty(), "{:?}", with.summary.warnings);
        if name == "thin-plate" {
            assert!(summary.edits > 0 && before > 100, "{before} before");
        }
    }
}

#[test]
fn small_angles_are_told_apart() {
    // A ledge folded along an edge: its corner is narrow, and so is the triangle across the strip beside it.
    let at = |degrees: f64| DVec2::from_angle(degrees.to_radians());
    let tip = at(20.0) * 3.0;
    let corner = mesh(&[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [tip.x, tip.y, 0.0]], &[[0, 1, 2]]);
    let found = small_angles(&corner, 30.0, 40.0);
    assert_eq!(found, SmallAngles { faces: 1, at_corners: 1, between_curves: 0 });
    assert_eq!(small_angles(&corner, 19.0, 40.0), SmallAngles::default());
    // Two rows of boundary vertices.
    let (strip, _) = strip(0.3);
    let of_strip = |t: &[u32; 3]| t.iter().all(|v| (26..52).contains(v));
    let triangles: Vec<[u32; 3]> = strip.mesh.triangles.iter().filter(|t| of_strip(t)).copied().collect();
    let narrow = TriMesh { triangles, ..strip.mesh };
    let found = small_angles(&narrow, 30.0, 40.0);
    assert_eq!((found.faces, found.at_corners + found.between_curves), (24, 24));
    // Inside a surface neither.
    let found = small_angles(&pinched(), 30.0, 180.0);
    assert!(found.faces > 0 && found.at_corners + found.between_curves == 0, "{found:?}");
    let is_small = |t: &usize| TriangleQuality::new(pinched().corners(*t)).min_angle() < 30.0;
    assert_eq!(found.faces, (0..pinched().triangles.len()).filter(is_small).count());
}
