//! `normals/plane_fit` against the closed form.

use crate::reference::nearest::nearest;
use crate::reference::plane_fit::{Fit, plane_fit};
use crate::support::{assert_valid, cloud, device, on_sphere, rounded, upload};
use glam::{DVec3, Vec4};
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::NONE;
use rtfmesh::stages::face::cell::FlagCounts;
use rtfmesh::stages::normals::PlaneFit;

/// Runs the kernel over exact neighbour lists; site i lies on a triangle with normal `surface[i]`.
fn on_device(sites: &[DVec3], k: u32, surface: &[DVec3], workgroup: Option<u32>) -> (Vec<DVec3>, Vec<u32>) {
    let device = device();
    let slots = k as usize - 1;
    let found = nearest(sites, sites, slots, true);
    let neighbours: Vec<u32> =
        (0..slots).flat_map(|s| found.iter().map(move |l| l.get(s).copied().unwrap_or(NONE))).collect();
    let own: Vec<u32> = (0..sites.len() as u32).collect();
    let fit = PlaneFit::new(device, sites.len(), k, workgroup).unwrap();
    let mut recorder = device.recorder().unwrap();
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
        // Where two eigenvalues are close, the directions mix: f32 resolves them to its rounding over the gap.
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
fn lines_and_single_spots_take_the_normal_of_the_surface() {
    let surface = DVec3::new(0.0, 0.6, 0.8);
    let line: Vec<_> = (0..40).map(|i| DVec3::new(0.01 * f64::from(i), 0.0, 0.0)).collect();
    let spot = vec![DVec3::splat(0.1); 40];
    for sites in [line, spot, vec![DVec3::X]] {
        let (normals, flags) = on_device(&sites, 8, &vec![surface; sites.len()], None);
        assert!(normals.iter().all(|n| n.distance(surface) < 1e-6), "{normals:?}");
        assert_eq!(FlagCounts::of(&flags).surface_normal_taken, sites.len());
    }
}
