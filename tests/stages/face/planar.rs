//! `face/{planar, planar_rest, planar_exact, polygons}` against the intersection of all half-planes in f64,
//! and against `face/cell`: whatever the length of the lists, and however far the sites have moved since
//! these were made.

use crate::reference::centroid::area_centroid;
use crate::reference::face::{Face, face};
use crate::reference::octahedral;
use crate::support::curve_scene::{CurveScene, K};
use crate::support::polygons::{area, assert_same_polygon, frame};
use crate::support::{assert_valid, cloud, device, on_sphere, rng, rounded, upload, vec4};
use glam::{DVec2, DVec3, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::face::cell::{CellFaces, CellOptions};
use rtfmesh::stages::face::planar::{PlanarCounts, PlanarFaces, PlanarInputs, PlanarMove, PlanarOptions};
use rtfmesh::stages::face::polygons::PlanarPolygons;
use rtfmesh::stages::neighbours::knn::TileBounds;
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists};
use rtfmesh::stages::site_layout::SiteLayout;

/// Faces that reach farther than this share of the largest radius give a fifth of the way.
const WIDE: f64 = 0.45;

/// Sites with all that the kernels read.
struct Scene {
    positions: Vec<DVec3>,
    unit: Vec<DVec3>,
    sites: Buffer<Vec4>,
    normals: Buffer<u32>,
    lists: Lists,
    k: u32,
    layout: SiteLayout,
    /// No face reaches farther.
    widest: f64,
}

impl Scene {
    fn new(positions: &[DVec3], normals: &[DVec3], k: u32, widest: f64) -> Self {
        Self::with(positions, normals, widest, &ListOptions::new(k))
    }

    fn with(positions: &[DVec3], normals: &[DVec3], widest: f64, options: &ListOptions) -> Self {
        let positions = rounded(positions);
        let packed: Vec<u32> = normals.iter().map(|n| octahedral::pack(*n)).collect();
        let lists = Lists::new(device(), positions.len(), options).unwrap();
        let words = options.layout.pack(&vec4(&positions));
        let sites = Buffer::from_slice(device(), "test.sites", &words).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        lists.record_build(&mut recorder, &sites).unwrap();
        recorder.submit().unwrap();
        Self {
            normals: Buffer::from_slice(device(), "test.normals", &packed).unwrap(),
            // The normals as the kernels have them.
            unit: packed.iter().map(|n| octahedral::unpack(*n)).collect(),
            positions,
            sites,
            lists,
            k: options.k,
            layout: options.layout,
            widest,
        }
    }

    /// The sites move, and the lists stay.
    fn walk(&mut self, step: f64, seed: u64) {
        let mut rng = rng(seed);
        let mut off = || DVec3::from_array(std::array::from_fn(|_| step * (rng.random::<f64>() - 0.5)));
        let moved: Vec<DVec3> = self.positions.iter().map(|p| *p + off()).collect();
        self.positions = rounded(&moved);
        let mut recorder = Recorder::new(device()).unwrap();
        recorder.upload(&self.sites, &vec4(&self.positions)).unwrap();
        self.lists.record_refresh(&mut recorder, &self.sites, 0.5).unwrap();
        recorder.submit().unwrap();
        assert_eq!(self.lists.status.to_vec(device()).unwrap()[2], 1, "the lists were made anew");
    }

