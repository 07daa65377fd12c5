//! `normals/smooth` and `step/settle` against their definitions.

use crate::reference::nearest::nearest;
use crate::reference::octahedral::{pack, unpack};
use crate::support::{assert_valid, cloud, device, on_sphere, rng, rounded, vec4};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::NONE;
use rtfmesh::stages::normals::SmoothNormals;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::step::Settle;

const RING: usize = 6;

fn smooth(normals: &[DVec3], near: &[Vec<u32>], workgroup: Option<u32>) -> Vec<DVec3> {
    let (device, n) = (device(), normals.len());
    let slots: Vec<u32> =
        (0..RING).flat_map(|s| near.iter().map(move |l| l.get(s).copied().unwrap_or(NONE))).collect();
    let packed: Vec<u32> = normals.iter().map(|n| pack(*n)).collect();
    let stage = SmoothNormals::new(device, n, false, workgroup).unwrap();
    let mut recorder = device.recorder().unwrap();
    let own = Buffer::from_slice(device, "test.surface_normals", &packed).unwrap();
    let lists = Buffer::from_slice(device, "test.neighbours", &slots).unwrap();
    let marks = Buffer::from_slice(device, "test.sites", &vec![Vec4::ZERO; n]).unwrap();
    stage.record(&mut recorder, &own, &lists, &marks).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    stage.normals.to_vec(device).unwrap().iter().map(|p| unpack(*p)).collect()
}

/// The mean of the normal and of those around it that are on its side; the other side's if all but one are.
fn mean(normals: &[DVec3], near: &[u32], site: usize) -> DVec3 {
    let around: Vec<DVec3> = near.iter().take(RING).map(|j| normals[*j as usize]).collect();
    let own = normals[site];
    let agreeing = around.iter().filter(|n| n.dot(own) > 0.0).count();
    let side = if around.len() >= 4 && agreeing < 2 { -own } else { own };
    (side + around.iter().filter(|n| n.dot(side) > 0.0).sum::<DVec3>()).normalize()
}

#[test]
fn normals_are_means_over_the_ring() {
    for (n, workgroup) in
        [(0, None), (1, None), (4, Some(8)), (63, None), (64, Some(8)), (65, None), (600, None)]
    {
        let (sites, normals) = on_sphere(n, 1);
        // Rough, and every ninth on a triangle that is folded back.
        let mut rng = rng(2);
        let rough: Vec<DVec3> = normals
            .iter()
            .enumerate()
            .map(|(i, n)| {
                let tilt = DVec3::from_array(std::array::from_fn(|_| rng.random::<f64>() - 0.5));
                unpack(pack((*n + tilt).normalize() * if i % 9 == 4 { -1.0 } else { 1.0 }))
            })
            .collect();
        let near = nearest(&sites, &sites, RING, true);
        for (i, got) in smooth(&rough, &near, workgroup).iter().enumerate() {
            let want = mean(&rough, &near[i], i);
            // A neighbour square to the normal may count or not.
            let close_call = near[i].iter().any(|j| rough[*j as usize].dot(rough[i]).abs() < 1e-4);
            assert!(close_call || got.distance(want) < 3e-4, "{n} sites: site {i}: {got} instead of {want}");
        }
    }
}

#[test]
fn settling_moves_the_sites_and_sums_the_steps_to_the_centroids() {
    let device = device();
    for (n, workgroup) in
        [(1, None), (16, Some(16)), (17, Some(16)), (63, None), (64, None), (65, None), (3000, None)]
    {
        let places = rounded(&cloud(n, 1.0, 3));
        let normals = on_sphere(n, 4).1;
        let steps: Vec<f64> = (0..n).map(|i| (i % 7) as f64 * 1e-3).collect();
        let targets: Vec<Vec4> =
            places.iter().zip(&steps).map(|(p, s)| p.as_vec3().extend((s * s) as f32)).collect();
        let walk = Walk::new(device, n, None).unwrap();
        let settle = Settle::new(device, n, 2, None, workgroup).unwrap();
        let sites = Buffer::<Vec4>::new(device, "test.sites", n).unwrap();
        let mut recorder = device.recorder().unwrap();
        recorder.upload(&walk.projected, &vec4(&places)).unwrap();
        recorder.upload(&walk.normals, &vec4(&normals)).unwrap();
        let targets = Buffer::from_slice(device, "test.targets", &targets).unwrap();
        settle.record(&mut recorder, &walk, &targets, &sites, 1).unwrap();
        recorder.submit().unwrap();
        assert_valid(device);
        assert_eq!(sites.to_vec(device).unwrap(), vec4(&places));
        for (got, want) in settle.surface_normals.to_vec(device).unwrap().iter().zip(&normals) {
            assert!(unpack(*got).distance(*want) < 1e-4);
        }
        let got = settle.history.to_vec(device).unwrap()[1];
        let rms = (steps.iter().map(|s| s * s).sum::<f64>() / n as f64).sqrt();
        let most = steps.iter().copied().fold(0.0, f64::max);
        assert!((f64::from(got.x) - rms).abs() < 1e-6, "{n}: {} instead of {rms}", got.x);
        assert!((f64::from(got.y) - most).abs() < 1e-6, "{n}: {} instead of {most}", got.y);
    }
}
