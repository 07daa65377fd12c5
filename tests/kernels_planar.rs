//! `face/planar` and `face/polygons` against the intersection of half-planes in f64, and against `face/cell`.

use crate::reference::centroid::area_centroid;
use crate::reference::face::{Face, face};
use crate::reference::nearest::nearest;
use crate::reference::octahedral;
use crate::shapes_of_faces::{assert_same_polygon, frame};
use crate::support::{assert_valid, device, on_sphere, rounded, upload};
use glam::{DVec2, DVec3, Vec2, Vec4};
use rtfmesh::gpu::{Buffer, NONE};
use rtfmesh::stages::planar::{NEAR, PlanarFaces, PlanarInputs, PlanarMove, PlanarPolygons};

/// Sites with all that the kernels read.
struct Scene {
    positions: Vec<DVec3>,
    unit: Vec<DVec3>,
    reach: Vec<Vec2>,
    sites: Buffer<Vec4>,
    normals: Buffer<u32>,
    neighbours: Buffer<u32>,
    reach_on_device: Buffer<Vec2>,
    status: Buffer<u32>,
    k: usize,
}

impl Scene {
    fn new(positions: &[DVec3], normals: &[DVec3], k: usize) -> Self {
        let positions = rounded(positions);
        let packed: Vec<u32> = normals.iter().map(|n| octahedral::pack(*n)).collect();
        // The normals as the kernels have them.
        let unit: Vec<DVec3> = packed.iter().map(|n| octahedral::unpack(*n)).collect();
        let n = positions.len();
        let found = nearest(&positions, &positions, n, true);
        let slots: Vec<u32> =
            (0..k).flat_map(|s| found.iter().map(move |l| l.get(s).copied().unwrap_or(NONE))).collect();
        let beyond = |i: usize, rank: usize| {
            let far = found[i].get(rank).map(|j| positions[*j as usize].distance(positions[i]));
            far.map_or(f32::INFINITY, |d| d as f32)
        };
        let reach: Vec<Vec2> =
            (0..n).map(|i| Vec2::new(beyond(i, k.min(NEAR as usize)), beyond(i, k))).collect();
        Self {
            sites: upload("test.sites", &positions),
            normals: Buffer::from_slice(device(), "test.normals", &packed).unwrap(),
            neighbours: Buffer::from_slice(device(), "test.neighbours", &slots).unwrap(),
            reach_on_device: Buffer::from_slice(device(), "test.reach", &reach).unwrap(),
            status: Buffer::from_slice(device(), "test.status", &[0; 4]).unwrap(),
            positions,
            unit,
            reach,
            k,
        }
    }

    fn inputs(&self) -> PlanarInputs<'_> {
        PlanarInputs {
            sites: &self.sites,
            normals: &self.normals,
            neighbours: &self.neighbours,
            away: &self.reach_on_device,
            status: &self.status,
        }
    }

    /// The polygon of `site` from the maths, in a cube of half edge `far`: sites whose normals turn away left out.
    fn want(&self, site: usize, far: f64) -> Face {
        let counted: Vec<usize> = (0..self.positions.len())
            .filter(|j| *j == site || self.unit[*j].dot(self.unit[site]) > -0.2)
            .collect();
        let positions: Vec<DVec3> = counted.iter().map(|j| self.positions[*j]).collect();
        let (u, v) = frame(self.unit[site]);
        let place = counted.iter().position(|j| *j == site).unwrap();
        let mut found = face(&positions, place, u, v, far);
        found.behind.iter_mut().flatten().for_each(|j| *j = counted[*j as usize] as u32);
        found
    }
}

/// Corners and fans of all sites, and whether they are secure.
fn polygons(scene: &Scene, workgroup: Option<u32>) -> Vec<(Vec<DVec2>, Vec<u32>, bool)> {
    let n = scene.positions.len();
    let run = PlanarPolygons::new(device(), n, scene.k as u32, workgroup).unwrap();
    let mut recorder = device().recorder().unwrap();
    run.record(&mut recorder, &scene.inputs(), 1.0).unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    let counts = run.corner_count.to_vec(device()).unwrap();
    let (corners, fan) = (run.corners.to_vec(device()).unwrap(), run.fan.to_vec(device()).unwrap());
    let secure = run.secure.to_vec(device()).unwrap();
    let slots = |i: usize| (0..counts[i] as usize).map(move |s| s * n + i);
    (0..n)
        .map(|i| {
            let corners = slots(i).map(|s| corners[s].as_dvec2()).collect();
            (corners, slots(i).map(|s| fan[s]).collect(), secure[i] == 1)
        })
        .collect()
}

fn assert_faces(scene: &Scene) -> usize {
    let got = polygons(scene, None);
    assert_eq!(got, polygons(scene, Some(8)));
    for (i, (corners, fan, secure)) in got.iter().enumerate() {
        let want = scene.want(i, 2.0);
        if *secure {
            assert_same_polygon(i, corners, fan, &want);
        } else {
            // What is left open is known: the true face reaches past the radius of security.
            let far = want.radius() * 2.0 > f64::from(scene.reach[i].y) * (1.0 - 1e-4);
            let open = want.behind.iter().any(Option::is_none) || want.corners.is_empty();
            assert!(far || open, "site {i} is secure, but was not recognised");
        }
    }
    got.iter().filter(|(_, _, secure)| !*secure).count()
}

