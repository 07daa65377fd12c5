//! `neighbours/{box_levels, lists, moved, decide}` against sorting all distances, and the guarantee of
//! `Lists`.

use crate::reference::knn::nearest;
use crate::support::{assert_valid, cloud, device, lattice, lists, on_sphere, rng, rounded, upload, vec4};
use glam::{DVec3, Vec2, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::neighbours::lists::{ENDLESS, NEAR};
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists};
use rtfmesh::stages::site_layout::SiteLayout;
use rtfmesh::stages::spatial::SpatialOrder;

/// Lists and reach of sites as they are, in any order.
fn on_device(sites: &[DVec3], options: &ListOptions) -> (Vec<Vec<u32>>, Vec<f32>) {
    let device = device();
    let packed = options.layout.pack(&vec4(sites));
    let buffer = Buffer::from_slice(device, "test.sites", &packed).unwrap();
    let made = Lists::new(device, sites.len(), options).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    made.record_build(&mut recorder, &buffer).unwrap();
    recorder.submit().unwrap();
    let found = lists(&made.neighbours.to_vec(device).unwrap(), sites.len());
    let listed = options.layout.unpack(&made.list_sites.to_vec(device).unwrap(), sites.len());
    assert_eq!(listed, sites.iter().map(|p| p.as_vec3()).collect::<Vec<_>>());
    assert_eq!(made.away.to_vec(device).unwrap(), made.reach.to_vec(device).unwrap());
    assert_valid(device);
    (found, made.reach.to_vec(device).unwrap().iter().map(|r| r.y).collect())
}

/// The sites in Morton order.
fn sorted(sites: &[DVec3]) -> Vec<DVec3> {
    let device = device();
    let order = SpatialOrder::new(device, sites.len()).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    order.record(&mut recorder, &upload("test.unsorted", sites)).unwrap();
    recorder.submit().unwrap();
    order.order().to_vec(device).unwrap().iter().map(|i| sites[*i as usize]).collect()
}

/// Equal up to the order of sites whose distances f32 cannot tell apart.
fn assert_nearest(sites: &[DVec3], options: &ListOptions) {
    let sites = rounded(sites);
    let k = options.k as usize;
    let (got, reach) = on_device(&sites, options);
    let want = nearest(&sites, &sites, k + 1, true);
    for (s, (got, want)) in got.iter().zip(&want).enumerate() {
        assert_eq!(got.len(), want.len().min(k), "site {s}");
        let mut once = got.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), got.len(), "site {s} lists a site twice");
        assert!(!got.contains(&(s as u32)), "site {s} lists itself");
        let far = |i: &u32| sites[*i as usize].distance(sites[s]);
        let same = |g: f64, w: f64| (g - w).abs() <= 1e-6 * w.max(f64::MIN_POSITIVE);
        for (g, w) in got.iter().zip(want) {
            assert!(same(far(g), far(w)), "site {s}: {} instead of {}", far(g), far(w));
        }
        match want.get(k) {
            Some(w) => assert!(same(f64::from(reach[s]), far(w)), "reach of site {s}"),
            None => assert_eq!(reach[s], ENDLESS),
        }
    }
}

/// Options that must not change the result.
fn ways(k: u32) -> Vec<ListOptions> {
    let own = ListOptions::new(k);
    vec![
        own,
        ListOptions { registers: false, ..own },
        ListOptions { window: 1, ..own },
        ListOptions { block: Some(200), ..own },
        ListOptions { block: Some(64), registers: false, layout: SiteLayout::Packed, ..own },
        ListOptions { registers: false, window: 3, ..own },
    ]
}

#[test]
fn sizes_around_leaves_and_workgroups() {
    for count in [0, 1, 2, 7, 8, 9, 16, 24, 25, 26, 31, 32, 33, 63, 64, 65, 129, 513, 700] {
        let sites = sorted(&cloud(count, 0.9, count as u64));
        for options in ways(24) {
            assert_nearest(&sites, &options);
        }
    }
}

#[test]
fn shorter_and_longer_lists() {
    let (sites, _) = on_sphere(1500, 4);
    for k in [1, 16, 20, 32] {
        assert_nearest(&sorted(&sites), &ListOptions::new(k));
    }
}

#[test]
fn surfaces_of_even_and_uneven_density() {
    let (even, _) = on_sphere(2500, 1);
    // Towards one pole distances shrink to a twentieth.
    let uneven: Vec<_> = even
        .iter()
        .map(|p| {
            let s = 0.5 + 1.25 * p.z;
            let z = 0.4 * (1.0 - 2.0 * (1.0 - s).powi(3).clamp(1e-4, 1.0));
            let flat = p.truncate().normalize_or_zero() * (0.16 - z * z).max(0.0).sqrt();
            flat.extend(z)
        })
        .collect();
    for options in ways(24) {
        assert_nearest(&sorted(&even), &options);
        assert_nearest(&sorted(&uneven), &options);
    }
}

