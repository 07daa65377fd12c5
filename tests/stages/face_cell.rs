//! `face/cell` and `centroid/*` against the intersection of half-planes in f64.

use crate::reference::centroid::{area_centroid, vertex_mean};
use crate::reference::face::face;
use crate::reference::nearest::nearest;
use crate::support::polygons::{assert_same_polygon, frame};
use crate::support::{assert_valid, cloud, device, on_sphere, rounded, upload};
use glam::{DVec2, DVec3, Vec2};
use rtfmesh::Centroid;
use rtfmesh::gpu::Buffer;
use rtfmesh::mesh::NONE;
use rtfmesh::stages::centroid::Centroids;
use rtfmesh::stages::face::cell::{BOX_HALF, CellFaces, CellOptions, FlagCounts};
use rtfmesh::stages::neighbours::knn::TileBounds;

/// What the kernels gave, in f64.
struct Run {
    corners: Vec<Vec<DVec2>>,
    fans: Vec<Vec<u32>>,
    flags: Vec<u32>,
    vertex: Vec<DVec3>,
    area: Vec<DVec3>,
}

fn run(sites: &[DVec3], normals: &[DVec3], options: &CellOptions) -> Run {
    let device = device();
    let n = sites.len();
    let k = options.k as usize;
    let found = nearest(sites, sites, k, true);
    let neighbours: Vec<u32> =
        (0..k).flat_map(|s| found.iter().map(move |l| l.get(s).copied().unwrap_or(NONE))).collect();
    let (sites, normals) = (upload("test.sites", sites), upload("test.normals", normals));
    let neighbours = Buffer::from_slice(device, "test.neighbours", &neighbours).unwrap();
    let flags = Buffer::from_slice(device, "test.flags", &vec![0_u32; n]).unwrap();
    let bounds = TileBounds::new(device, "test.bounds", n).unwrap();
    let faces = CellFaces::new(device, n, options).unwrap();
    let middle = |kind| Centroids::new(device, n, kind, Some(16)).unwrap();
    let (vertex, area) = (middle(Centroid::Vertex), middle(Centroid::Area));
    let mut recorder = device.recorder().unwrap();
    bounds.record(&mut recorder, &sites).unwrap();
    faces.record(&mut recorder, &sites, &normals, &neighbours, &bounds, &flags).unwrap();
    vertex.record(&mut recorder, &sites, &normals, &faces).unwrap();
    area.record(&mut recorder, &sites, &normals, &faces).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let counts = faces.corner_count.to_vec(device).unwrap();
    let corners: Vec<Vec2> = faces.corners.to_vec(device).unwrap();
    let fan = faces.fan.to_vec(device).unwrap();
    let slots = |i: usize| (0..counts[i] as usize).map(move |s| s * n + i);
    let points = |b: &Buffer<glam::Vec4>| {
        b.to_vec(device).unwrap().iter().map(|p| p.truncate().as_dvec3()).collect::<Vec<_>>()
    };
    Run {
        corners: (0..n).map(|i| slots(i).map(|s| corners[s].as_dvec2()).collect()).collect(),
        fans: (0..n).map(|i| slots(i).map(|s| fan[s]).collect()).collect(),
        flags: flags.to_vec(device).unwrap()[..n].to_vec(),
        vertex: points(&vertex.targets),
        area: points(&area.targets),
    }
}

