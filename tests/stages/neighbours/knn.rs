//! `neighbours/{tile_bounds, knn}` against sorting all distances.

use crate::reference::knn::nearest;
use crate::support::{assert_valid, cloud, device, lattice, lists, rounded, upload};
use glam::DVec3;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::neighbours::knn::{Nearest, TileBounds};

fn on_device(
    queries: &[DVec3],
    points: &[DVec3],
    k: u32,
    exclude_self: bool,
    workgroup: Option<u32>,
) -> Vec<Vec<u32>> {
    let device = device();
    let (q, p) = (upload("test.queries", queries), upload("test.points", points));
    let search = Nearest::new(device, "test.neighbours", queries.len(), k, exclude_self, workgroup).unwrap();
    let bounds = TileBounds::new(device, "test.bounds", points.len()).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    bounds.record(&mut recorder, &p).unwrap();
    search.record(&mut recorder, &q, &p, &bounds).unwrap();
    recorder.submit().unwrap();
    let found = lists(&search.neighbours.to_vec(device).unwrap(), queries.len());
    assert_valid(device);
    found
}

/// Equal up to the order of points whose distances f32 cannot tell apart.
fn assert_same_distances(
    queries: &[DVec3],
    points: &[DVec3],
    k: u32,
    exclude_self: bool,
    workgroup: Option<u32>,
) {
    let (queries, points) = (rounded(queries), rounded(points));
    let got = on_device(&queries, &points, k, exclude_self, workgroup);
    let want = nearest(&queries, &points, k as usize, exclude_self);
    assert_eq!(got.len(), want.len());
    for (q, (got, want)) in got.iter().zip(&want).enumerate() {
        assert_eq!(got.len(), want.len(), "query {q}");
        let mut once = got.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), got.len(), "query {q} lists a point twice");
        assert!(!exclude_self || !got.contains(&(q as u32)), "query {q} lists itself");
        for (g, w) in got.iter().zip(want) {
            let [g, w] = [g, w].map(|i| points[*i as usize].distance(queries[q]));
            assert!((g - w).abs() <= 1e-6 * w.max(f64::MIN_POSITIVE), "query {q}: {g} instead of {w}");
        }
    }
}

#[test]
fn sizes_around_the_workgroup() {
    for count in [0, 1, 15, 16, 17, 63, 64, 65, 128] {
        for workgroup in [16, 64] {
            let queries = cloud(count, 1.0, 5);
            assert_same_distances(&queries, &cloud(130, 1.0, 6), 8, false, Some(workgroup));
        }
    }
}

#[test]
fn sizes_around_the_tile() {
    for count in [1, 2, 33, 63, 64, 65, 127, 128, 129, 640] {
        let points = cloud(count, 1.0, count as u64);
        assert_same_distances(&points, &points, 8, true, None);
        assert_same_distances(&points[..1], &points, 48, false, None);
    }
}

#[test]
fn far_apart_and_unordered_points_are_all_considered() {
    // Every tile spans everything, and the queries lie outside the points.
    let points: Vec<_> = cloud(1000, 1.0, 7);
    let outside: Vec<_> = cloud(100, 1.0, 8).iter().map(|p| *p + DVec3::new(5.0, 0.0, 0.0)).collect();
    assert_same_distances(&outside, &points, 32, false, None);
    // Two distant clusters, tiny and huge.
    let mut two = cloud(200, 1e-6, 9);
    two.extend(cloud(200, 1e6, 10).iter().map(|p| *p + DVec3::splat(1e7)));
    assert_same_distances(&two, &two, 16, true, None);
}

#[test]
fn ties_go_to_the_lower_index() {
    let points = lattice(6);
    for workgroup in [16, 64] {
        let got = on_device(&points, &points, 20, true, Some(workgroup));
        assert_eq!(got, nearest(&points, &points, 20, true));
    }
    // All on one spot: the first ones win.
    let same = vec![DVec3::splat(0.25); 100];
    let got = on_device(&same, &same, 4, true, None);
    assert_eq!(got[0], [1, 2, 3, 4]);
    assert_eq!(got[2], [0, 1, 3, 4]);
    assert_eq!(got[99], [0, 1, 2, 3]);
}

#[test]
fn fewer_points_than_neighbours_leave_slots_empty() {
    let points = cloud(5, 1.0, 3);
    let got = on_device(&points, &points, 16, true, None);
    assert!(got.iter().all(|list| list.len() == 4));
    assert_eq!(on_device(&points[..1], &points[..1], 16, true, None), [[0_u32; 0]]);
}

#[test]
fn bounds_hold_their_tiles() {
    let device = device();
    for count in [1, 64, 65, 300] {
        let points = rounded(&cloud(count, 3.0, 11));
        let buffer = upload("test.points", &points);
        let tiles = TileBounds::new(device, "test.bounds", count).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        tiles.record(&mut recorder, &buffer).unwrap();
        recorder.submit().unwrap();
        let got = tiles.bounds.to_vec(device).unwrap();
        let want: Vec<_> = points
            .chunks(64)
            .flat_map(|tile| {
                let low = tile.iter().copied().reduce(DVec3::min).unwrap();
                let high = tile.iter().copied().reduce(DVec3::max).unwrap();
                [low, high]
            })
            .map(|c| c.as_vec3().extend(0.0))
            .collect();
        assert_eq!(got, want);
    }
    assert_valid(device);
}