#[test]
fn sites_in_no_order_are_found_too() {
    for options in ways(24) {
        assert_nearest(&cloud(1200, 1.0, 9), &options);
    }
}

#[test]
fn lines_clusters_and_heaps() {
    let line: Vec<_> = cloud(900, 0.9, 2).iter().map(|p| DVec3::new(p.x, 0.1, -0.2)).collect();
    let mut two = cloud(400, 1e-3, 3);
    two.extend(cloud(400, 1e-3, 4).iter().map(|p| *p + DVec3::splat(0.4)));
    let mut far = cloud(300, 1e-6, 9);
    far.extend(cloud(300, 1e6, 10).iter().map(|p| *p + DVec3::splat(1e7)));
    // More sites on one spot than a list holds, among others.
    let mut heap = cloud(500, 0.9, 5);
    heap.extend(vec![heap[17]; 200]);
    let pairs: Vec<_> = cloud(300, 0.9, 6).iter().flat_map(|p| [*p, *p, *p]).collect();
    for sites in [line, two, far, heap, pairs] {
        for options in ways(24) {
            assert_nearest(&sorted(&sites), &options);
        }
    }
}

#[test]
fn ties_go_to_the_lower_index() {
    let grid = lattice(7);
    let same = vec![DVec3::splat(0.25); 300];
    for options in ways(20) {
        assert_eq!(on_device(&grid, &options).0, nearest(&grid, &grid, 20, true));
        let (got, reach) = on_device(&same, &options);
        assert_eq!(got, nearest(&same, &same, 20, true));
        assert_eq!(reach, [0.0; 300]);
    }
}

/// What the faces rely on: no site outside a list is nearer than the bound.
fn assert_promise(made: &Lists, sites: &[Vec4], max_rho: f32) {
    let device = device();
    let found = lists(&made.neighbours.to_vec(device).unwrap(), sites.len());
    let (reach, away) = (made.reach.to_vec(device).unwrap(), made.away.to_vec(device).unwrap());
    let rho = f32::from_bits(made.status.to_vec(device).unwrap()[1]);
    assert!(rho <= max_rho, "{rho}");
    for (s, at) in sites.iter().enumerate() {
        let Vec2 { x: near, y: reach } = reach[s];
        if reach == ENDLESS {
            assert_eq!(found[s].len(), sites.len() - 1, "site {s}");
            continue;
        }
        assert!(reach - away[s].y <= rho * reach * 1.000_001, "site {s}");
        let bound = f64::from(away[s].y) - 2.0 * f64::from(rho) * f64::from(reach);
        let near = f64::from(away[s].x - rho * (near + reach));
        for (j, other) in sites.iter().enumerate() {
            let far = other.as_dvec4().distance(at.as_dvec4());
            let first = found[s].iter().take(NEAR as usize).any(|k| *k as usize == j);
            assert!(j == s || first || far >= near - 1e-6, "site {s}: {j} is {far} away, nearer than {near}");
        }
        for (j, other) in sites.iter().enumerate() {
            if j != s && !found[s].contains(&(j as u32)) {
                let far = other.as_dvec4().distance(at.as_dvec4());
                assert!(far >= bound - 1e-6, "site {s}: {j} is {far} away, and not in the list of {bound}");
            }
        }
    }
}

#[test]
fn lists_stay_valid_while_sites_move() {
    let device = device();
    let mut rng = rng(12);
    let mut walk = |sites: &mut [Vec4], step: f32| {
        for s in sites.iter_mut() {
            *s += step
                * Vec4::from_array(std::array::from_fn(
                    |i| if i < 3 { rng.random::<f32>() - 0.5 } else { 0.0 },
                ));
        }
    };
    for (count, max_rho, layout) in
        [(600, 0.2, SiteLayout::Marked), (600, 0.05, SiteLayout::Packed), (20, 0.2, SiteLayout::Packed)]
    {
        let (start, _) = on_sphere(count, 3);
        let mut sites = vec4(&sorted(&start));
        let buffer = Buffer::from_slice(device, "test.sites", &layout.pack(&sites)).unwrap();
        let options = ListOptions { block: Some(250), layout, ..ListOptions::new(24) };
        let made = Lists::new(device, count, &options).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        made.record_build(&mut recorder, &buffer).unwrap();
        recorder.submit().unwrap();
        let mut builds = Vec::new();
        for _ in 0..12 {
            // A reach is about 0.16 here.
            walk(&mut sites, 0.08 * max_rho);
            let mut recorder = Recorder::new(device).unwrap();
            recorder.upload(&buffer, &layout.pack(&sites)).unwrap();
            made.record_refresh(&mut recorder, &buffer, max_rho).unwrap();
            recorder.submit().unwrap();
            assert_promise(&made, &sites, max_rho);
            builds.push(made.status.to_vec(device).unwrap()[2]);
        }
        let last = builds[11];
        if count < 25 {
            assert_eq!(last, 1, "lists that hold everybody are never made anew");
        } else {
            assert!(last > 1 && last < 13, "{builds:?}: some moves are too far, and some are not");
        }
    }
    assert_valid(device);
}