fn assert_faces(sites: &[DVec3], normals: &[DVec3], options: &CellOptions) -> FlagCounts {
    let (sites, normals) = (rounded(sites), rounded(normals));
    let got = run(&sites, &normals, options);
    for i in 0..sites.len() {
        assert_eq!(got.flags[i] & 0b1111, 0, "site {i} has no face");
        let (u, v) = frame(normals[i]);
        let want = face(&sites, i, u, v, BOX_HALF * options.spacing);
        let unbounded = want.behind.iter().any(Option::is_none);
        assert_eq!(got.flags[i] & 64 != 0, unbounded, "site {i}: unbounded flag");
        if !want.corners.is_empty() {
            assert_same_polygon(i, &got.corners[i], &got.fans[i], &want);
            let at = |c: DVec2| sites[i] + u * c.x + v * c.y;
            let size = want.radius();
            let mean = at(vertex_mean(&got.corners[i]));
            // Whether two corners count as one is a threshold, which rounding may pass.
            let close_call = (0..got.corners[i].len()).any(|m| {
                let before = got.corners[i][(m + got.corners[i].len() - 1) % got.corners[i].len()];
                (got.corners[i][m].distance(before) / (0.2 * size) - 1.0).abs() < 1e-4
            });
            assert!(close_call || got.vertex[i].distance(mean) < 1e-5 * size + 1e-7, "site {i}: vertex mean");
            let middle = at(area_centroid(&want.corners));
            assert!(got.area[i].distance(middle) < 3e-5 * size + 1e-7, "site {i}: area centroid");
        }
    }
    FlagCounts::of(&got.flags)
}

fn spacing(sites: usize) -> f64 {
    (2.0 * 4.0 * std::f64::consts::PI * 0.16 / (3.0_f64.sqrt() * sites.max(1) as f64)).sqrt()
}

#[test]
fn sites_on_a_sphere() {
    let (sites, normals) = on_sphere(700, 1);
    let flags = assert_faces(&sites, &normals, &CellOptions::paper(32, spacing(700)));
    assert_eq!(flags.unbounded, 0);
}

#[test]
fn short_lists_are_completed() {
    let (sites, normals) = on_sphere(300, 2);
    let flags = assert_faces(&sites, &normals, &CellOptions::paper(4, spacing(300)));
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
            let options = CellOptions { workgroup, ..CellOptions::paper(32, spacing(count)) };
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
    let (sites, normals) = on_sphere(300, 7);
    for virtual_offset in [2.0, 20.0, 500.0] {
        let options = CellOptions { virtual_offset, ..CellOptions::paper(32, spacing(300)) };
        assert_faces(&sites, &normals, &options);
    }
}

#[test]
fn collinear_sites_make_strips() {
    let sites: Vec<_> = (0..40).map(|i| DVec3::new(0.01 * f64::from(i) - 0.2, 0.0, 0.0)).collect();
    let flags = assert_faces(&sites, &vec![DVec3::Z; 40], &CellOptions::paper(32, 0.01));
    assert_eq!(flags.unbounded, 40);
}

#[test]
fn coincident_sites_part_and_are_counted() {
    let (mut sites, mut normals) = on_sphere(200, 8);
    sites[150] = sites[20];
    normals[150] = normals[20];
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let got = run(&sites, &normals, &CellOptions::paper(32, spacing(200)));
    let flags = FlagCounts::of(&got.flags);
    assert_eq!((flags.coincident, flags.badly_closed), (2, 0));
    assert!(got.vertex[20].distance(got.vertex[150]) > 0.2 * spacing(200), "they stay together");
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
    let got = run(&sites, &vec![DVec3::Z; 300], &CellOptions::paper(8, 1e-3));
    assert!(got.flags[0] & 64 != 0, "{}", got.flags[0]);
    assert!(got.corners[0].len() >= 3);
    assert!(got.corners[0].iter().all(|c| c.length() < 2.0 * BOX_HALF * 1e-3));
}

#[test]
fn overflows_are_flagged_and_leave_the_site_in_place() {
    let (sites, normals) = on_sphere(200, 9);
    let (sites, normals) = (rounded(&sites), rounded(&normals));
    let paper = CellOptions::paper(32, spacing(200));
    let few_planes = run(&sites, &normals, &CellOptions { max_planes: 10, ..paper });
    let few_triangles = run(&sites, &normals, &CellOptions { max_triangles: 8, ..paper });
    assert!(FlagCounts::of(&few_planes.flags).plane_overflow > 150);
    assert!(FlagCounts::of(&few_triangles.flags).triangle_overflow > 150);
    for got in [few_planes, few_triangles] {
        for i in (0..200).filter(|i| got.flags[*i] & 3 != 0) {
            assert!(got.corners[i].is_empty());
            assert_eq!(got.vertex[i], sites[i]);
            assert_eq!(got.area[i], sites[i]);
        }
    }
}
