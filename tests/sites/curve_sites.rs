//! Sites on curves: their positions, their number, and the edges between them.

use crate::support::shapes::{cube, moved, plane};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::mesh::NONE;
use rtfmesh::mesh::features::{FeatureOptions, find_features};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::sizing::SizeField;
use rtfmesh::sites::curve_sites::CurveSites;
use rtfmesh::sites::on_surface::SitesOnSurface;
use rtfmesh::sites::place::Place;
use rtfmesh::sites::surface_curves::SurfaceCurves;

/// The curves of `mesh`, with the angle and spacing that features are looked for with.
fn curves(mesh: &TriMesh, angle: f64, spacing: f64) -> SurfaceCurves {
    let options = FeatureOptions { feature_angle: angle, ..FeatureOptions::new(spacing) };
    SurfaceCurves::new(&mesh.vertices, &mesh.triangles, &find_features(mesh, &options).unwrap()).unwrap()
}

/// The sites, after the checks that hold for all.
#[track_caller]
fn sites(mesh: &TriMesh, curves: &SurfaceCurves, spacing: f64) -> CurveSites {
    let sites = curves.sites(spacing);
    assert_eq!(sites, curves.sites(spacing), "placed another way the second time");
    let counts = curves.count(spacing);
    assert_eq!((sites.positions.len(), sites.segments.len()), (counts.sites, counts.segments));
    assert_eq!(sites.places.len(), sites.positions.len());
    for (position, place) in sites.positions.iter().zip(&sites.places) {
        match *place {
            Place::Vertex(v) => assert_eq!(*position, mesh.vertices[v as usize]),
            Place::Edge(t, side) => {
                let [a, b] = [side, (side + 1) % 3].map(|k| mesh.corners(t as usize)[k as usize]);
                let along = (*position - a).dot(b - a) / (b - a).length_squared();
                assert!(along > 0.0 && along < 1.0, "{position} is past an end");
                assert!(position.distance(a.lerp(b, along)) < 1e-15, "{position} is off its edge");
            }
            Place::Inside(_) => panic!("{position} is on no curve"),
        }
    }
    let mut edges: Vec<[u32; 2]> =
        sites.segments.iter().map(|[a, b]| [*a.min(b), *a.max(b)]).inspect(|[a, b]| assert!(a < b)).collect();
    edges.sort_unstable();
    edges.dedup();
    assert_eq!(edges.len(), sites.segments.len(), "an edge is doubled");
    sites
}

fn lengths(sites: &CurveSites) -> Vec<f64> {
    sites
        .segments
        .iter()
        .map(|s| sites.positions[s[0] as usize].distance(sites.positions[s[1] as usize]))
        .collect()
}

/// Triangles from the last point to all others, which go around it.
fn star(vertices: Vec<DVec3>) -> TriMesh {
    let rim = vertices.len() as u32 - 1;
    TriMesh { vertices, triangles: (0..rim).map(|k| [rim, k, (k + 1) % rim]).collect() }
}

/// A flat disc of `n` triangles.
fn disc(n: u32) -> TriMesh {
    let at = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
    star((0..n).map(|k| DVec3::new(at(k).cos(), at(k).sin(), 0.0)).chain([DVec3::ZERO]).collect())
}

#[test]
fn edges_of_a_cube_are_divided_evenly_between_their_corners() {
    let cube = cube();
    let found = curves(&cube, 40.0, 0.2);
    for (spacing, each) in [(0.2, 5), (0.19, 5), (0.7, 1), (5.0, 1)] {
        let sites = sites(&cube, &found, spacing);
        assert_eq!((sites.positions.len(), sites.segments.len()), (8 + 12 * (each - 1), 12 * each));
        assert!(
            lengths(&sites).iter().all(|l| (l * each as f64 - 1.0).abs() < 1e-12),
            "{:?}",
            lengths(&sites)
        );
        assert_eq!(found.count(spacing).sides, 24 * each);
    }
    // Both patches of an edge, all three of a corner.
    let sites = sites(&cube, &found, 0.2);
    for place in &sites.places {
        let mut patches: Vec<u32> = found.around(*place).iter().map(|t| found.patches[*t as usize]).collect();
        patches.sort_unstable();
        patches.dedup();
        assert_eq!(patches.len(), if matches!(place, Place::Vertex(_)) { 3 } else { 2 }, "{place:?}");
    }
}

