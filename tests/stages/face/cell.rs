//! `face/cell` against the intersection of half-planes in f64.

use crate::reference::face::{face, weighted_face};
use crate::support::cell_faces::{DeviceFaces, device_faces, device_faces_of};
use crate::support::polygons::{assert_same_polygon, frame};
use crate::support::{cloud, on_sphere, rng, rounded, spacing_on_sphere};
use glam::{DVec3, Vec4};
use rand::RngExt;
use rtfmesh::options::Centroid;
use rtfmesh::stages::face::cell::{BOX_HALF, CellOptions, CellWeights};
use rtfmesh::stages::flags::FlagCounts;

fn assert_faces(sites: &[DVec3], normals: &[DVec3], options: &CellOptions) -> FlagCounts {
    let (sites, normals) = (rounded(sites), rounded(normals));
    let got = device_faces(&sites, &normals, options);
    for (i, normal) in normals.iter().enumerate() {
        assert_eq!(got.flags[i] & 0b1111, 0, "site {i} has no face");
        let (u, v) = frame(*normal);
        let want = face(&sites, i, u, v, BOX_HALF * options.spacing);
        let unbounded = want.behind.iter().any(Option::is_none);
        assert_eq!(got.flags[i] & 64 != 0, unbounded, "site {i}: unbounded flag");
        if !want.corners.is_empty() {
            assert_same_polygon(i, &got.corners[i], &got.fans[i], &want);
        }
    }
    FlagCounts::of(&got.flags)
}

#[test]
fn sites_on_a_sphere() {
    let (sites, normals) = on_sphere(700, 1);
    let flags = assert_faces(&sites, &normals, &CellOptions::paper(32, spacing_on_sphere(700)));
    assert_eq!(flags.unbounded, 0);
}

/// Sites on a sphere, closer together around one pole, with the lengths of edges there.
fn graded_sphere(count: usize, seed: u64) -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
    let (sites, _) = on_sphere(4 * count, seed);
    let length = |p: &DVec3| 0.4 + 1.2 * (p.normalize().z + 1.0) / 2.0;
    let mut rng = rng(seed);
    let mut keep = |p: &DVec3| rng.random_range(0.0..1.0) < (0.4 / length(p)).powi(2);
    let sites: Vec<DVec3> = rounded(&sites.into_iter().filter(|p| keep(p)).take(count).collect::<Vec<_>>());
    let normals = rounded(&sites.iter().map(|p| p.normalize()).collect::<Vec<_>>());
    let lengths = sites.iter().map(|p| f64::from(length(p) as f32)).collect();
    (sites, normals, lengths)
}

#[test]
fn weights_move_the_sides_of_faces() {
    for (count, k, workgroup) in [(1, 32, 16), (17, 32, 8), (600, 32, 16), (600, 4, 16), (601, 48, 8)] {
        let (sites, normals, lengths) = graded_sphere(count, 5);
        let spacing = spacing_on_sphere(count.max(30));
        for centroid in [Centroid::Corners, Centroid::Area] {
            // Sites at random change their lengths as fast as the sphere's radius of 0.5 has it.
            let weights = CellWeights::balanced(centroid, 2.4 * spacing);
            let share = weights.share;
            let options = CellOptions { weights: Some(weights), workgroup, ..CellOptions::paper(k, spacing) };
            let uploaded: Vec<Vec4> =
                sites.iter().zip(&lengths).map(|(p, h)| p.as_vec3().extend(*h as f32)).collect();
            let got = device_faces_of(&uploaded, &sites, &normals, &options);
            let mut moved = 0;
            for (i, normal) in normals.iter().enumerate() {
                assert_eq!(got.flags[i] & 0b1111, 0, "site {i} has no face");
                let frame = frame(*normal);
                let want = weighted_face((&sites, &lengths), i, frame, (share, spacing, BOX_HALF));
                assert_same_polygon(i, &got.corners[i], &got.fans[i], &want);
                let plain = face(&sites, i, frame.0, frame.1, BOX_HALF * spacing);
                moved += usize::from((plain.radius() / want.radius() - 1.0).abs() > 0.01);
            }
            assert!(count < 100 || moved > count / 6, "{moved} of {count}");
        }
    }
}

#[test]
fn short_lists_are_completed() {
    let (sites, normals) = on_sphere(300, 2);
    let flags = assert_faces(&sites, &normals, &CellOptions::paper(4, spacing_on_sphere(300)));
    assert!(flags.security_missed > 100, "four neighbours cannot be enough: {flags:?}");
    assert_eq!(flags.incomplete, 0);
}

#[test]
fn sites_in_a_volume_with_any_normals() {
    let sites = cloud(400, 0.9, 3);
    let normals = on_sphere(400, 4).1;
    assert_faces(&sites, &normals, &CellOptions::paper(48, 0.15));
}

#[test]
fn sizes_around_the_workgroup() {
    for count in [0, 1, 2, 7, 8, 9, 15, 16, 17, 33] {
        for workgroup in [8, 16] {
            let (sites, normals) = on_sphere(count, 6);
            let options = CellOptions { workgroup, ..CellOptions::paper(32, spacing_on_sphere(count)) };
            assert_faces(&sites, &normals, &options);
        }
    }
}

