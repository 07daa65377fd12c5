//! Remeshing by local operations: the number of vertices, the topology and the features hold on any mesh.

use glam::DVec3;
use rtfmesh::local::{EdgeLengths, LocalOptions, LocalSurface};
use rtfmesh::mesh::distance::distances_sampled;
use rtfmesh::mesh::features::{FeatureOptions, Features, find_features, spacing_of};
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::{Topology, topology};
use rtfmesh::polish::{ConstrainedMesh, Target};
use rtfmesh::{Error, ProgressToken, TriMesh};

use crate::support::shapes::{mesh, moved, union};

/// The mesh with the features that it has for so many vertices.
fn remeshed(surface: &TriMesh, vertices: usize) -> ConstrainedMesh {
    with_progress(surface, vertices, &ProgressToken::default()).unwrap()
}

fn with_progress(
    surface: &TriMesh,
    vertices: usize,
    progress: &ProgressToken,
) -> Result<ConstrainedMesh, Error> {
    let spacing = spacing_of(surface, vertices).unwrap();
    let features = find_features(surface, &FeatureOptions::new(spacing)).unwrap();
    let target = Target::new(surface).in_patches(features.patches.clone());
    LocalSurface::new((surface, &target), &features, (EdgeLengths::default(), vertices), progress)?
        .remeshed(&OPTIONS, progress)
}

const OPTIONS: LocalOptions = LocalOptions { longest: 1.06, guarded: false, gradual: false };

/// What must not change.
fn kind(t: &Topology) -> (usize, i64, usize, bool) {
    (t.components, t.euler, t.boundary_loops, t.is_manifold())
}

#[test]
fn the_count_is_exact_and_the_topology_the_same() {
    for (name, counts) in [
        ("sphere", [60, 700, 6000]),
        ("torus", [40, 500, 4000]),
        ("genus3", [150, 900, 2500]),
        ("box", [8, 30, 1500]),
        ("thin-plate", [60, 333, 2000]),
        ("tetrahedron", [4, 5, 600]),
        ("open-hemisphere", [30, 400, 3000]),
        ("two-components", [80, 600, 3000]),
    ] {
        let surface = sample(name).unwrap();
        for vertices in counts {
            let made = remeshed(&surface, vertices);
            let got = topology(&made.mesh);
            assert_eq!(got.vertices, vertices, "{name}");
            assert_eq!(made.mesh.vertices.len(), vertices, "{name}");
            assert_eq!(kind(&got), kind(&topology(&surface)), "{name} {vertices}");
            assert_eq!(made.patches.len(), made.mesh.triangles.len());
            assert_eq!(made.fixed.len(), vertices);
        }
    }
}

#[test]
fn triangles_are_even_and_on_the_surface() {
    for (name, vertices, least, most) in
        [("sphere", 1000, 0.91, 0.6), ("torus", 1000, 0.91, 0.7), ("genus3", 1500, 0.9, 1.2)]
    {
        let surface = sample(name).unwrap();
        let made = remeshed(&surface, vertices).mesh;
        let quality = quality(&made).unwrap();
        assert!(quality.mean_quality > least && quality.min_angle > 15.0, "{name}: {quality:?}");
        assert_eq!(
            intersecting_faces(&made, &ProgressToken::default()).unwrap(),
            Vec::<u32>::new(),
            "{name}"
        );
        let distances = distances_sampled(&made, &surface, 20_000, &ProgressToken::default()).unwrap();
        assert!(distances.hausdorff < most, "{name}: {distances:?}");
    }
}

#[test]
fn corners_edges_and_boundaries_stay() {
    let made = remeshed(&sample("box").unwrap(), 800).mesh;
    for k in 0..8 {
        let corner = DVec3::from_array([0, 1, 2].map(|axis| f64::from(k >> axis & 1)));
        assert!(made.vertices.contains(&corner), "{corner}");
    }
    let six_volumes: f64 = (0..made.triangles.len())
        .map(|t| {
            let [a, b, c] = made.corners(t);
            a.dot(b.cross(c))
        })
        .sum();
    assert!((six_volumes / 6.0 - 1.0).abs() < 1e-12, "{six_volumes}");

    let open = remeshed(&sample("open-hemisphere").unwrap(), 500);
    let on_boundary = open.mesh.vertices.iter().filter(|v| v.z == 0.0).count();
    // 500 vertices are about 0.12 apart; the boundary is 2 π long.
    assert!((40..70).contains(&on_boundary), "{on_boundary}");
    assert_eq!(open.sliding_curves.iter().map(|curve| curve.sliders.len()).sum::<usize>(), on_boundary);
}