    fn inputs(&self) -> PlanarInputs<'_> {
        PlanarInputs::new(&self.sites, &self.normals, &self.lists)
    }

    fn options(&self) -> PlanarOptions {
        PlanarOptions { layout: self.layout, ..PlanarOptions::new(self.k, 4) }
    }

    /// The polygon of `site` from the maths, among all sites but those whose normals turn away; in a cube
    /// that is larger than the disc.
    fn want(&self, site: usize) -> Face {
        let counted: Vec<usize> = (0..self.positions.len())
            .filter(|j| *j == site || self.unit[*j].dot(self.unit[site]) > -0.2)
            .collect();
        let (at, (u, v)) = (self.positions[site], frame(self.unit[site]));
        // Sites on one spot part along u, by index.
        let apart = |j: usize| 1e-9 * u * f64::from((site as i32 - j as i32).signum());
        let place_of = |j: usize| if self.positions[j] == at { at + apart(j) } else { self.positions[j] };
        let positions: Vec<DVec3> = counted.iter().map(|j| place_of(*j)).collect();
        let place = counted.iter().position(|j| *j == site).unwrap();
        let mut found = face(&positions, place, u, v, 2.0 * self.widest);
        found.behind.iter_mut().flatten().for_each(|j| *j = counted[*j as usize] as u32);
        found
    }

    /// The first site on the spot of site j.
    fn first_at(&self, j: u32) -> u32 {
        self.positions.iter().position(|p| *p == self.positions[j as usize]).unwrap() as u32
    }

    /// None where rounding decides.
    fn is_open(&self, want: &Face) -> Option<bool> {
        let far = if want.corners.is_empty() { f64::INFINITY } else { want.radius() / self.widest };
        ((far - 1.0).abs() > 1e-3).then_some(far > 1.0)
    }
}

/// Corners, fan and state of every site.
type Polygon = (Vec<DVec2>, Vec<u32>, u32);

fn polygons(scene: &Scene, options: &PlanarOptions) -> Vec<Polygon> {
    let n = scene.positions.len();
    let run = PlanarPolygons::new(device(), n, options).unwrap();
    let mut recorder = Recorder::new(device()).unwrap();
    run.record(&mut recorder, &scene.inputs(), scene.widest as f32).unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    let counts = run.corner_count.to_vec(device()).unwrap();
    let (corners, fan) = (run.corners.to_vec(device()).unwrap(), run.fan.to_vec(device()).unwrap());
    let state = run.state.to_vec(device()).unwrap();
    let slots = |i: usize| (0..counts[i] as usize).map(move |s| s * n + i);
    (0..n)
        .map(|i| {
            let corners = slots(i).map(|s| corners[s].as_dvec2()).collect();
            (corners, slots(i).map(|s| fan[s]).collect(), state[i])
        })
        .collect()
}

/// Every polygon is that of the maths; gives the number of open ones.
fn assert_faces(scene: &Scene) -> usize {
    let options = PlanarOptions { slots: 20, ..scene.options() };
    let got = polygons(scene, &options);
    assert_eq!(got, polygons(scene, &PlanarOptions { workgroup: Some(8), ..options }));
    for (i, (corners, fan, state)) in got.iter().enumerate() {
        let mut want = scene.want(i);
        if let Some(open) = scene.is_open(&want) {
            // Between two sites on its spot a site has no room.
            let size = want.radius();
            let nothing = area(&want.corners) < 1e-6 * size * size;
            assert!(nothing || *state == u32::from(open), "site {i}: {state}, but the face reaches {size}");
            if nothing {
                assert!(area(corners).abs() < 2e-6 * size * size, "site {i}: area");
            } else if !open {
                // Either of two sites on one spot is behind their line.
                let first = |j: &u32| scene.first_at(*j);
                let fan: Vec<u32> = fan.iter().map(first).collect();
                want.behind.iter_mut().flatten().for_each(|j| *j = first(j));
                assert_same_polygon(i, corners, &fan, &want);
                assert!((area(corners) - area(&want.corners)).abs() <= 1e-5 * size * size, "site {i}: area");
            }
        }
    }
    got.iter().filter(|(_, _, state)| *state == 1).count()
}

fn step(momentum: f32, widest: f64) -> PlanarMove {
    PlanarMove {
        iteration: 0,
        momentum,
        largest_move: 10.0,
        widest: widest as f32,
        exact_within: PlanarMove::ALL,
    }
}

fn targets(scene: &Scene, options: &PlanarOptions) -> (Vec<Vec4>, PlanarCounts) {
    let faces = PlanarFaces::new(device(), &scene.lists.neighbours.blocks(), options).unwrap();
    let mut recorder = Recorder::new(device()).unwrap();
    faces.record(&mut recorder, &scene.inputs(), &step(0.0, scene.widest)).unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    let counts = faces.counts(0).unwrap();
    (faces.targets.to_vec(device()).unwrap(), counts)
}