#[test]
fn lattices_with_four_sites_on_every_circle() {
    let sites: Vec<_> = (0..400)
        .map(|i| DVec3::new(f64::from(i % 20) / 32.0 - 0.3, f64::from(i / 20) / 32.0 - 0.3, 0.1))
        .collect();
    assert_faces(&sites, &vec![DVec3::Z; 400], &CellOptions::paper(32, 1.0 / 32.0));
}

#[test]
fn the_distance_of_the_virtual_points_does_not_matter() {
    // The centre of the sphere, where all bisectors meet, is outside the cubes.
    let (sites, normals) = on_sphere(1200, 7);
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let paper = CellOptions::paper(48, spacing_on_sphere(1200));
    for virtual_offset in [0.25, 2.0, 20.0, 500.0] {
        // A second attempt could be in another slab.
        let options = CellOptions { virtual_offset, max_attempts: 1, ..paper };
        let got = device_faces(&sites, &normals, &options);
        let flags = FlagCounts::of(&got.flags);
        assert!(flags.badly_closed == 0 && flags.incomplete < 12, "{virtual_offset}: {flags:?}");
        for i in (0..1200).filter(|i| got.flags[*i] == 0) {
            let (u, v) = frame(normals[i]);
            let want = face(&sites, i, u, v, BOX_HALF * paper.spacing);
            assert_same_polygon(i, &got.corners[i], &got.fans[i], &want);
        }
    }
}

#[test]
fn where_bisectors_meet_in_a_point_a_thinner_slab_helps() {
    let (sites, normals) = on_sphere(200, 7);
    let options = CellOptions { virtual_offset: 20.0, ..CellOptions::paper(32, spacing_on_sphere(200)) };
    let (on, along) = (rounded(&sites), rounded(&normals));
    let open = |virtual_offset| {
        let once = CellOptions { max_attempts: 1, virtual_offset, ..options };
        FlagCounts::of(&device_faces(&on, &along, &once).flags).badly_closed
    };
    assert!(open(20.0) > 20 && open(2.0) == 0, "{} {}", open(20.0), open(2.0));
    assert_faces(&sites, &normals, &options);
}

#[test]
fn faces_that_are_not_completed_for_lack_of_attempts_are_flagged() {
    let (sites, normals) = on_sphere(300, 2);
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let paper = CellOptions::paper(4, spacing_on_sphere(300));
    let whole = device_faces(&sites, &normals, &paper);
    let by_list = device_faces(&sites, &normals, &CellOptions { max_attempts: 1, ..paper });
    let [complete, not] = [&whole, &by_list].map(|faces| FlagCounts::of(&faces.flags));
    assert_eq!((complete.incomplete, not.incomplete), (0, complete.security_missed));
    assert_eq!(not.security_missed, complete.security_missed);
    // What is not flagged is whole.
    for i in (0..300).filter(|i| by_list.flags[*i] == 0) {
        assert_eq!(by_list.corners[i], whole.corners[i], "site {i}");
    }
}

#[test]
fn collinear_sites_make_strips() {
    let sites: Vec<_> = (0..40).map(|i| DVec3::new(0.01 * f64::from(i) - 0.2, 0.0, 0.0)).collect();
    let flags = assert_faces(&sites, &vec![DVec3::Z; 40], &CellOptions::paper(32, 0.01));
    assert_eq!(flags.unbounded, 40);
}

#[test]
fn coincident_sites_are_counted_and_cut_each_other() {
    let (mut sites, mut normals) = on_sphere(200, 8);
    sites[150] = sites[20];
    normals[150] = normals[20];
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let got = device_faces(&sites, &normals, &CellOptions::paper(32, spacing_on_sphere(200)));
    let flags = FlagCounts::of(&got.flags);
    assert_eq!((flags.coincident, flags.badly_closed), (2, 0));
    assert!(got.fans[20].contains(&150) && got.fans[150].contains(&20));
}

#[test]
fn the_face_on_a_spike_stays_in_its_cube() {
    // A needle of sites below the tip: every bisector meets the tangent plane far away.
    let sites: Vec<_> = (0..300)
        .map(|i| {
            let (turn, down) = (2.4 * f64::from(i), 1e-3 * f64::from(i));
            DVec3::new(2e-5 * turn.cos(), 2e-5 * turn.sin(), -down)
        })
        .collect();
    let sites = rounded(&sites);
    let got = device_faces(&sites, &vec![DVec3::Z; 300], &CellOptions::paper(8, 1e-3));
    assert!(got.flags[0] & 64 != 0, "{}", got.flags[0]);
    assert!(got.corners[0].len() >= 3);
    assert!(got.corners[0].iter().all(|c| c.length() < 2.0 * BOX_HALF * 1e-3));
}

#[test]
fn overflows_are_flagged_and_leave_no_face() {
    let (sites, normals) = on_sphere(200, 9);
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let paper = CellOptions::paper(32, spacing_on_sphere(200));
    let few_planes = device_faces(&sites, &normals, &CellOptions { max_planes: 10, ..paper });
    let few_triangles = device_faces(&sites, &normals, &CellOptions { max_triangles: 8, ..paper });
    assert!(FlagCounts::of(&few_planes.flags).plane_overflow > 150);
    assert!(FlagCounts::of(&few_triangles.flags).triangle_overflow > 150);
    let empty = |got: &DeviceFaces| (0..200).all(|i| got.flags[i] & 3 == 0 || got.corners[i].is_empty());
    assert!(empty(&few_planes) && empty(&few_triangles));
}