#[test]
fn sliders_are_where_their_curve_is() {
    for name in ["box", "open-hemisphere"] {
        let made = remeshed(&sample(name).unwrap(), 700);
        for curve in &made.sliding_curves {
            assert!(curve.sliders.windows(2).all(|pair| pair[0].1 < pair[1].1), "{name}");
            for (v, arc_length) in &curve.sliders {
                let (at, _) = curve.line.at(*arc_length);
                assert!(at.distance(made.mesh.vertices[*v as usize]) < 1e-12, "{name}");
                assert!(made.fixed[*v as usize]);
            }
            // Evenly spread.
            let gaps: Vec<f64> = curve.sliders.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
            let mean = gaps.iter().sum::<f64>() / gaps.len().max(1) as f64;
            assert!(gaps.iter().all(|gap| (gap / mean - 1.0).abs() < 0.3), "{name}: {gaps:?}");
        }
    }
}

/// Three unit squares, each of 2 n² triangles, at one edge.
fn three_at_an_edge(n: u32) -> TriMesh {
    let mut list = TriMesh::default();
    let sheets = [DVec3::X, DVec3::new(-0.5, 0.8, 0.0), DVec3::new(-0.5, -0.8, 0.0)];
    for across in sheets {
        let first = list.vertices.len() as u32;
        for i in 0..=n {
            for j in 0..=n {
                let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(n));
                list.vertices.push(across * u + DVec3::Z * v);
            }
        }
        let at = |i: u32, j: u32| first + i * (n + 1) + j;
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                list.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    repair(&list).unwrap().mesh
}

#[test]
fn junctions_of_more_than_two_faces_are_kept() {
    let surface = three_at_an_edge(6);
    let before = topology(&surface);
    assert!(before.nonmanifold_edges == 6 && !before.is_manifold());
    for vertices in [30, 400] {
        let made = remeshed(&surface, vertices).mesh;
        let got = topology(&made);
        assert_eq!((got.vertices, got.euler, got.components), (vertices, before.euler, 1));
        assert_eq!(got.boundary_loops, before.boundary_loops);
        let on_axis = made.vertices.iter().filter(|v| v.x == 0.0 && v.y == 0.0).count();
        assert_eq!(got.nonmanifold_edges + 1, on_axis, "{vertices}");
    }
}

#[test]
fn needles_of_a_cad_model_do_not_show() {
    // A plate with a hole of 48 corners, whose top and bottom are fans of needles.
    let n = 48u32;
    let mut plate = TriMesh::default();
    for z in [0.0, 0.3] {
        for k in 0..n {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
            plate.vertices.push(DVec3::new(0.1 * angle.cos(), 0.1 * angle.sin(), z));
        }
        for [x, y] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
            plate.vertices.push(DVec3::new(x, y, z));
        }
    }
    let m = n + 4;
    for k in 0..n {
        let next = (k + 1) % n;
        let corner = n + k / 12;
        plate.triangles.extend([[next, k, corner], [m + k, m + next, m + corner]]);
        plate.triangles.extend([[k, next, m + next], [k, m + next, m + k]]);
        if k % 12 == 11 {
            let after = n + (k / 12 + 1) % 4;
            plate.triangles.extend([[next, corner, after], [m + corner, m + next, m + after]]);
            plate.triangles.extend([[after, corner, m + corner], [after, m + corner, m + after]]);
        }
    }
    let before = topology(&plate);
    assert!(before.is_closed_manifold() && before.genus == Some(1), "{before:?}");
    let made = remeshed(&plate, 1500).mesh;
    assert_eq!(kind(&topology(&made)), kind(&before));
    let shape = quality(&made).unwrap();
    assert!(shape.mean_quality > 0.87 && quality(&plate).unwrap().mean_quality < 0.4, "{shape:?}");
}

#[test]
fn pins_thinner_than_an_edge_are_kept() {
    // A cube with a needle of a hundredth of its size on top.
    let cube = sample("box").unwrap();
    let mut body = remeshed(&cube, 600).mesh;
    let top =
        body.triangles.iter().position(|t| t.iter().all(|v| body.vertices[*v as usize].z == 1.0)).unwrap();
    let [a, b, c] = body.triangles[top];
    let tip = body.vertices.len() as u32;
    let centre = body.corners(top).into_iter().sum::<DVec3>() / 3.0;
    body.vertices.push(centre + DVec3::Z);
    body.triangles[top] = [a, b, tip];
    body.triangles.extend([[b, c, tip], [c, a, tip]]);
    let made = remeshed(&body, 300).mesh;
    let distances = distances_sampled(&made, &body, 20_000, &ProgressToken::default()).unwrap();
    // Of a needle that is half as long as the diagonal.
    assert!(distances.hausdorff_from_reference < 5.0, "{distances:?}");
    assert_eq!(topology(&made).vertices, 300);
}

#[test]
fn lengths_that_differ_are_followed() {
    let surface = sample("sphere").unwrap();
    // Half as long on top.
    let lengths: Vec<f64> = surface.vertices.iter().map(|v| if v.z > 0.0 { 0.5 } else { 1.0 }).collect();
    let features = find_features(&surface, &FeatureOptions::new(0.1)).unwrap();
    let target = Target::new(&surface).in_patches(features.patches.clone());
    let options = LocalOptions { longest: 1.5, ..OPTIONS };
    let progress = ProgressToken::default();
    let start = LocalSurface::new(
        (&surface, &target),
        &features,
        (EdgeLengths { lengths: &lengths, maps: &[] }, 1000),
        &progress,
    )
    .unwrap();
    let made = start.remeshed(&options, &progress).unwrap();
    assert_eq!((made.mesh.vertices.len(), made.lengths.len()), (1000, 1000));
    let above = made.mesh.vertices.iter().filter(|v| v.z > 0.0).count();
    // Four times as many to a unit of area.
    assert!((700..870).contains(&above), "{above}");
}