/// The targets of all closed faces are the centroids from the maths.
fn assert_targets(scene: &Scene, options: &PlanarOptions) -> PlanarCounts {
    let (got, counts) = targets(scene, options);
    let others = targets(scene, &PlanarOptions { workgroup: Some(16), ..*options });
    assert_eq!(counts, others.1);
    for (i, (a, b)) in got.iter().zip(&others.0).enumerate() {
        assert_eq!(a, b, "site {i}");
    }
    let (mut open, mut unsure) = (0, 0);
    let nothing = |want: &Face| area(&want.corners) < 1e-6 * want.radius().powi(2);
    for (i, got) in got.iter().enumerate() {
        let want = scene.want(i);
        match scene.is_open(&want) {
            None => unsure += 1,
            _ if nothing(&want) => unsure += 1,
            Some(true) => open += 1,
            Some(false) => {
                let middle = area_centroid(&want.corners);
                let (u, v) = frame(scene.unit[i]);
                let reach = want.radius() / scene.widest;
                let share = if reach > WIDE { 0.2 } else { 1.0 };
                let goal = scene.positions[i] + share * (u * middle.x + v * middle.y);
                let off = got.truncate().as_dvec3().distance(goal);
                // A sliver's centroid is a quotient of small numbers; at the limit of wide faces rounding
                // decides.
                let sliver = area(&want.corners) < 1e-3 * want.radius().powi(2);
                let close_call = sliver || (reach / WIDE - 1.0).abs() < 1e-4;
                let tolerance = 1e-4 * want.radius() + 1e-6;
                assert!(
                    close_call || off < tolerance,
                    "site {i}: {off} off its centroid, of {}",
                    want.radius()
                );
                let length = f64::from(got.w).sqrt();
                assert!(sliver || (length - middle.length()).abs() < tolerance, "site {i}: squared step");
            }
        }
    }
    assert!((open..=open + unsure).contains(&counts.open), "{counts:?}, but {open} are open");
    counts
}

/// In the unit square of the plane.
fn in_plane(count: usize, seed: u64) -> Vec<DVec3> {
    cloud(count, 0.9, seed).iter().map(|p| DVec3::new(p.x, p.y, 0.1)).collect()
}

/// In the plane, with distances that shrink to a twentieth in patches.
fn clustered(count: usize, seed: u64) -> Vec<DVec3> {
    let mut sites = in_plane(count / 4, seed);
    for (patch, centre) in in_plane(3, seed + 1).into_iter().enumerate() {
        let dense = cloud(count / 4, 0.045 * 3.0_f64.sqrt(), seed + 2 + patch as u64);
        sites.extend(dense.iter().map(|p| centre + DVec3::new(p.x, p.y, 0.0)));
    }
    sites
}

/// Scenes by name: sites, normals, largest radius.
fn scenes() -> Vec<(&'static str, Vec<DVec3>, Vec<DVec3>, f64)> {
    let up = |sites: &[DVec3]| vec![DVec3::Z; sites.len()];
    let (sphere, out) = on_sphere(600, 1);
    let plane = in_plane(500, 2);
    let clusters = clustered(600, 3);
    let mut doubled = in_plane(200, 4);
    doubled.extend_from_within(50..100);
    doubled.extend_from_within(50..60);
    let line: Vec<DVec3> = cloud(120, 0.9, 5).iter().map(|p| DVec3::new(p.x, 0.2, 0.1)).collect();
    let mut rows: Vec<DVec3> =
        (0..120).map(|i| DVec3::new(0.01 * f64::from(i % 40), 0.2 * f64::from(i / 40), 0.0)).collect();
    rows.extend((0..20).map(|i| DVec3::new(0.02 * f64::from(i), 0.1, 0.0)));
    vec![
        ("sphere", sphere, out, 0.2),
        ("plane", plane.clone(), up(&plane), 0.2),
        ("clusters", clusters.clone(), up(&clusters), 0.4),
        ("doubled", doubled.clone(), up(&doubled), 0.3),
        ("line", line.clone(), up(&line), 0.1),
        ("rows", rows.clone(), up(&rows), 0.3),
    ]
}

