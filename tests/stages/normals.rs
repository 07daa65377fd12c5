//! `normals/plane_fit` against the closed form, and `normals/smooth` against its definition.

use crate::reference::knn::nearest;
use crate::reference::octahedral::{pack, unpack};
use crate::reference::pins::Mark;
use crate::reference::plane_fit::{Fit, plane_fit};
use crate::support::curve_scene::CurveScene;
use crate::support::{assert_valid, cloud, device, on_sphere, rng, rounded, slots, upload};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::blocks::{Block, Blocked};
use rtfmesh::stages::flags::FlagCounts;
use rtfmesh::stages::normals::{PlaneFit, SmoothNormals};

const RING: usize = 6;

/// Runs the kernel over exact neighbour lists; site i lies on a triangle with normal `surface[i]`.
fn on_device(sites: &[DVec3], k: u32, surface: &[DVec3], workgroup: Option<u32>) -> (Vec<DVec3>, Vec<u32>) {
    let device = device();
    let others = k as usize - 1;
    let neighbours = slots(&nearest(sites, sites, others, true), others);
    let own: Vec<u32> = (0..sites.len() as u32).collect();
    let fit = PlaneFit::new(device, sites.len(), k, workgroup).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    fit.record(
        &mut recorder,
        &upload("test.sites", sites),
        &Buffer::from_slice(device, "test.neighbours", &neighbours).unwrap(),
        &Buffer::from_slice(device, "test.site_triangle", &own).unwrap(),
        &upload("test.triangle_normals", surface),
    )
    .unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let normals: Vec<Vec4> = fit.normals.to_vec(device).unwrap();
    (normals.iter().map(|n| n.truncate().as_dvec3()).collect(), fit.flags.to_vec(device).unwrap())
}

/// The fits of the reference for every site and its neighbours.
fn fits(sites: &[DVec3], k: u32) -> Vec<Fit> {
    let lists = nearest(sites, sites, k as usize - 1, true);
    let points = |i: usize| -> Vec<DVec3> {
        std::iter::once(sites[i]).chain(lists[i].iter().map(|j| sites[*j as usize])).collect()
    };
    (0..sites.len()).map(|i| plane_fit(&points(i))).collect()
}

fn assert_fits(sites: &[DVec3], k: u32, workgroup: Option<u32>) {
    let sites = rounded(sites);
    let want = fits(&sites, k);
    // The surface leans 27 degrees away, now on one side, now on the other.
    let lean = |(i, f): (usize, &Fit)| {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        (f.normal + 0.5 * f.normal.any_orthonormal_vector()).normalize() * side
    };
    let surface: Vec<DVec3> =
        want.iter().enumerate().map(|f| if f.1.normal == DVec3::ZERO { DVec3::Z } else { lean(f) }).collect();
    let (normals, flags) = on_device(&sites, k, &surface, workgroup);
    for (i, want) in want.iter().enumerate() {
        let [low, middle, high] = want.eigenvalues;
        assert!((normals[i].length() - 1.0).abs() < 1e-5, "site {i}: not a unit vector: {}", normals[i]);
        if middle <= 1e-4 * high {
            continue;
        }
        // Where two eigenvalues are close, the directions mix: f32 resolves them to its rounding over the
        // gap.
        let gap = (middle - low) / high;
        if gap < 1e-3 {
            continue;
        }
        assert_eq!(flags[i], 0, "site {i}");
        assert!(normals[i].dot(surface[i]) >= 0.0, "site {i} points away from the surface's side");
        let sine = normals[i].cross(want.normal).length();
        assert!(sine <= 2e-5 / gap, "site {i}: off by {sine}, gap {gap}");
    }
}

#[test]
fn planes_across_the_surface_give_way_to_its_normal() {
    let sites = rounded(&on_sphere(200, 9).0);
    let surface: Vec<DVec3> = fits(&sites, 16).iter().map(|f| f.normal.any_orthonormal_vector()).collect();
    let (normals, flags) = on_device(&sites, 16, &surface, None);
    assert_eq!(FlagCounts::of(&flags).surface_normal_taken, 200);
    assert!(normals.iter().zip(&surface).all(|(n, s)| n.distance(*s) < 1e-6));
}

