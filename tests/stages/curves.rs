//! The kernels on surfaces with curves: `normals/smooth`, `step/settle`, `face/planar` with marks, `step/keep_off`, and
//! `project/walk` between curves.

use crate::reference::centroid::area_centroid;
use crate::reference::face::{Face, face};
use crate::reference::marks::Mark;
use crate::reference::nearest::nearest;
use crate::reference::octahedral::{pack, unpack};
use crate::reference::surface::onto_triangle;
use crate::support::polygons::frame;
use crate::support::{assert_valid, cloud, device, on_sphere, rng, rounded, upload, vec4};
use glam::{DVec3, Vec2, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::NONE;
use rtfmesh::mesh::features::{FeatureOptions, find_features};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::surface::Surface;
use rtfmesh::sites::surface_curves::SurfaceCurves;
use rtfmesh::stages::face::planar::{PlanarFaces, PlanarInputs, PlanarMove, PlanarOptions};
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists};
use rtfmesh::stages::normals::SmoothNormals;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::records::TriangleRecords;
use rtfmesh::stages::step::{KeepOff, Settle};

const K: usize = 24;
const SPACING: f64 = 0.05;

/// Sites on a sphere in two patches, every fifth one on a curve.
struct Scene {
    positions: Vec<DVec3>,
    /// As the kernels have them.
    unit: Vec<DVec3>,
    marks: Vec<Mark>,
    near: Vec<Vec<u32>>,
    sites: Buffer<Vec4>,
    normals: Buffer<u32>,
    neighbours: Buffer<u32>,
    away: Buffer<Vec2>,
    status: Buffer<u32>,
    lists: Lists,
}

impl Scene {
    fn new(n: usize, seed: u64) -> Self {
        let (positions, mut normals) = on_sphere(n, seed);
        let positions = rounded(&positions);
        let mut rng = rng(seed);
        let marks: Vec<Mark> = (0..n)
            .map(|i| match i % 15 {
                4 => Mark::CORNER,
                9 | 14 => Mark::Pinned {
                    direction: normals[i].cross(DVec3::X + DVec3::Y).normalize(),
                    quarters: rng.random_range(1..8),
                    anywhere: i % 2 == 0,
                },
                _ => Mark::Interior(u32::from(positions[i].z > 0.0)),
            })
            .collect();
        // Some curve sites face the other way.
        (0..n).filter(|i| marks[*i].is_pinned() && i % 3 == 0).for_each(|i| normals[i] = -normals[i]);
        let packed: Vec<u32> = normals.iter().map(|n| pack(*n)).collect();
        let near = nearest(&positions, &positions, K + 1, true);
        let slots: Vec<u32> =
            (0..K).flat_map(|s| near.iter().map(move |l| l.get(s).copied().unwrap_or(NONE))).collect();
        let beyond = |i: usize, rank: usize| {
            let far = near[i].get(rank).map(|j| positions[*j as usize].distance(positions[i]));
            far.map_or(f32::INFINITY, |d| d as f32)
        };
        let away: Vec<Vec2> = (0..n).map(|i| Vec2::new(beyond(i, 14), beyond(i, K))).collect();
        let words: Vec<Vec4> =
            positions.iter().zip(&marks).map(|(p, mark)| p.as_vec3().extend(mark.encode())).collect();
        let sites = Buffer::from_slice(device(), "test.sites", &words).unwrap();
        let lists = Lists::new(device(), n, &ListOptions::new(K as u32)).unwrap();
        let mut recorder = device().recorder().unwrap();
        lists.record_build(&mut recorder, &sites).unwrap();
        recorder.submit().unwrap();
        Self {
            sites,
            lists,
            normals: Buffer::from_slice(device(), "test.normals", &packed).unwrap(),
            neighbours: Buffer::from_slice(device(), "test.neighbours", &slots).unwrap(),
            away: Buffer::from_slice(device(), "test.away", &away).unwrap(),
            status: Buffer::from_slice(device(), "test.status", &[0; 4]).unwrap(),
            unit: packed.iter().map(|n| unpack(*n)).collect(),
            positions,
            marks,
            near,
        }
    }