#[test]
fn without_the_walk_undecided_faces_are_what_the_list_makes_of_them() {
    for (name, sites, normals, widest) in scenes() {
        let scene = Scene::new(&sites, &normals, 8, widest);
        let options = scene.options();
        let (exact, counts) = targets(&scene, &options);
        let faces = PlanarFaces::new(device(), &scene.lists.neighbours.blocks(), &options).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        let step = PlanarMove { exact_within: 0.0, ..step(0.0, widest) };
        faces.record(&mut recorder, &scene.inputs(), &step).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        let got = faces.targets.to_vec(device()).unwrap();
        assert_eq!(faces.counts(0).unwrap().undecided_by_list, 0, "{name}");
        let differ = (0..got.len()).filter(|i| got[*i] != exact[*i]).count();
        assert!(differ <= counts.undecided_by_list, "{name}: {differ} differ, {counts:?}");
        let far = |i: usize| f64::from(got[i].truncate().distance(exact[i].truncate()));
        assert!((0..got.len()).all(|i| far(i) <= 2.0 * widest), "{name}");
    }
}

#[test]
fn faces_are_exact_with_short_lists() {
    for (name, sites, normals, widest) in scenes() {
        for k in [6, 24] {
            println!("{name}, lists of {k}");
            let scene = Scene::new(&sites, &normals, k, widest);
            assert_faces(&scene);
            let counts = assert_targets(&scene, &scene.options());
            assert!(k > 6 || counts.undecided_by_list > 20, "{name}: {counts:?}");
        }
    }
}

/// As along a needle whose sites are far closer together than those that bound its faces.
#[test]
fn faces_far_beyond_their_lists_stay_open_where_they_may() {
    // Four rows: faces are open at the outer ones, and reach 3 to 6 times as far as the lists.
    let (_, sites, normals, widest) = scenes().pop().unwrap();
    let scene = Scene::new(&sites, &normals, 8, widest);
    let left_to_the_walk = [0.0, 1.0, 4.0, PlanarMove::ALL].map(|exact_within| {
        let faces = PlanarFaces::new(device(), &scene.lists.neighbours.blocks(), &scene.options()).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        let step = PlanarMove { exact_within, ..step(0.0, widest) };
        faces.record(&mut recorder, &scene.inputs(), &step).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        faces.counts(0).unwrap().undecided_by_list
    });
    println!("{left_to_the_walk:?}");
    let [none, few, some, all] = left_to_the_walk;
    assert!(none == 0 && few < some && some < all, "{left_to_the_walk:?}");
}

#[test]
fn faces_are_exact_after_the_sites_have_moved() {
    for (name, sites, normals, widest) in
        scenes().into_iter().filter(|s| ["sphere", "plane", "line"].contains(&s.0))
    {
        for (k, step) in [(8, 0.01), (24, 0.01), (24, 0.05)] {
            // Where sites lie close together by chance a list's reach is short, and few steps are allowed.
            let step = if name == "line" { 0.002 } else { step };
            println!("{name}, lists of {k}, step {step}");
            let mut scene = Scene::new(&sites, &normals, k, widest);
            scene.walk(step, 7);
            assert_targets(&scene, &scene.options());
        }
    }
}

#[test]
fn faces_with_more_edges_than_slots_are_exact() {
    for (name, sites, normals, widest) in scenes().into_iter().filter(|s| s.0 != "clusters") {
        println!("{name}");
        let scene = Scene::new(&sites, &normals, 8, widest);
        assert_targets(&scene, &PlanarOptions { slots: 5, ..scene.options() });
    }
    // A site with many around it, and beyond them others.
    for spokes in [60, 250, 400] {
        let mut wheel = vec![DVec3::ZERO];
        wheel.extend((0..spokes).map(|i| {
            let turn = f64::from(i) * std::f64::consts::TAU / f64::from(spokes);
            DVec3::new(0.1 * turn.cos(), 0.1 * turn.sin(), 0.0)
        }));
        wheel.extend(in_plane(300, 6).iter().filter(|p| p.truncate().length() > 0.12).map(|p| p.with_z(0.0)));
        let scene = Scene::new(&wheel, &vec![DVec3::Z; wheel.len()], 24, 0.3);
        assert_eq!(polygons(&scene, &scene.options())[0].2 & 2, 2, "this face has no slots for its edges");
        assert_targets(&scene, &scene.options());
    }
}

