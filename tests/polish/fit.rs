//! The fit: faces closer to the surface, and no triangle worse for it.

use glam::{DMat3, DVec3};
use rtfmesh::ProgressToken;
use rtfmesh::mesh::TriMesh;
use rtfmesh::mesh::distance::distances_sampled;
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::quality::quality;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::polish::{ConstrainedMesh, FitOptions, Target};

use super::angles::{in_threads, odd_meshes, shaken};
use crate::support::passes::fit;
use crate::support::shapes::{sphere, torus};

#[test]
fn coarse_meshes_come_closer() {
    let cases = [
        ("sphere", sphere(1.0, 6), sphere(1.0, 3), 0.55),
        ("torus", torus(150, 60), even_torus(32, 12), 0.55),
        ("shaken torus", torus(120, 50), shaken(&torus(40, 16), 0.004), 0.7),
    ];
    for (name, surface, coarse, most) in cases {
        let mut mesh = coarse.clone();
        fit(&mut mesh, &Target::new(&surface), &FitOptions::default());
        let rms = |mesh| distances_sampled(mesh, &surface, 20_000, &ProgressToken::default()).unwrap().rms;
        let (before, after) = (rms(&coarse), rms(&mesh));
        assert!(after < most * before, "{name}: {after} % after {before} %");
        assert_eq!(mesh.triangles, coarse.triangles, "{name}");
        assert!(intersecting_faces(&mesh, &ProgressToken::default()).unwrap().is_empty(), "{name}");
    }
}

/// A torus like [`torus`] with `n`, an even number, of rings turned by half a step every other, so that no
/// angle is right.
fn even_torus(n: u32, m: u32) -> TriMesh {
    let mut torus = torus(n, m);
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let turn = std::f64::consts::PI / f64::from(m);
    for (i, ring) in torus.vertices.chunks_mut(m as usize).enumerate().filter(|(i, _)| i % 2 == 1) {
        let middle = DMat3::from_rotation_z(std::f64::consts::TAU * i as f64 / f64::from(n)) * DVec3::X;
        let axis = DMat3::from_axis_angle(middle.cross(DVec3::Z), turn);
        ring.iter_mut().for_each(|p| *p = middle + axis * (*p - middle));
    }
    torus.triangles.clear();
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        let both = if i % 2 == 0 { [[p, q, s], [q, r, s]] } else { [[p, q, r], [p, r, s]] };
        torus.triangles.extend(both);
    }
    torus
}

#[test]
fn the_sphere_is_met_halfway() {
    // On the whole the faces then lie as far outside as inside.
    let (surface, mut mesh) = (sphere(1.0, 6), sphere(1.0, 3));
    fit(&mut mesh, &Target::new(&surface), &FitOptions::default());
    let mean = |weights: [f64; 3]| -> f64 {
        let radius =
            |t: usize| mesh.corners(t).iter().zip(weights).map(|(p, w)| *p * w).sum::<DVec3>().length();
        (0..mesh.triangles.len()).map(radius).sum::<f64>() / mesh.triangles.len() as f64 - 1.0
    };
    assert!(mean([1.0, 0.0, 0.0]) > 0.0);
    assert!(mean([1.0 / 3.0; 3]) < 0.0);
}

#[test]
fn small_angles_do_not_get_smaller() {
    let surface = sample("genus3").unwrap();
    let coarse = shaken(&surface, 0.01);
    for min_angle in [0.0, 20.0, 60.0] {
        let mut mesh = coarse.clone();
        let counts =
            fit(&mut mesh, &Target::new(&surface), &FitOptions { min_angle, ..FitOptions::default() });
        let (before, after) = (quality(&coarse).unwrap().min_angle, quality(&mesh).unwrap().min_angle);
        assert!(after >= before - 1e-9, "{min_angle}: {after} after {before}");
        assert!(min_angle < 60.0 || counts.held > 0);
    }
}

#[test]
fn boundaries_and_fixed_vertices_stay() {
    let surface = sample("open-hemisphere").unwrap();
    let start = shaken(&surface, 0.002);
    let fixed: Vec<bool> = start.vertices.iter().map(|p| p.x > 0.0).collect();
    let mut mesh = ConstrainedMesh { fixed: fixed.clone(), ..start.clone().into() };
    let (target, options) = (Target::new(&surface), FitOptions::default());
    rtfmesh::polish::fit(&mut mesh, &target, &options, &ProgressToken::default()).unwrap();
    let mesh = mesh.mesh;
    let stayed = |v: usize| mesh.vertices[v] == start.vertices[v];
    assert!((0..fixed.len()).all(|v| !fixed[v] || stayed(v)));
    assert!((0..fixed.len()).any(|v| !stayed(v)));
    let mut sides = std::collections::BTreeMap::new();
    for t in &start.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *sides.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let rim: Vec<u32> = sides.into_iter().filter(|(_, n)| *n == 1).flat_map(|((a, b), _)| [a, b]).collect();
    assert!(!rim.is_empty() && rim.iter().all(|&v| stayed(v as usize)));
}

#[test]
fn the_number_of_threads_does_not_show() {
    let surface = sample("genus3").unwrap();
    let target = Target::new(&surface);
    let run = |threads| {
        let mut mesh = shaken(&surface, 0.01);
        let counts = in_threads(threads, || {
            fit(&mut mesh, &target, &FitOptions { rounds: 2, ..FitOptions::default() })
        });
        (mesh, counts)
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn odd_meshes_survive() {
    for (name, odd) in odd_meshes() {
        let mut mesh = odd.clone();
        fit(&mut mesh, &Target::new(&odd), &FitOptions::default());
        assert_eq!(topology(&mesh), topology(&odd), "{name}");
        assert!(mesh.vertices.iter().all(|v| v.is_finite()), "{name}");
    }
}