/// Lists made again begin with what the last ones tell, and are the same as lists made of nothing.
#[test]
fn lists_made_again_are_those_made_of_nothing() {
    let device = device();
    let (even, _) = on_sphere(900, 5);
    let mut heap = cloud(400, 0.9, 6);
    heap.extend(vec![heap[11]; 60]);
    let far = cloud(300, 1e6, 7).iter().map(|p| *p + DVec3::splat(1e7)).collect();
    // With 21 sites, a list has all others and nothing is left out.
    for start in [even, heap, far, cloud(20, 0.9, 8), cloud(21, 0.9, 8), cloud(22, 0.9, 8)] {
        let size = start.iter().fold(0.0_f32, |size, p| size.max((*p - start[0]).abs().max_element() as f32));
        for options in ways(20) {
            let mut sites = vec4(&sorted(&start));
            let buffer = Buffer::from_slice(device, "test.sites", &options.layout.pack(&sites)).unwrap();
            let again = Lists::new(device, sites.len(), &options).unwrap();
            let mut recorder = Recorder::new(device).unwrap();
            again.record_build(&mut recorder, &buffer).unwrap();
            recorder.submit().unwrap();
            // Moves within a list's reach, then a jump of some to where others are, then all to one spot.
            for round in 0..3 {
                let turn = |i: usize| ((i * 7 + round) % 13) as f32 / 13.0 - 0.5;
                for i in 0..sites.len() {
                    let near = Vec4::new(turn(i), turn(i + 3), turn(i + 5), 0.0);
                    sites[i] = match round {
                        0 => sites[i] + 0.02 * size * near,
                        1 if i % 5 == 0 => sites[(i * 31) % sites.len()],
                        2 => sites[0],
                        _ => sites[i],
                    };
                }
                let mut recorder = Recorder::new(device).unwrap();
                recorder.upload(&buffer, &options.layout.pack(&sites)).unwrap();
                again.record_refresh(&mut recorder, &buffer, -1.0).unwrap();
                recorder.submit().unwrap();
                let anew = Lists::new(device, sites.len(), &options).unwrap();
                let mut recorder = Recorder::new(device).unwrap();
                anew.record_build(&mut recorder, &buffer).unwrap();
                recorder.submit().unwrap();
                let lists = |lists: &Lists| lists.neighbours.to_vec(device).unwrap();
                assert_eq!(lists(&again), lists(&anew), "round {round}");
                assert_eq!(again.reach.to_vec(device).unwrap(), anew.reach.to_vec(device).unwrap());
            }
        }
    }
    assert_valid(device);
}

#[test]
fn many_refreshes_need_no_host() {
    let device = device();
    let (points, _) = on_sphere(300, 8);
    let sites = upload("test.sites", &sorted(&points));
    let made = Lists::new(device, 300, &ListOptions::new(16)).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    made.record_build(&mut recorder, &sites).unwrap();
    for _ in 0..3 {
        made.record_refresh(&mut recorder, &sites, 0.1).unwrap();
    }
    let mut turned = vec4(&sorted(&points));
    turned.reverse();
    recorder.upload(&sites, &turned).unwrap();
    for _ in 0..3 {
        made.record_refresh(&mut recorder, &sites, 0.1).unwrap();
    }
    recorder.submit().unwrap();
    assert_eq!(made.status.to_vec(device).unwrap()[..3], [0, 0, 2], "once at first, once after the jump");
    let at = |sites: &[Vec4]| sites.iter().map(|s| s.truncate()).collect::<Vec<_>>();
    assert_eq!(at(&made.list_sites.to_vec(device).unwrap()), at(&turned));
    assert_promise(&made, &turned, 0.1);
    assert_valid(device);
}
