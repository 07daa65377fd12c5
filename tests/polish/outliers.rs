//! Outliers: the places farthest from the surface come closer, and nothing else gets worse.

use rtfmesh::mesh::distance::distances_sampled;
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, Outlier, OutlierOptions, ReducedOutliers, Target};
use rtfmesh::{ProgressToken, TriMesh};

use super::angles::{in_threads, odd_meshes, shaken};
use crate::support::passes::reduce_outliers;
use crate::support::shapes::sphere;

/// The typical edge of a mesh with even triangles.
fn edge(mesh: &TriMesh) -> f64 {
    let [a, b, _] = mesh.corners(0);
    a.distance(b)
}

/// A sphere with a vertex pulled out by this many edges, or pushed in if negative.
fn dented(edges: f64) -> (TriMesh, TriMesh) {
    let mesh = sphere(1.0, 5);
    let mut surface = mesh.clone();
    surface.vertices[700] *= 1.0 + edges * edge(&mesh);
    (mesh, surface)
}

fn hausdorff(mesh: &TriMesh, surface: &TriMesh) -> f64 {
    distances_sampled(mesh, surface, 40_000, &ProgressToken::default()).unwrap().hausdorff
}

#[test]
fn spikes_and_dents_are_reached() {
    for edges in [0.7, 0.4, -0.4, -0.7] {
        let (mesh, surface) = dented(edges);
        let mut reached = mesh.clone();
        let reduced =
            reduce_outliers(&mut reached, &Target::new(&surface), edge(&mesh), &OutlierOptions::default());
        let (before, after) = (hausdorff(&mesh, &surface), hausdorff(&reached, &surface));
        assert!(reduced.edits > 0 && after < 0.5 * before, "{edges}: {after} after {before}");
        assert_eq!(topology(&reached), topology(&mesh));
        assert!(intersecting_faces(&reached, &ProgressToken::default()).unwrap().is_empty());
        let (old, new) = (quality(&mesh).unwrap(), quality(&reached).unwrap());
        let least = OutlierOptions::default().min_angle.min(old.min_angle);
        assert!(new.min_angle >= least && new.fraction_above_90 <= old.fraction_above_90, "{edges}: {new:?}");
    }
}

#[test]
fn a_spike_between_vertices_is_reached() {
    // The surface has four times the triangles, so that the spike is at the middle of an edge.
    let (mesh, mut surface) = (sphere(1.0, 3), sphere(1.0, 4));
    let length = edge(&mesh);
    *surface.vertices.last_mut().unwrap() *= 1.0 + 0.6 * length;
    let mut reached = mesh.clone();
    reduce_outliers(&mut reached, &Target::new(&surface), length, &OutlierOptions::default());
    let (before, after) = (hausdorff(&mesh, &surface), hausdorff(&reached, &surface));
    assert!(after < 0.6 * before, "{after} after {before}");
}

#[test]
fn a_tolerance_makes_nearer_places_outliers() {
    // Less than the 0.15 edges that count as far without a tolerance.
    let (mesh, surface) = dented(0.1);
    let reached = |tolerance: f64| {
        let mut reached = mesh.clone();
        let options = OutlierOptions { tolerance, ..OutlierOptions::default() };
        let target = Target::new(&surface);
        reduce_outliers(&mut reached, &target, edge(&mesh), &options);
        hausdorff(&reached, &surface)
    };
    let before = hausdorff(&mesh, &surface);
    assert!(reached(f64::INFINITY) > 0.99 * before && reached(0.2 * edge(&mesh)) > 0.99 * before);
    assert!(reached(0.03 * edge(&mesh)) < 0.5 * before);
}

#[test]
fn what_is_met_or_fixed_stays() {
    let mesh = sample("torus").unwrap();
    let mut same = mesh.clone();
    assert_eq!(
        reduce_outliers(&mut same, &Target::new(&mesh), edge(&mesh), &OutlierOptions::default()),
        ReducedOutliers::default()
    );
    assert_eq!(same, mesh);
    let (mesh, surface) = dented(0.5);
    let mut same = ConstrainedMesh { fixed: vec![true; mesh.vertices.len()], ..mesh.clone().into() };
    let (target, options) = (Target::new(&surface), OutlierOptions::default());
    let progress = ProgressToken::default();
    let reduced =
        rtfmesh::polish::reduce_outliers(&mut same, &target, edge(&mesh), &options, &progress).unwrap();
    assert_eq!((reduced.edits, &same.mesh), (0, &mesh));
    // The dent is what is left.
    let left = reduced.left.first().expect("no outlier is left");
    assert!(left.at == surface.vertices[700] && (left.distance - 0.5 * edge(&mesh)).abs() < 1e-6, "{left:?}");
    let near = |other: &Outlier| other.at.distance(left.at) < edge(&mesh) && other.distance <= left.distance;
    assert!(reduced.left.iter().all(near), "{:?}", reduced.left);
}

#[test]
fn the_number_of_threads_does_not_show() {
    // Many outliers, so that there is work for all threads and edits are tried in vain.
    let (mesh, mut surface) = (shaken(&sphere(1.0, 4), 0.03), sphere(1.0, 5));
    surface.vertices.iter_mut().step_by(23).for_each(|v| *v *= 1.0 + 0.5 * edge(&mesh));
    let target = Target::new(&surface);
    let run = |threads| {
        let mut reached = mesh.clone();
        let reduce = || {
            let options = OutlierOptions { min_angle: 30.0, ..OutlierOptions::default() };
            reduce_outliers(&mut reached, &target, edge(&mesh), &options)
        };
        (in_threads(threads, reduce), reached)
    };
    let alone = run(1);
    // More than are tried together.
    assert!(alone.0.edits > 8, "{} edits", alone.0.edits);
    for threads in [2, 3, 8] {
        assert!(run(threads) == alone, "{threads} threads");
    }
}

#[test]
fn odd_meshes_survive() {
    let (_, surface) = dented(0.5);
    for (name, odd) in odd_meshes() {
        for target in [&odd, &surface, &TriMesh::default()] {
            let mut mesh = odd.clone();
            reduce_outliers(&mut mesh, &Target::new(target), 0.1, &OutlierOptions::default());
            assert_eq!(topology(&mesh), topology(&odd), "{name}");
            assert!(mesh.vertices.iter().all(|v| v.is_finite()), "{name}");
        }
    }
}