#[test]
fn curves_of_one_edge_are_counted_as_they_are_divided() {
    // All edges of a tetrahedron are curves; the rim of a disc has bends.
    let mesh = sample("tetrahedron").unwrap();
    let even = curves(&mesh, 40.0, 0.2);
    let field = SizeField::new(mesh.clone(), vec![0.2, 1.0, 1.5, 4.0]);
    let sized = curves(&mesh, 40.0, 0.2).with_sizes(&field);
    let disc = disc(24);
    let round = curves(&disc, 40.0, 0.1);
    for (found, corners) in [(even, 4), (sized, 4), (round, 0)] {
        assert_eq!(found.corner_count(), corners);
        for k in 0..200 {
            let spacing = 0.01 * 1.03_f64.powi(k);
            let (counts, sites) = (found.count(spacing), found.sites(spacing));
            assert_eq!((counts.sites, counts.segments), (sites.positions.len(), sites.segments.len()), "{k}");
            let by_curve: usize = found.counts_by_curve(spacing).iter().sum();
            assert_eq!(counts.sites, corners + by_curve, "{k}");
        }
    }
}

#[test]
fn a_loop_without_corners_has_at_least_three_sites() {
    let disc = disc(160);
    let found = curves(&disc, 40.0, 0.3);
    assert_eq!((found.corner_count(), found.curve_count()), (0, 1));
    let around = 320.0 * (std::f64::consts::PI / 160.0).sin();
    // Chords between 8 sites would be too far from the circle.
    for (spacing, counts) in [(around / 160.0, 160..=160), (around / 8.0, 10..=13), (100.0, 3..=3)] {
        let sites = sites(&disc, &found, spacing);
        let count = sites.positions.len();
        assert!(counts.contains(&count) && sites.segments.len() == count, "{count} for {spacing}");
        assert_eq!(found.count(spacing).sides, count, "a boundary has one side");
    }
    // With as many sites as edges they are the vertices.
    let at_vertices = found.sites(around / 160.0);
    assert!(at_vertices.places.iter().all(|place| matches!(place, Place::Vertex(_))));
}

#[test]
fn arcs_are_equal_where_edges_are_not() {
    // A square's edge with vertices at odd places.
    let uneven = moved(&plane(7, 0.0), |v| DVec3::new(v.x * v.x, v.y * v.y, 0.0));
    let found = curves(&uneven, 40.0, 0.1);
    let sites = sites(&uneven, &found, 0.1);
    assert_eq!(sites.positions.len(), 40);
    assert!(lengths(&sites).iter().all(|l| (l - 0.1).abs() < 1e-6), "{:?}", lengths(&sites));
}

#[test]
fn short_curves_and_two_between_the_same_corners_double_no_edge() {
    // A lens: two sides between two sharp corners.
    let n = 12;
    let bow = |k: i32, up: f64| {
        let x = f64::from(k) / f64::from(n);
        DVec3::new(x, up * x * (1.0 - x), 0.0)
    };
    let points: Vec<DVec3> = (0..=n)
        .map(|k| bow(k, -1.0))
        .chain((1..n).rev().map(|k| bow(k, 1.0)))
        .chain([DVec3::new(0.5, 0.0, 0.0)])
        .collect();
    let lens = star(points);
    let found = curves(&lens, 40.0, 0.1);
    assert_eq!((found.corner_count(), found.curve_count()), (2, 2));
    assert_eq!(sites(&lens, &found, 10.0).positions.len(), 4, "one between on each side");
    // A curve that returns to its one corner.
    let drop: Vec<DVec3> = (0..24)
        .map(|k| {
            let t = std::f64::consts::TAU * f64::from(k) / 24.0;
            DVec3::new(t.cos(), t.sin() * (0.5 * t).sin().powi(2), 0.0)
        })
        .chain([DVec3::new(-0.2, 0.0, 0.0)])
        .collect();
    let drop = star(drop);
    let found = curves(&drop, 40.0, 0.2);
    assert_eq!((found.corner_count(), found.curve_count()), (1, 1));
    assert_eq!(sites(&drop, &found, 100.0).positions.len(), 3);
}

