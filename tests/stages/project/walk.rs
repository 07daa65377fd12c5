//! `project/walk` by itself: where it ends, and what it does not cross.

use super::model::{Model, ROUNDING, fan};
use crate::reference::closest::onto_triangle;
use crate::support::{assert_valid, cloud, device, rounded, upload};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::features::{FeatureOptions, find_features};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::Surface;
use rtfmesh::sites::surface_curves::SurfaceCurves;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::records::TriangleRecords;

#[test]
fn a_step_is_found_by_walking_alone() {
    for name in ["torus", "genus3", "open-hemisphere"] {
        let model = Model::of(name);
        let (targets, from) = model.near(400, 2e-3, 7);
        let [walked, landed] = model.project(&targets, &from, 64);
        let excess = |i: usize| f64::from(walked.projected[i].w - landed.projected[i].w);
        let count = (0..targets.len()).filter(|i| excess(*i) > ROUNDING).count();
        let worst = (0..targets.len()).map(excess).fold(0.0, f64::max);
        // Where the triangles make a valley, its two sides can both be downhill.
        assert!(count <= 16 && worst < 2e-3, "{name}: {count} of 400 walks end up to {worst} too far away");
    }
}

#[test]
fn normals_do_not_vanish_where_the_mesh_folds() {
    // Two leaves on one another, sharing the vertices of their outline: the normals of the vertices cancel.
    let mut mesh = fan(6, 1.0);
    let back: Vec<[u32; 3]> = mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    mesh.triangles.extend(back);
    let model = Model::new(&mesh);
    let (targets, from) = model.near(100, 0.05, 11);
    for landed in model.project(&targets, &from, 64) {
        for (n, t) in landed.normals.iter().zip(&landed.under) {
            let own = model.surface.normals[*t as usize];
            assert!((n.length() - 1.0).abs() < 1e-5 && n.truncate().as_dvec3().dot(own) > 0.05, "{n}");
        }
    }
    // Across a fold nothing is connected but by the outline, and a walk stays on its leaf.
    let [walked, _] = model.project(&targets, &from, 64);
    let leaf = |t: u32| model.surface.origin[t as usize] / 6;
    assert!(walked.under.iter().zip(&from).all(|(to, from)| leaf(*to) == leaf(*from)));
}

#[test]
fn walks_end_in_their_patch_with_its_normal() {
    let mesh = sample("box").unwrap();
    let surface = Surface::new(&mesh, &UnitFrame::of(&mesh).unwrap());
    let found = find_features(&surface.mesh(), &FeatureOptions::new(0.1)).unwrap();
    let curves = SurfaceCurves::new(&surface.vertices, &surface.triangles, &found).unwrap();
    let records = TriangleRecords::new(device(), &surface, Some(&curves)).unwrap();
    let n = 1000;
    let targets = rounded(&cloud(n, 1.2, 7));
    let from: Vec<u32> = (0..n as u32).map(|i| i % 12).collect();
    let walk = Walk::new(device(), n, None).unwrap();
    let under = Buffer::from_slice(device(), "test.site_triangle", &from).unwrap();
    let mut recorder = Recorder::new(device()).unwrap();
    walk.record(&mut recorder, &upload("test.targets", &targets), &records, &under).unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    let (points, normals) =
        (walk.projected.to_vec(device()).unwrap(), walk.normals.to_vec(device()).unwrap());
    for (i, t) in under.to_vec(device()).unwrap().iter().enumerate() {
        let patch = curves.patches[from[i] as usize];
        assert_eq!(curves.patches[*t as usize], patch, "site {i} went over a curve");
        let sides = (0..12).filter(|t| curves.patches[*t] == patch);
        let nearest = sides
            .map(|t| onto_triangle(targets[i], surface.triangles[t].map(|v| surface.vertices[v as usize])))
            .min_by(|a, b| a.distance_squared(targets[i]).total_cmp(&b.distance_squared(targets[i])))
            .unwrap();
        let got = points[i].truncate().as_dvec3();
        assert!(got.distance(nearest) < 2e-6, "site {i}: {got} instead of {nearest}");
        let normal = normals[i].truncate().as_dvec3();
        assert!(normal.distance(surface.normals[*t as usize]) < 1e-4, "site {i}: {normal}");
    }
}

/// A strip of triangles along x.
fn strip(length: u32) -> TriMesh {
    let at = |i: u32| DVec3::new(0.5 * f64::from(i), f64::from(i % 2), 0.0);
    let triangle = |i: u32| if i.is_multiple_of(2) { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] };
    TriMesh { vertices: (0..length + 2).map(at).collect(), triangles: (0..length).map(triangle).collect() }
}

#[test]
fn walks_that_are_stopped_are_counted() {
    let model = Model::new(&strip(1000));
    // Where each triangle of the strip is on the surface.
    let mut place = vec![0; model.surface.origin.len()];
    (0..).zip(&model.surface.origin).for_each(|(t, origin)| place[*origin as usize] = t);
    let middle = |t: usize| model.corners[place[t] as usize].into_iter().sum::<DVec3>() / 3.0;
    // From the first triangle to one that is near, to one as far as a walk may go, and to two beyond.
    let targets: Vec<DVec3> = [3, 200, 300, 999].map(middle).to_vec();
    let [walked, _] = model.project(&targets, &[place[0]; 4], 64);
    assert_eq!(walked.normals.iter().map(|n| n.w).collect::<Vec<_>>(), [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(Walk::stopped(&walked.normals), 2);
    let under = |i: usize| model.surface.origin[walked.under[i] as usize];
    assert!(under(3) > 200 && under(3) < 300, "{:?}", walked.under);
    assert_eq!(under(1), 200);
}