#[test]
fn rods_as_thin_as_an_edge_become_even_gradually() {
    let rod = rod(96, 20.0);
    let spacing = spacing_of(&rod, 40).unwrap();
    let features = find_features(&rod, &FeatureOptions::new(spacing)).unwrap();
    let target = Target::new(&rod).in_patches(features.patches.clone());
    let progress = ProgressToken::default();
    let start =
        LocalSurface::new((&rod, &target), &features, (EdgeLengths::default(), 40), &progress).unwrap();
    let [plain, gradual] = [false, true].map(|gradual| {
        let made = start.remeshed(&LocalOptions { gradual, ..OPTIONS }, &progress).unwrap().mesh;
        assert_eq!(kind(&topology(&made)), kind(&topology(&rod)));
        assert_eq!(made.vertices.len(), 40);
        quality(&made).unwrap()
    });
    assert!(gradual.mean_quality > 0.7 && gradual.min_angle > 20.0, "{gradual:?}");
    assert!(plain.mean_quality < 0.6, "{plain:?}");
}

/// A rod of radius 1 along z with so many sides, each of two needles.
fn rod(sides: u32, length: f64) -> TriMesh {
    let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(sides);
    let ring = |z: f64| (0..sides).map(move |k| DVec3::new(angle(k).cos(), angle(k).sin(), z));
    let vertices = ring(0.0).chain(ring(length)).collect();
    let side = |k: u32| {
        let (a, b) = (k, (k + 1) % sides);
        [[a, b, b + sides], [a, b + sides, a + sides]]
    };
    let ends = (1..sides - 1).flat_map(|k| [[0, k + 1, k], [sides, sides + k, sides + k + 1]]);
    TriMesh { vertices, triangles: (0..sides).flat_map(side).chain(ends).collect() }
}

#[test]
fn fixed_points_stay_on_a_surface_that_is_much_finer() {
    let surface = sample("torus").unwrap();
    let progress = ProgressToken::default();
    let features = find_features(&surface, &FeatureOptions::new(1.0)).unwrap();
    let target = Target::new(&surface).in_patches(features.patches.clone());
    let mut start =
        LocalSurface::new((&surface, &target), &features, (EdgeLengths::default(), 60), &progress).unwrap();
    let edge = spacing_of(&surface, 60).unwrap();
    let points = [surface.vertices[17], surface.vertices[1000]];
    start.fix(points);
    for guarded in [false, true] {
        let made = start.remeshed(&LocalOptions { guarded, ..OPTIONS }, &progress).unwrap();
        assert_eq!(made.mesh.vertices.len(), 60);
        assert_eq!(made.fixed.iter().filter(|fixed| **fixed).count(), 2);
        for point in points {
            // What lies closer together than half an edge has become one vertex before.
            assert!(made.mesh.vertices.iter().any(|v| v.distance(point) < 0.5 * edge), "{point}");
        }
    }
}

#[test]
fn odd_meshes_survive_and_reruns_agree() {
    let triangle = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]);
    let bow = mesh(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.5], [0.0, -1.0, 0.5]],
        &[[0, 1, 2], [0, 3, 4]],
    );
    let mirrored =
        mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], &[[0, 1, 2], [1, 2, 3]]);
    let far = union(&sample("torus").unwrap(), &moved(&triangle, |v| v * 1e-3 + DVec3::splat(9.0)));
    for (name, odd) in [("triangle", triangle), ("bow", bow), ("mirrored", mirrored), ("far", far)] {
        for vertices in [4, 50, 200] {
            let made = remeshed(&odd, vertices);
            let (got, before) = (topology(&made.mesh), topology(&odd));
            assert!(got.vertices >= vertices, "{name} {vertices}");
            let counts = |t: &Topology| (t.components, t.euler, t.boundary_loops, t.nonmanifold_vertices);
            assert_eq!(counts(&got), counts(&before), "{name} {vertices}");
            assert_eq!(remeshed(&odd, vertices).mesh, made.mesh, "{name}");
        }
    }
    let (empty, progress) = (TriMesh::default(), ProgressToken::default());
    let target = Target::new(&empty);
    let start =
        LocalSurface::new((&empty, &target), &Features::default(), (EdgeLengths::default(), 10), &progress)
            .unwrap();
    assert_eq!(start.remeshed(&OPTIONS, &progress).unwrap().mesh, empty);
}

#[test]
fn cancelled_work_gives_no_mesh() {
    let progress = ProgressToken::default();
    progress.cancel();
    assert!(matches!(with_progress(&sample("torus").unwrap(), 100, &progress), Err(Error::Cancelled)));
}