#[test]
fn surfaces_with_nothing_to_hold_have_no_curves() {
    let torus = sample("torus").unwrap();
    let found = find_features(&torus, &FeatureOptions::new(0.1)).unwrap();
    assert!(SurfaceCurves::new(&torus.vertices, &torus.triangles, &found).is_none());
}

#[test]
fn merged_sites_are_told_apart() {
    let cube = cube();
    let found = curves(&cube, 40.0, 0.2);
    let curve_sites = found.sites(0.5);
    let interior = SitesOnSurface {
        positions: vec![DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.5, 0.5, 1.0)],
        triangles: vec![1, 2],
    };
    let (merged, pins) = curve_sites.merge(&found, interior);
    assert_eq!(merged.len(), curve_sites.positions.len() + 2);
    let mut seen: Vec<u32> = pins.iter().copied().filter(|pin| *pin != NONE).collect();
    for (i, pin) in pins.iter().enumerate().filter(|(_, pin)| **pin != NONE) {
        assert_eq!(merged.positions[i], curve_sites.positions[*pin as usize]);
        assert!(found.around(curve_sites.places[*pin as usize]).contains(&merged.triangles[i]));
    }
    seen.sort_unstable();
    assert_eq!(seen, (0..curve_sites.positions.len() as u32).collect::<Vec<_>>());
}

#[test]
fn bends_that_even_sites_cut_off_get_one() {
    // A plane whose upper rim has a notch, less than a spacing wide.
    let mut sheet = plane(40, 0.0);
    let spacing = 0.22;
    for v in sheet.vertices.iter_mut().filter(|v| (v.y - 1.0).abs() < 1e-9) {
        v.y -= (0.04 - 0.4 * (v.x - 0.375).abs()).max(0.0);
    }
    let found = curves(&sheet, 40.0, spacing);
    let sites = sites(&sheet, &found, spacing);
    let lowest = sites
        .positions
        .iter()
        .filter(|p| p.y > 0.5 && p.x > 0.1 && p.x < 0.9)
        .map(|p| p.y)
        .fold(1.0, f64::min);
    assert!((lowest - 0.96).abs() < 1e-9, "the notch is cut off: {lowest}");
    // Where nothing bends they stand as before.
    let low = sites.positions.iter().filter(|p| p.y.abs() < 1e-9).count();
    assert_eq!(low, 1 + (1.0_f64 / spacing).round() as usize);
}

#[test]
fn teeth_get_sites_though_these_are_close_together() {
    // Teeth two thirds of a spacing wide on the rim of a disc.
    let spacing = 0.3;
    let rim = (0..7).flat_map(|tooth| {
        let begin = std::f64::consts::TAU * f64::from(tooth) / 7.0;
        let teeth = [(0.0, 0.0), (0.1, 0.056), (0.2, 0.0)];
        let rest = (3..9).map(|k| (0.1 * f64::from(k), 0.0));
        teeth.into_iter().chain(rest).map(move |(way, height)| {
            (1.0 + height) * DVec3::new((begin + way).cos(), (begin + way).sin(), 0.0)
        })
    });
    let rim: Vec<DVec3> = rim.collect();
    let disc = star(rim.iter().copied().chain([DVec3::ZERO]).collect());
    let found = curves(&disc, 40.0, spacing);
    assert_eq!(found.corner_count(), 0, "teeth are no corners");
    let sites = sites(&disc, &found, spacing);
    assert!(sites.positions.len() < 50, "{}", sites.positions.len());
    for point in &rim {
        let off = |[a, b]: &[u32; 2]| {
            let [a, b] = [a, b].map(|v| sites.positions[*v as usize]);
            let share = ((*point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            point.distance(a.lerp(b, share))
        };
        let nearest = sites.segments.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!(nearest <= 0.15 * spacing, "{point} is {nearest} off");
    }
}
