//! Spikes: single vertices that stick out like needles, or into the surface.

use crate::support::shapes::{moved, plane, sphere, union};
use glam::{DVec2, DVec3};
use rtfmesh::TriMesh;
use rtfmesh::mesh::repair::{RepairOptions, Repaired, repair, repair_with};
use rtfmesh::mesh::samples::sample;
use std::f64::consts::TAU;

fn smoothed(mesh: &TriMesh) -> Repaired {
    repair_with(mesh, &RepairOptions::default().smooth_spikes(true)).unwrap()
}

#[test]
fn spikes_come_back_onto_a_sphere_and_nothing_else_moves() {
    let ball = sphere(1.0, 5);
    let spikes = [(5, 2.0), (300, 0.2), (800, 1.5), (2000, 6.0)];
    let mut spiked = ball.clone();
    spikes.iter().for_each(|(v, length)| spiked.vertices[*v] *= *length);
    let result = smoothed(&spiked);
    assert_eq!(result.counts.spikes_smoothed, spikes.len());
    assert_eq!(result.mesh.triangles, ball.triangles);
    for (v, (p, was)) in result.mesh.vertices.iter().zip(&ball.vertices).enumerate() {
        if spikes.iter().any(|(spike, _)| *spike == v) {
            // The largest values of all vertices of this sphere, whose edges are up to 0.16 long.
            let off = [(p.length() - 1.0).abs(), p.distance(*was)];
            assert!(off[0] < 0.0026 && off[1] < 0.034, "vertex {v} is {off:?} off");
        } else {
            assert_eq!(p, was, "vertex {v}");
        }
    }
}

#[test]
fn neighbouring_spikes_come_back_together() {
    let flat = plane(10, 0.0);
    let mut spiked = flat.clone();
    let inner: Vec<usize> =
        (0..flat.vertices.len()).filter(|v| flat.vertices[*v].distance(flat.vertices[60]) < 0.11).collect();
    assert!(inner.len() >= 2, "{inner:?}");
    let up = |v: usize| DVec3::Z * (3.0 + v as f64);
    inner[..2].iter().for_each(|v| spiked.vertices[*v] += up(*v));
    let result = smoothed(&spiked);
    assert_eq!(result.counts.spikes_smoothed, 2);
    let off = result.mesh.vertices.iter().map(|p| p.z.abs()).fold(0.0, f64::max);
    assert!(off < 1e-3, "{off}");
}

#[test]
fn corners_cones_and_boundaries_are_no_spikes() {
    // A cone with a half-angle of 6 degrees, on a disc.
    let count = 24;
    let rim = (0..count).map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(count)).extend(0.0));
    let mut vertices: Vec<DVec3> = rim.collect();
    vertices.extend([DVec3::Z * 10.0, DVec3::ZERO]);
    let side = |k: u32| [[k, (k + 1) % count, count], [(k + 1) % count, k, count + 1]];
    let cone = TriMesh { vertices, triangles: (0..count).flat_map(side).collect() };
    // Two that share their tip.
    let mut both = union(&cone, &moved(&cone, |p| DVec3::new(p.x, -p.y, 20.0 - p.z)));
    both.triangles.as_flattened_mut().iter_mut().filter(|v| **v == 2 * count + 2).for_each(|v| *v = count);
    let mut torn = plane(4, 0.0);
    torn.vertices[0].z = 30.0;
    for mesh in [cone, repair(&both).unwrap().mesh, torn, sample("box").unwrap(), sample("torus").unwrap()] {
        let result = smoothed(&mesh);
        assert_eq!((result.counts.spikes_smoothed, &result.mesh), (0, &mesh));
    }
}