#[test]
fn sizes_around_leaves_and_workgroups() {
    for n in [0, 1, 2, 3, 7, 8, 9, 15, 16, 17, 24, 25, 26, 31, 32, 33, 63, 64, 65, 127, 129] {
        let (positions, normals) = on_sphere(n, 2);
        for k in [6, 20] {
            let scene = Scene::new(&positions, &normals, k, 0.3);
            assert_faces(&scene);
            assert_targets(&scene, &scene.options());
        }
    }
}

#[test]
fn lists_that_hold_everybody_are_exact_wherever_the_sites_go() {
    let (positions, normals) = on_sphere(20, 9);
    let mut scene = Scene::new(&positions, &normals, 24, 0.3);
    scene.walk(0.3, 8);
    assert_targets(&scene, &scene.options());
    assert_targets(&scene, &PlanarOptions { slots: 4, ..scene.options() });
}

#[test]
fn the_cell_kernel_gives_the_same_polygons() {
    let (positions, normals) = on_sphere(400, 11);
    // A surface that is curved in both ways, and its normals.
    let bent = |p: &DVec3| DVec3::new(p.x, p.y, 0.7 * p.z + 0.15 * (8.0 * p.x).sin());
    let positions: Vec<DVec3> = positions.iter().map(bent).collect();
    let spacing = 0.045;
    let scene = Scene::new(&positions, &normals, 20, 2.5 * spacing);
    let n = scene.positions.len();
    let options = CellOptions::paper(20, spacing);
    let (cells, bounds) = (
        CellFaces::new(device(), n, &options).unwrap(),
        TileBounds::new(device(), "test.bounds", n).unwrap(),
    );
    let normals = upload("test.unit", &scene.unit);
    let flags = Buffer::from_slice(device(), "test.flags", &vec![0_u32; n]).unwrap();
    let mut recorder = Recorder::new(device()).unwrap();
    bounds.record(&mut recorder, &scene.sites).unwrap();
    cells
        .record(
            &mut recorder,
            &scene.sites,
            &normals,
            scene.lists.neighbours.whole().unwrap(),
            &bounds,
            &flags,
        )
        .unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    let (count, flags) = (cells.corner_count.to_vec(device()).unwrap(), flags.to_vec(device()).unwrap());
    let (corners, fan) = (cells.corners.to_vec(device()).unwrap(), cells.fan.to_vec(device()).unwrap());
    let got = polygons(&scene, &PlanarOptions { slots: 20, ..scene.options() });
    let mut compared = 0;
    for (i, (planar, behind, state)) in got.iter().enumerate() {
        // The cell kernel counts sites on the other side of the surface too; none is near enough to cut.
        let slots = (0..count[i] as usize).map(|s| s * n + i);
        let corners: Vec<DVec2> = slots.clone().map(|s| corners[s].as_dvec2()).collect();
        let cell = Face { behind: slots.map(|s| Some(fan[s])).collect(), corners };
        if *state == 0 && flags[i] & 0b100_1111 == 0 && cell.radius() < scene.widest {
            assert_same_polygon(i, planar, behind, &cell);
            let size = cell.radius();
            assert!((area(planar) - area(&cell.corners)).abs() < 2e-5 * size * size, "site {i}: area");
            let off = area_centroid(planar).distance(area_centroid(&cell.corners));
            assert!(off < 1e-4 * size, "site {i}: centroids are {off} apart");
            compared += 1;
        }
    }
    assert!(compared > 350, "only {compared} polygons could be compared");
}

#[test]
fn lattices_and_sites_on_one_spot() {
    // Every four neighbours on a circle, and each bisector parallel to three others.
    let mut positions: Vec<DVec3> =
        (0..144).map(|i| DVec3::new(f64::from(i % 12), f64::from(i / 12), 0.0) / 16.0 - 0.4).collect();
    let up = vec![DVec3::Z; 144];
    assert_faces(&Scene::new(&positions, &up, 24, 0.4));
    // Of two sites on one spot each keeps half of the square.
    positions[65] = positions[66];
    let scene = Scene::new(&positions, &up, 24, 0.4);
    let got = polygons(&scene, &scene.options());
    let area = |i: usize| area(&got[i].0);
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
    let scene = Scene::new(&positions, &normals, 8, 0.2);
    for (i, (_, fan, _)) in polygons(&scene, &scene.options()).iter().enumerate() {
        assert!(fan.iter().all(|j| (*j < 500) == (i < 500)), "site {i} sees the other side: {fan:?}");
    }
    assert_targets(&scene, &scene.options());
}

