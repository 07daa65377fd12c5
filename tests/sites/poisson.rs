//! Poisson-disk points: far enough apart, and without gaps.

use glam::DVec3;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::poisson::{Disks, disks};
use rtfmesh::sites::surface::Surface;
use rtfmesh::{Error, ProgressToken, TriMesh};
use std::time::{Duration, Instant};

fn on(mesh: &TriMesh) -> Surface {
    Surface::new(mesh, &UnitFrame::of(mesh).unwrap())
}

fn scattered(surface: &Surface, count: usize, seed: u64) -> Disks {
    disks(surface, count, seed, &ProgressToken::default()).unwrap()
}

fn distance(p: DVec3, points: &[DVec3]) -> f64 {
    points.iter().map(|q| p.distance_squared(*q)).fold(f64::INFINITY, f64::min).sqrt()
}

/// Points of the surface with gaps of at most `step` between them.
fn dense(surface: &Surface, step: f64) -> Vec<DVec3> {
    let corners = |t: &[u32; 3]| t.map(|v| surface.vertices[v as usize]);
    let grid = |[a, b, c]: [DVec3; 3]| {
        let n = ((b - a).length().max((c - a).length()).max((c - b).length()) / step).ceil().max(1.0) as u32;
        (0..=n).flat_map(move |i| {
            (0..=n - i).map(move |j| a + ((b - a) * f64::from(i) + (c - a) * f64::from(j)) / f64::from(n))
        })
    };
    surface.triangles.iter().map(corners).flat_map(grid).collect()
}

#[test]
fn points_keep_their_distance_and_cover_the_surface() {
    let cases =
        [("sphere", 400), ("box", 300), ("open-hemisphere", 200), ("two-components", 350), ("torus", 900)];
    let small = [("sphere", 1), ("sphere", 4), ("torus", 10), ("tetrahedron", 30)];
    for (name, count) in cases.into_iter().chain(small) {
        let surface = on(&sample(name).unwrap());
        let Disks { sites, summary } = scattered(&surface, count, 3);
        assert_eq!((sites.positions.len(), sites.triangles.len()), (count, count), "{name}");
        for (i, p) in sites.positions.iter().enumerate() {
            let apart = distance(*p, &sites.positions[i + 1..]);
            assert!(apart >= summary.radius * (1.0 - 1e-12), "{name} {count}: {apart}, {summary:?}");
            let t = sites.triangles[i] as usize;
            let a = surface.vertices[surface.triangles[t][0] as usize];
            assert!((*p - a).dot(surface.normals[t]).abs() < 1e-12, "{name}: point {i} is off its triangle");
        }
        for p in dense(&surface, 0.1 * summary.covered) {
            let apart = distance(p, &sites.positions);
            assert!(apart <= summary.covered * (1.0 + 1e-12), "{name} {count}: {apart}, {summary:?}");
        }
        if count >= 30 {
            assert!(summary.covered < 1.05 * summary.radius, "{name} {count}: {summary:?}");
            assert!(summary.added <= 3 + count / 50, "{name} {count}: {summary:?}");
        }
    }
}

#[test]
fn a_seed_has_its_points() {
    let surface = on(&sample("torus").unwrap());
    let points = |seed| scattered(&surface, 250, seed).sites.positions;
    assert_eq!(points(1), points(1));
    assert_ne!(points(1), points(2));
}

#[test]
fn it_can_be_cancelled() {
    let surface = on(&sample("torus").unwrap());
    let begin = Instant::now();
    scattered(&surface, 5000, 1);
    let tenth = begin.elapsed();
    let progress = ProgressToken::default();
    let (found, after) = std::thread::scope(|scope| {
        let canceller = scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(10));
            progress.cancel();
            Instant::now()
        });
        let found = disks(&surface, 50_000, 1, &progress);
        (found, canceller.join().unwrap().elapsed())
    });
    assert!(matches!(found, Err(Error::Cancelled)));
    // All of it would take ten times as long.
    assert!(after < 3 * tenth, "{after:?} after it was cancelled; a tenth takes {tenth:?}");
}