fn step(momentum: f32) -> PlanarMove {
    PlanarMove { iteration: 0, momentum, largest_move: 10.0, widest: 1.0 }
}

#[test]
fn sites_on_a_sphere() {
    let (positions, normals) = on_sphere(900, 1);
    let insecure = assert_faces(&Scene::new(&positions, &normals, 24));
    assert!(insecure < 90, "{insecure} of 900 random sites need more than 24 neighbours");
}

#[test]
fn any_number_of_sites() {
    for n in [1, 2, 4, 63, 64, 65] {
        let (positions, normals) = on_sphere(n, 2);
        assert_faces(&Scene::new(&positions, &normals, 20));
    }
}

#[test]
fn lattices_and_sites_on_one_spot() {
    // Every four neighbours on a circle, and each bisector parallel to three others.
    let mut positions: Vec<DVec3> =
        (0..144).map(|i| DVec3::new(f64::from(i % 12), f64::from(i / 12), 0.0) / 16.0 - 0.4).collect();
    let up = vec![DVec3::Z; 144];
    let inner: Vec<usize> =
        (0..144).filter(|i| (2..10).contains(&(i % 12)) && (2..10).contains(&(i / 12))).collect();
    let scene = Scene::new(&positions, &up, 24);
    let got = polygons(&scene, None);
    for &i in &inner {
        assert!(got[i].2, "site {i}");
        assert_same_polygon(i, &got[i].0, &got[i].1, &scene.want(i, 2.0));
    }
    // Of two sites on one spot each keeps half of the square.
    positions[65] = positions[66];
    let got = polygons(&Scene::new(&positions, &up, 24), None);
    let area = |i: usize| {
        let c: &[DVec2] = &got[i].0;
        0.5 * (0..c.len()).map(|m| c[m].perp_dot(c[(m + 1) % c.len()])).sum::<f64>()
    };
    // Together they fill what one of them would: a square, and a triangle of the gap that the other left.
    assert!((area(65) + area(66) - 1.25 / 256.0).abs() < 1e-6, "{} {}", area(65), area(66));
    assert!(area(65).min(area(66)) > 0.4 / 256.0);
}

#[test]
fn the_back_of_a_sheet_does_not_count() {
    let (front, normals) = on_sphere(500, 3);
    let back: Vec<DVec3> = front.iter().map(|p| *p * 0.98).collect();
    let positions: Vec<DVec3> = front.iter().chain(&back).copied().collect();
    let normals: Vec<DVec3> = normals.iter().copied().chain(normals.iter().map(|n| -*n)).collect();
    let scene = Scene::new(&positions, &normals, 32);
    for (i, (_, fan, _)) in polygons(&scene, None).iter().enumerate() {
        assert!(fan.iter().all(|j| (*j < 500) == (i < 500)), "site {i} sees the other side: {fan:?}");
    }
}

#[test]
fn targets_are_centroids_and_momentum_adds_the_last_motion() {
    let (positions, normals) = on_sphere(700, 4);
    let scene = Scene::new(&positions, &normals, 24);
    let n = positions.len();
    let faces = PlanarFaces::new(device(), n, 24, 4, false, None).unwrap();
    let run = |momentum: f32, iteration: u32| {
        let mut recorder = device().recorder().unwrap();
        faces.record(&mut recorder, &scene.inputs(), &PlanarMove { iteration, ..step(momentum) }).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        faces.targets.to_vec(device()).unwrap()
    };
    let first = run(0.9, 0);
    let polygons = polygons(&scene, None);
    let mut insecure = 0;
    for i in 0..n {
        if !polygons[i].2 {
            insecure += 1;
            continue;
        }
        let (u, v) = frame(scene.unit[i]);
        let middle = area_centroid(&scene.want(i, 2.0).corners);
        let want = scene.positions[i] + u * middle.x + v * middle.y;
        let got = first[i].truncate().as_dvec3();
        assert!(got.distance(want) < 1e-6, "site {i}: {got} instead of {want}");
        assert!((f64::from(first[i].w) - middle.length_squared()).abs() < 1e-6, "site {i}: squared step");
    }
    let counts = faces.insecure.to_vec(device()).unwrap();
    assert_eq!(counts[4] as usize, insecure, "sites whose lists do not decide");
    assert!(counts[0] as usize > insecure, "sites that the first {NEAR} do not decide");
    // The sites stayed, so the last motion is nothing, and the targets are the same.
    assert_eq!(run(0.9, 1), first);
}

#[test]
fn the_longest_move_is_kept() {
    let (positions, normals) = on_sphere(300, 5);
    let scene = Scene::new(&positions, &normals, 24);
    let faces = PlanarFaces::new(device(), 300, 24, 1, false, Some(16)).unwrap();
    let mut recorder = device().recorder().unwrap();
    faces.record(&mut recorder, &scene.inputs(), &PlanarMove { largest_move: 1e-3, ..step(0.0) }).unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    for (i, target) in faces.targets.to_vec(device()).unwrap().iter().enumerate() {
        let moved = target.truncate().as_dvec3().distance(scene.positions[i]);
        assert!(moved < 1.001e-3, "site {i} moved {moved}");
    }
}