#[test]
fn faces_do_not_depend_on_blocks_and_layout() {
    for (name, sites, normals, widest) in scenes() {
        let whole = Scene::new(&sites, &normals, 8, widest);
        let want = targets(&whole, &whole.options());
        for (block, layout) in [(64, SiteLayout::Packed), (sites.len() - 1, SiteLayout::Marked)] {
            let options = ListOptions { block: Some(block), layout, ..ListOptions::new(8) };
            let scene = Scene::with(&sites, &normals, widest, &options);
            assert!(scene.lists.neighbours.whole().is_err(), "{name}");
            assert_eq!(targets(&scene, &scene.options()), want, "{name} in blocks of {block}");
        }
    }
}

#[test]
fn momentum_adds_the_last_motion() {
    let (positions, normals) = on_sphere(700, 4);
    let mut scene = Scene::new(&positions, &normals, 24, 0.2);
    let faces = PlanarFaces::new(device(), &scene.lists.neighbours.blocks(), &scene.options()).unwrap();
    let run = |scene: &Scene, momentum: f32, iteration: u32| {
        let mut recorder = Recorder::new(device()).unwrap();
        let step = PlanarMove { iteration, ..step(momentum, scene.widest) };
        faces.record(&mut recorder, &scene.inputs(), &step).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        faces.targets.to_vec(device()).unwrap()
    };
    let first = run(&scene, 0.9, 0);
    assert_eq!(first, targets(&scene, &scene.options()).0, "there is no motion yet");
    // The sites stayed, so the last motion is nothing, and the targets are the same.
    assert_eq!(run(&scene, 0.9, 1), first);
    scene.walk(0.01, 5);
    let (plain, _) = targets(&scene, &scene.options());
    let got = run(&scene, 0.5, 2);
    let mut added = 0;
    for i in (0..plain.len()).filter(|i| scene.want(*i).radius() < 0.99 * WIDE * scene.widest) {
        let motion = plain[i].truncate() - first[i].truncate();
        let way = plain[i].truncate() - scene.positions[i].as_vec3();
        let goes_on = way.dot(motion) > 0.0;
        let want = plain[i].truncate() + if goes_on { 0.5 * motion } else { Vec4::ZERO.truncate() };
        assert!(got[i].truncate().distance(want) < 1e-5, "site {i}: {} instead of {want}", got[i]);
        added += u32::from(goes_on);
    }
    assert!((100..600).contains(&added), "{added} of 700 go on");
}

#[test]
fn the_longest_move_is_kept() {
    let (positions, normals) = on_sphere(300, 5);
    let scene = Scene::new(&positions, &normals, 24, 0.2);
    let faces = PlanarFaces::new(device(), &scene.lists.neighbours.blocks(), &scene.options()).unwrap();
    let mut recorder = Recorder::new(device()).unwrap();
    let step = PlanarMove { largest_move: 1e-3, ..step(0.0, scene.widest) };
    faces.record(&mut recorder, &scene.inputs(), &step).unwrap();
    recorder.submit().unwrap();
    assert_valid(device());
    for (i, target) in faces.targets.to_vec(device()).unwrap().iter().enumerate() {
        let moved = target.truncate().as_dvec3().distance(scene.positions[i]);
        assert!(moved < 1.001e-3, "site {i} moved {moved}");
    }
}

#[test]
fn faces_are_cut_by_sites_of_the_patch_and_on_curves() {
    for (workgroup, block) in [(None, 900), (Some(16), 900), (None, 250)] {
        let scene = CurveScene::in_blocks(900, 4, block);
        let options = PlanarOptions { workgroup, ..PlanarOptions::new(K as u32, 1) };
        let faces = PlanarFaces::new(device(), &scene.neighbours.blocks(), &options).unwrap();
        let step = step(0.9, 1.0);
        let mut recorder = Recorder::new(device()).unwrap();
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
