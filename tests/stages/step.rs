//! `step/{step, reduce, settle, keep_off}` against their definitions.

use crate::reference::keep_off::kept_off;
use crate::reference::octahedral::unpack;
use crate::reference::sizing::Site;
use crate::support::curve_scene::CurveScene;
use crate::support::{assert_valid, cloud, device, on_sphere, rng, rounded, upload, vec4};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::site_layout::SiteLayout;
use rtfmesh::stages::step::{KeepOff, Settle, Step};

const SPACING: f64 = 0.05;

#[test]
fn steps_move_the_sites_and_sum_up() {
    let device = device();
    for count in [1, 15, 16, 17, 63, 64, 65, 1000, 5000] {
        for workgroup in [16, 64] {
            let (from, to) = (rounded(&cloud(count, 1.0, 4)), rounded(&cloud(count, 1.0, 5)));
            let (sites, target) = (upload("test.sites", &from), upload("test.projected", &to));
            let step = Step::new(device, count, 2, Some(workgroup)).unwrap();
            let mut recorder = Recorder::new(device).unwrap();
            step.record(&mut recorder, &target, &sites, 0).unwrap();
            step.record(&mut recorder, &target, &sites, 1).unwrap();
            recorder.submit().unwrap();
            let moved: Vec<Vec4> = sites.to_vec(device).unwrap();
            assert!(moved.iter().zip(&to).all(|(m, t)| m.truncate().as_dvec3() == *t));
            let history = step.history.to_vec(device).unwrap();
            let lengths: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a.distance(*b)).collect();
            let rms = (lengths.iter().map(|l| l * l).sum::<f64>() / count as f64).sqrt();
            let most = lengths.iter().copied().fold(0.0, f64::max);
            assert!((f64::from(history[0].x) - rms).abs() < 1e-5 * rms, "{count}: {} vs {rms}", history[0].x);
            assert!((f64::from(history[0].y) - most).abs() < 1e-6 * most);
            assert_eq!(history[1], glam::Vec2::ZERO, "the second step goes nowhere");
        }
    }
    assert_valid(device);
}

#[test]
fn settling_moves_the_sites_and_sums_the_steps_to_the_centroids() {
    let device = device();
    let sizes = [(1, None), (16, Some(16)), (17, Some(16)), (63, None), (64, None), (65, None), (3000, None)];
    let layouts = [SiteLayout::Marked, SiteLayout::Packed];
    for ((n, workgroup), layout) in sizes.into_iter().flat_map(|size| layouts.map(|layout| (size, layout))) {
        let places = rounded(&cloud(n, 1.0, 3));
        let normals = on_sphere(n, 4).1;
        let steps: Vec<f64> = (0..n).map(|i| (i % 7) as f64 * 1e-3).collect();
        let targets: Vec<Vec4> =
            places.iter().zip(&steps).map(|(p, s)| p.as_vec3().extend((s * s) as f32)).collect();
        let walk = Walk::new(device, n, None).unwrap();
        let settle = Settle::new(device, n, 2, None, layout, workgroup).unwrap();
        let sites = layout.buffer(device, "test.sites", n).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        recorder.upload(&walk.projected, &vec4(&places)).unwrap();
        recorder.upload(&walk.normals, &vec4(&normals)).unwrap();
        let targets = Buffer::from_slice(device, "test.targets", &targets).unwrap();
        settle.record(&mut recorder, &walk, &targets, &sites, 1).unwrap();
        recorder.submit().unwrap();
        assert_valid(device);
        let moved = layout.unpack(&sites.to_vec(device).unwrap(), n);
        assert_eq!(moved.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>(), places);
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

#[test]
fn curve_sites_stay_and_only_the_others_count() {
    for (n, workgroup) in [(1, None), (15, Some(16)), (16, Some(16)), (17, Some(16)), (500, None)] {
        let scene = CurveScene::new(n, 2);
        let moving = scene.marks.iter().filter(|mark| !mark.is_pinned()).count();
        let places = rounded(&cloud(n, 1.0, 3));
        let step = |i: usize| if scene.marks[i].is_pinned() { 0.0 } else { (i % 7) as f64 * 1e-3 };
        let targets: Vec<Vec4> =
            places.iter().enumerate().map(|(i, p)| p.as_vec3().extend((step(i) * step(i)) as f32)).collect();
        let walk = Walk::new(device(), n, None).unwrap();
        let settle = Settle::new(device(), n, 1, Some(moving), SiteLayout::Marked, workgroup).unwrap();
        let before = scene.sites.to_vec(device()).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
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
fn targets_keep_off_curves() {
    let sizes = [(1, None), (63, Some(8)), (64, None), (65, None), (900, Some(16))];
    for ((n, workgroup), sized) in sizes.into_iter().flat_map(|size| [(size, false), (size, true)]) {
        let scene = CurveScene::in_blocks(n, 5, 350);
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
        let mut recorder = Recorder::new(device()).unwrap();
        let wished = sized.then_some(&on_device);
        keep_off.record(&mut recorder, &scene.inputs(), &targets, SPACING, wished).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        let site = |i: usize| Site {
            at: scene.positions[i],
            normal: scene.unit[i],
            mark: scene.marks[i],
            length: lengths[i],
        };
        let kept_off = |i: usize| {
            let around: Vec<Site> = scene.near[i].iter().map(|j| site(*j as usize)).collect();
            kept_off(&site(i), &around.iter().collect::<Vec<_>>(), SPACING, wanted[i])
        };
        let mut moved = 0;
        for (i, got) in targets.to_vec(device()).unwrap().iter().enumerate() {
            let pinned = scene.marks[i].is_pinned();
            let want = if pinned { wanted[i] } else { kept_off(i) };
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