    fn inputs(&self) -> PlanarInputs<'_> {
        let Self { sites, normals, neighbours, away, status, lists, .. } = self;
        PlanarInputs { sites, normals, neighbours, away, status, tree: lists.tree() }
    }

    fn faces(&self, i: usize, j: usize) -> bool {
        self.marks[j].counts_anywhere() || self.unit[j].dot(self.unit[i]) > -0.2
    }

    /// The polygon of an interior site from all sites that count.
    fn want(&self, site: usize) -> Face {
        let Mark::Interior(patch) = self.marks[site] else { panic!("it needs no face") };
        let counts = |j: usize| j == site || (self.marks[j].is_in(patch) && self.faces(site, j));
        let counted: Vec<usize> = (0..self.positions.len()).filter(|j| counts(*j)).collect();
        let positions: Vec<DVec3> = counted.iter().map(|j| self.positions[*j]).collect();
        let (u, v) = frame(self.unit[site]);
        face(&positions, counted.iter().position(|j| *j == site).unwrap(), u, v, 2.0)
    }
}

#[test]
fn normals_are_means_over_interior_sites_of_the_patch() {
    for (n, workgroup) in [(0, None), (1, None), (63, Some(8)), (64, None), (65, Some(8)), (600, None)] {
        let scene = Scene::new(n, 1);
        let stage = SmoothNormals::new(device(), n, true, workgroup).unwrap();
        let mut recorder = device().recorder().unwrap();
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

#[test]
fn curve_sites_stay_and_only_the_others_count() {
    for (n, workgroup) in [(1, None), (15, Some(16)), (16, Some(16)), (17, Some(16)), (500, None)] {
        let scene = Scene::new(n, 2);
        let moving = scene.marks.iter().filter(|mark| !mark.is_pinned()).count();
        let places = rounded(&cloud(n, 1.0, 3));
        let step = |i: usize| if scene.marks[i].is_pinned() { 0.0 } else { (i % 7) as f64 * 1e-3 };
        let targets: Vec<Vec4> =
            places.iter().enumerate().map(|(i, p)| p.as_vec3().extend((step(i) * step(i)) as f32)).collect();
        let walk = Walk::new(device(), n, None).unwrap();
        let settle = Settle::new(device(), n, 1, Some(moving), workgroup).unwrap();
        let before = scene.sites.to_vec(device()).unwrap();
        let mut recorder = device().recorder().unwrap();
        recorder.upload(&walk.projected, &vec4(&places)).unwrap();
        recorder.upload(&walk.normals, &vec4(&scene.unit)).unwrap();
        recorder.upload(&settle.surface_normals, &vec![7; n]).unwrap();
        let targets = Buffer::from_slice(device(), "test.targets", &targets).unwrap();
        settle.record(&mut recorder, &walk, &targets, &scene.sites, 0).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        let normals = settle.surface_normals.to_vec(device()).unwrap();
        for (i, got) in scene.sites.to_vec(device()).unwrap().iter().enumerate() {
            if scene.marks[i].is_pinned() {
                assert_eq!((got, normals[i]), (&before[i], 7), "curve site {i} has moved");
            } else {
                assert_eq!(*got, places[i].as_vec3().extend(before[i].w), "site {i}");
            }
        }
        let got = settle.history.to_vec(device()).unwrap()[0];
        let rms = ((0..n).map(|i| step(i) * step(i)).sum::<f64>() / moving as f64).sqrt();
        assert!((f64::from(got.x) - rms).abs() < 1e-6, "{n}: {} instead of {rms}", got.x);
    }
}

#[test]
fn faces_are_cut_by_sites_of_the_patch_and_on_curves() {
    let scene = Scene::new(900, 4);
    let n = scene.positions.len();
    for workgroup in [None, Some(16)] {
        let options = PlanarOptions { workgroup, ..PlanarOptions::new(K as u32, 1) };
        let faces = PlanarFaces::new(device(), n, &options).unwrap();
        let step = PlanarMove { iteration: 0, momentum: 0.9, largest_move: 10.0, widest: 1.0, exact: true };
        let mut recorder = device().recorder().unwrap();
        faces.record(&mut recorder, &scene.inputs(), &step).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        let targets = faces.targets.to_vec(device()).unwrap();
        let mut compared = 0;
        for (i, target) in targets.iter().enumerate() {
            let got = target.truncate().as_dvec3();
            if scene.marks[i].is_pinned() {
                assert_eq!((got, target.w), (scene.positions[i], 0.0), "curve site {i} wants to move");
                continue;
            }
            let want = scene.want(i);
            // Wider ones go a part of the way only.
            if want.radius() > 0.44 {
                continue;
            }
            compared += 1;
            let (u, v) = frame(scene.unit[i]);
            let middle = area_centroid(&want.corners);
            let middle = scene.positions[i] + u * middle.x + v * middle.y;
            assert!(got.distance(middle) < 1e-6, "site {i}: {got} instead of {middle}");
        }
        assert!(compared > 400, "{compared} faces are not wide");
    }
}

/// Where the target `to` of an interior site may go: off the lines of the curve sites around, which have it at least at
/// 0.45 of how far they go on.
fn kept_off(scene: &Scene, lengths: &[f64], i: usize, to: DVec3) -> DVec3 {
    let (at, n) = (scene.positions[i], scene.unit[i]);
    let mut push = DVec3::ZERO;
    for j in scene.near[i].iter().take(12).map(|j| *j as usize) {
        let Some((direction, reach)) = scene.marks[j].line() else { continue };
        let reach = reach * SPACING * lengths[j];
        let across = |p: DVec3| p - scene.positions[j] - direction * (p - scene.positions[j]).dot(direction);
        let away = across(at) - n * across(at).dot(n);
        if !scene.faces(i, j) || away.length() < 1e-5 * SPACING {
            continue;
        }
        let away = away.normalize();
        let off = to - scene.positions[j];
        let missing = 0.45 * reach - off.dot(away);
        if off.dot(direction).abs() <= reach && missing > 0.0 {
            push += away * (missing - push.dot(away)).max(0.0);
        }
    }
    to + push
}

#[test]
fn targets_keep_off_curves() {
    let sizes = [(1, None), (63, Some(8)), (64, None), (65, None), (900, Some(16))];
    for ((n, workgroup), sized) in sizes.into_iter().flat_map(|size| [(size, false), (size, true)]) {
        let scene = Scene::new(n, 5);
        let mut rng = rng(8);
        let lengths: Vec<f32> =
            (0..n).map(|_| if sized { rng.random_range(0.5..2.0) } else { 1.0 }).collect();
        let on_device = Buffer::from_slice(device(), "test.lengths", &lengths).unwrap();
        let lengths: Vec<f64> = lengths.into_iter().map(f64::from).collect();
        let wanted: Vec<DVec3> =
            scene.positions.iter().zip(cloud(n, SPACING, 6)).map(|(p, off)| *p + off).collect();
        let wanted = rounded(&wanted);
        let targets = upload("test.targets", &wanted);
        let keep_off = KeepOff::new(device(), sized, workgroup).unwrap();
        let mut recorder = device().recorder().unwrap();
        let wished = sized.then_some(&on_device);
        keep_off.record(&mut recorder, &scene.inputs(), &targets, SPACING, wished).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        let mut moved = 0;
        for (i, got) in targets.to_vec(device()).unwrap().iter().enumerate() {
            let pinned = scene.marks[i].is_pinned();
            let want = if pinned { wanted[i] } else { kept_off(&scene, &lengths, i, wanted[i]) };
            let to = got.truncate().as_dvec3();
            assert!(to.distance(want) < 2e-4 * SPACING, "{n} sites: site {i}: {to} instead of {want}");
            if want != wanted[i] {
                moved += 1;
                let step_sq = want.distance_squared(scene.positions[i]) / lengths[i].powi(2);
                assert!((f64::from(got.w) - step_sq).abs() < 1e-6, "site {i}: squared step");
            }
        }
        assert!(n < 900 || moved > 50, "{moved} targets are too near to curves");
    }
}

#[test]
fn walks_end_in_their_patch_with_its_normal() {
    let mesh = sample("box").unwrap();
    let surface = Surface::new(device(), &mesh, &UnitFrame::of(&mesh).unwrap()).unwrap();
    let found = find_features(&mesh, &FeatureOptions::new(0.1)).unwrap();
    // The skeleton's vertices are the mesh's, which the surface has in another order.
    let mut place = vec![0; mesh.vertices.len()];
    for (from, to) in mesh.triangles.as_flattened().iter().zip(surface.triangles.as_flattened()) {
        place[*from as usize] = *to;
    }
    let mut found = found;
    found.curves.iter_mut().flat_map(|c| &mut c.vertices).for_each(|v| *v = place[*v as usize]);
    found.corners.iter_mut().for_each(|v| *v = place[*v as usize]);
    found.corners.sort_unstable();
    let curves = SurfaceCurves::new(&surface.vertices, &surface.triangles, &found).unwrap();
    let records = TriangleRecords::new(device(), &surface, Some(&curves)).unwrap();
    let n = 1000;
    let targets = rounded(&cloud(n, 1.2, 7));
    let from: Vec<u32> = (0..n as u32).map(|i| i % 12).collect();
    let walk = Walk::new(device(), n, None).unwrap();
    let under = Buffer::from_slice(device(), "test.site_triangle", &from).unwrap();
    let mut recorder = device().recorder().unwrap();
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