#[test]
fn spheres_and_clouds() {
    assert_fits(&on_sphere(500, 1).0, 16, None);
    assert_fits(&cloud(300, 1.0, 2), 16, None);
    assert_fits(&cloud(300, 1.0, 2), 3, None);
    // Scale does not matter, nor does one flat direction.
    assert_fits(&cloud(200, 1e-5, 3), 12, None);
    let flat: Vec<_> = cloud(200, 1.0, 4).iter().map(|p| DVec3::new(p.x, p.y, 0.25)).collect();
    assert_fits(&flat, 16, None);
}

#[test]
fn sizes_around_the_workgroup() {
    for count in [0, 1, 15, 16, 17, 63, 64, 65] {
        for workgroup in [16, 64] {
            assert_fits(&on_sphere(count, 5).0, 8, Some(workgroup));
        }
    }
}

#[test]
fn collinear_and_single_points_take_the_normal_of_the_surface() {
    let surface = DVec3::new(0.0, 0.6, 0.8);
    let line: Vec<_> = (0..40).map(|i| DVec3::new(0.01 * f64::from(i), 0.0, 0.0)).collect();
    let spot = vec![DVec3::splat(0.1); 40];
    for sites in [line, spot, vec![DVec3::X]] {
        let (normals, flags) = on_device(&sites, 8, &vec![surface; sites.len()], None);
        assert!(normals.iter().all(|n| n.distance(surface) < 1e-6), "{normals:?}");
        assert_eq!(FlagCounts::of(&flags).surface_normal_taken, sites.len());
    }
}

fn smooth(normals: &[DVec3], near: &[Vec<u32>], workgroup: Option<u32>, block: usize) -> Vec<DVec3> {
    let (device, n) = (device(), normals.len());
    let packed: Vec<u32> = normals.iter().map(|n| pack(*n)).collect();
    let stage = SmoothNormals::new(device, n, false, workgroup).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    let own = Buffer::from_slice(device, "test.surface_normals", &packed).unwrap();
    let blocks = Block::divide(n, block);
    let lists = Blocked::from_slice(device, "test.neighbours", &blocks, &slots(near, RING)).unwrap();
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
        let smoothed = smooth(&rough, &near, workgroup, n);
        // In several blocks it is the same.
        assert_eq!(smooth(&rough, &near, workgroup, n / 3 + 1), smoothed, "{n} sites");
        for (i, got) in smoothed.iter().enumerate() {
            let want = mean(&rough, &near[i], i);
            // A neighbour square to the normal may count or not.
            let close_call = near[i].iter().any(|j| rough[*j as usize].dot(rough[i]).abs() < 1e-4);
            assert!(close_call || got.distance(want) < 3e-4, "{n} sites: site {i}: {got} instead of {want}");
        }
    }
}

#[test]
fn normals_are_means_over_interior_sites_of_the_patch() {
    for (n, workgroup) in [(0, None), (1, None), (63, Some(8)), (64, None), (65, Some(8)), (600, None)] {
        let scene = CurveScene::in_blocks(n, 1, n / 2 + 1);
        let stage = SmoothNormals::new(device(), n, true, workgroup).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        stage.record(&mut recorder, &scene.normals, &scene.neighbours, &scene.sites).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        for (i, got) in stage.normals.to_vec(device()).unwrap().iter().enumerate() {
            let mut want = scene.unit[i];
            if let mark @ Mark::Interior(_) = scene.marks[i] {
                let ring = scene.near[i].iter().take(6).map(|j| *j as usize);
                want += ring.filter(|j| scene.marks[*j] == mark).map(|j| scene.unit[j]).sum::<DVec3>();
            }
            assert!(unpack(*got).distance(want.normalize()) < 3e-4, "{n} sites: site {i}");
        }
    }
}
