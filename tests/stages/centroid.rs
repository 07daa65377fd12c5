//! `centroid/{vertex, area}` against both middles of the faces in f64.

use crate::reference::centroid::{area_centroid, vertex_mean};
use crate::reference::face::face;
use crate::support::cell_faces::{DeviceFaces, device_faces};
use crate::support::polygons::frame;
use crate::support::{assert_valid, cloud, device, on_sphere, rounded, spacing_on_sphere};
use glam::{DVec2, DVec3};
use rtfmesh::Centroid;
use rtfmesh::stages::centroid::Centroids;
use rtfmesh::stages::face::cell::{BOX_HALF, CellOptions};

fn targets(of: &DeviceFaces, kind: Centroid) -> Vec<DVec3> {
    let device = device();
    let stage = Centroids::new(device, of.sites.len(), kind, Some(16)).unwrap();
    let mut recorder = device.recorder().unwrap();
    stage.record(&mut recorder, &of.sites, &of.normals, &of.faces).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    stage.targets.to_vec(device).unwrap().iter().map(|p| p.truncate().as_dvec3()).collect()
}

fn assert_centroids(sites: &[DVec3], normals: &[DVec3], options: &CellOptions) {
    let (sites, normals) = (rounded(sites), rounded(normals));
    let faces = device_faces(&sites, &normals, options);
    let (vertex, area) = (targets(&faces, Centroid::Vertex), targets(&faces, Centroid::Area));
    for i in 0..sites.len() {
        let (u, v) = frame(normals[i]);
        let want = face(&sites, i, u, v, BOX_HALF * options.spacing);
        if want.corners.is_empty() {
            continue;
        }
        let at = |c: DVec2| sites[i] + u * c.x + v * c.y;
        let (size, corners) = (want.radius(), &faces.corners[i]);
        let mean = at(vertex_mean(corners));
        // Whether two corners count as one is a threshold, which rounding may pass.
        let close_call = (0..corners.len()).any(|m| {
            let before = corners[(m + corners.len() - 1) % corners.len()];
            (corners[m].distance(before) / (0.2 * size) - 1.0).abs() < 1e-4
        });
        assert!(close_call || vertex[i].distance(mean) < 1e-5 * size + 1e-7, "site {i}: vertex mean");
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
    let vertex = targets(&faces, Centroid::Vertex);
    assert!(vertex[20].distance(vertex[150]) > 0.2 * spacing, "they stay together");
}

#[test]
fn sites_without_a_face_stay_in_place() {
    let (sites, normals) = on_sphere(200, 9);
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let paper = CellOptions::paper(32, spacing_on_sphere(200));
    for options in [CellOptions { max_planes: 10, ..paper }, CellOptions { max_triangles: 8, ..paper }] {
        let faces = device_faces(&sites, &normals, &options);
        let (vertex, area) = (targets(&faces, Centroid::Vertex), targets(&faces, Centroid::Area));
        let without: Vec<usize> = (0..200).filter(|i| faces.flags[*i] & 3 != 0).collect();
        assert!(without.len() > 150);
        assert!(without.iter().all(|i| vertex[*i] == sites[*i] && area[*i] == sites[*i]));
    }
}
