//! `centroid/{corners, weighted_corners, area}` against the means and middles of the faces in f64.

use crate::reference::centroid::{area_centroid, corner_mean, weighted_corner_mean};
use crate::reference::face::face;
use crate::support::cell_faces::{DeviceFaces, device_faces};
use crate::support::polygons::frame;
use crate::support::{assert_valid, cloud, device, on_sphere, rounded, spacing_on_sphere};
use glam::{DVec2, DVec3};
use rtfmesh::gpu::Recorder;
use rtfmesh::options::Centroid;
use rtfmesh::stages::centroid::Centroids;
use rtfmesh::stages::face::cell::{BOX_HALF, CellOptions};

fn targets(of: &DeviceFaces, kind: Centroid) -> Vec<DVec3> {
    let device = device();
    let stage = Centroids::new(device, of.sites.len(), kind, Some(16)).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    stage.record(&mut recorder, &of.sites, &of.normals, &of.faces).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    stage.targets.to_vec(device).unwrap().iter().map(|p| p.truncate().as_dvec3()).collect()
}

fn assert_centroids(sites: &[DVec3], normals: &[DVec3], options: &CellOptions) {
    let (sites, normals) = (rounded(sites), rounded(normals));
    let faces = device_faces(&sites, &normals, options);
    let [corners_of, weighted, area] =
        [Centroid::Corners, Centroid::WeightedCorners, Centroid::Area].map(|kind| targets(&faces, kind));
    for i in 0..sites.len() {
        let (u, v) = frame(normals[i]);
        let want = face(&sites, i, u, v, BOX_HALF * options.spacing);
        if want.corners.is_empty() {
            continue;
        }
        let at = |c: DVec2| sites[i] + u * c.x + v * c.y;
        let (size, corners) = (want.radius(), &faces.corners[i]);
        // Means of the corners that the kernel got: rounding may split one of them in two.
        for (got, mean) in [(&corners_of, corner_mean(corners)), (&weighted, weighted_corner_mean(corners))] {
            assert!(got[i].distance(at(mean)) < 1e-5 * size + 1e-7, "site {i}: mean of the corners");
        }
        let middle = at(area_centroid(&want.corners));
        assert!(area[i].distance(middle) < 3e-5 * size + 1e-7, "site {i}: area centroid");
    }
}

#[test]
fn targets_are_the_middles_of_the_faces() {
    let (sites, normals) = on_sphere(700, 1);
    for k in [4, 32] {
        assert_centroids(&sites, &normals, &CellOptions::paper(k, spacing_on_sphere(700)));
    }
    assert_centroids(&cloud(400, 0.9, 3), &on_sphere(400, 4).1, &CellOptions::paper(48, 0.15));
    let lattice: Vec<_> = (0..400)
        .map(|i| DVec3::new(f64::from(i % 20) / 32.0 - 0.3, f64::from(i / 20) / 32.0 - 0.3, 0.1))
        .collect();
    assert_centroids(&lattice, &vec![DVec3::Z; 400], &CellOptions::paper(32, 1.0 / 32.0));
    let line: Vec<_> = (0..40).map(|i| DVec3::new(0.01 * f64::from(i) - 0.2, 0.0, 0.0)).collect();
    assert_centroids(&line, &vec![DVec3::Z; 40], &CellOptions::paper(32, 0.01));
}

#[test]
fn sizes_around_the_workgroup() {
    for count in [0, 1, 2, 7, 8, 9, 15, 16, 17, 33] {
        let (sites, normals) = on_sphere(count, 6);
        assert_centroids(&sites, &normals, &CellOptions::paper(32, spacing_on_sphere(count)));
    }
}

#[test]
fn coincident_sites_part() {
    let (mut sites, mut normals) = on_sphere(200, 8);
    sites[150] = sites[20];
    normals[150] = normals[20];
    let spacing = spacing_on_sphere(200);
    let faces = device_faces(&rounded(&sites), &rounded(&normals), &CellOptions::paper(32, spacing));
    for kind in [Centroid::Corners, Centroid::WeightedCorners] {
        let got = targets(&faces, kind);
        assert!(got[20].distance(got[150]) > 0.2 * spacing, "{kind:?}: they stay together");
    }
}

#[test]
fn sites_without_a_face_stay_in_place() {
    let (sites, normals) = on_sphere(200, 9);
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let paper = CellOptions::paper(32, spacing_on_sphere(200));
    for options in [CellOptions { max_planes: 10, ..paper }, CellOptions { max_triangles: 8, ..paper }] {
        let faces = device_faces(&sites, &normals, &options);
        let without: Vec<usize> = (0..200).filter(|i| faces.flags[*i] & 3 != 0).collect();
        assert!(without.len() > 150);
        for kind in [Centroid::Corners, Centroid::WeightedCorners, Centroid::Area] {
            let got = targets(&faces, kind);
            assert!(without.iter().all(|i| got[*i] == sites[*i]), "{kind:?}");
        }
    }
}

#[test]
fn corners_close_together_count_twice_or_less() {
    // Of the four sites around a corner, one is a little nearer: the corner splits in two.
    let mut sites: Vec<DVec3> = (0..81)
        .map(|i| DVec3::new(f64::from(i % 9) / 16.0 - 0.25, f64::from(i / 9) / 16.0 - 0.25, 0.0))
        .collect();
    sites[50] -= DVec3::new(2e-4, 2e-4, 0.0);
    let sites = rounded(&sites);
    let faces = device_faces(&sites, &[DVec3::Z; 81], &CellOptions::paper(32, 1.0 / 16.0));
    let split = &faces.corners[40];
    assert_eq!(split.len(), 5, "{split:?}");
    let [mean, weighted] =
        [Centroid::Corners, Centroid::WeightedCorners].map(|kind| targets(&faces, kind)[40]);
    let (u, v) = frame(DVec3::Z);
    let literal = split.iter().sum::<DVec2>() / 5.0;
    assert!(mean.distance(sites[40] + u * literal.x + v * literal.y) < 1e-6);
    // The corner at (1/32, 1/32) is counted twice, which moves the mean by a fifth of it.
    assert!((mean - sites[40]).length() > 0.19 / 32.0 * 2_f64.sqrt());
    assert!((weighted - sites[40]).length() < 0.02 / 32.0 * 2_f64.sqrt());
}
