//! `sizing/lengths` and `sizing/drift` against their definitions.

use crate::reference::knn::nearest;
use crate::reference::octahedral::{pack, unpack};
use crate::reference::pins::Mark;
use crate::reference::sizing::{RING, Site, drift};
use crate::support::polygons::frame;
use crate::support::{assert_valid, cloud, device, on_sphere, rng, rounded, slots, upload, vec4};
use glam::{DVec2, DVec3, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::sizing::SizeField;
use rtfmesh::stages::blocks::{Block, Blocked};
use rtfmesh::stages::face::planar::PlanarInputs;
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists};
use rtfmesh::stages::site_layout::SiteLayout;
use rtfmesh::stages::sizing::{AttachedLengths, DeviceSizes, Sizing};

#[test]
fn lengths_are_those_of_the_triangle_under_each_site() {
    let mesh = sample("torus").unwrap();
    let mut rng = rng(1);
    let wished: Vec<f64> = mesh.vertices.iter().map(|_| rng.random_range(0.2..3.0)).collect();
    let field = SizeField::new(mesh.clone(), wished);
    let sizes = DeviceSizes::new(device(), &field).unwrap().unwrap();
    let counts = [(0, None), (1, None), (63, Some(8)), (64, None), (65, None), (500, Some(16))];
    let layouts = [SiteLayout::Marked, SiteLayout::Packed];
    for ((n, workgroup), layout) in counts.into_iter().flat_map(|count| layouts.map(|layout| (count, layout)))
    {
        let under: Vec<u32> = (0..n).map(|_| rng.random_range(0..mesh.triangles.len() as u32)).collect();
        let points: Vec<DVec3> = under
            .iter()
            .map(|t| {
                let [a, b, c] = mesh.corners(*t as usize);
                let [u, v]: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..0.5));
                a + u * (b - a) + v * (c - a)
            })
            .collect();
        let points = rounded(&points);
        let sites = Buffer::from_slice(device(), "test.sites", &layout.pack(&vec4(&points))).unwrap();
        let site_triangle = Buffer::from_slice(device(), "test.site_triangle", &under).unwrap();
        let stage = Sizing::new(device(), n, false, layout, workgroup).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        stage.record_lengths(&mut recorder, &sizes, &sites, &site_triangle).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        for (i, got) in stage.lengths.to_vec(device()).unwrap().iter().enumerate() {
            let want = field.at(points[i], under[i]);
            assert!((f64::from(*got) - want).abs() < 1e-4, "{n} sites: site {i}: {got} instead of {want}");
        }
        let sites = Buffer::from_slice(device(), "test.sites", &vec4(&points)).unwrap();
        let sizes = DeviceSizes::new(device(), &field).unwrap().unwrap();
        let attached = AttachedLengths::new(device(), sizes, workgroup).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        attached.record(&mut recorder, &sites, &site_triangle).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        for (i, got) in sites.to_vec(device()).unwrap().iter().enumerate().take(n) {
            let want = field.at(points[i], under[i]);
            assert!((f64::from(got.w) - want).abs() < 1e-4, "{n} sites: site {i}: {got} instead of {want}");
            assert_eq!(got.truncate().as_dvec3(), points[i], "site {i} stays");
        }
    }
}

#[test]
fn a_uniform_field_takes_nothing_on_the_device() {
    assert!(DeviceSizes::new(device(), &SizeField::default()).unwrap().is_none());
}

#[test]
fn targets_drift_to_where_edges_are_to_be_short() {
    use SiteLayout::{Marked, Packed};
    const STEP: f64 = 0.02;
    for (n, curves, layout, workgroup) in [
        (0, false, Packed, None),
        (1, false, Packed, None),
        (5, true, Marked, None),
        (63, true, Marked, Some(8)),
        (64, false, Marked, None),
        (65, false, Packed, Some(16)),
        (700, false, Packed, None),
        (700, false, Marked, None),
        (700, true, Marked, None),
    ] {
        let mut rng = rng(n as u64);
        let (positions, normals) = on_sphere(n, 3);
        let positions = rounded(&positions);
        let sites: Vec<Site> = (0..n)
            .map(|i| Site {
                at: positions[i],
                normal: unpack(pack(if i % 11 == 7 { -normals[i] } else { normals[i] })),
                mark: match i % 10 {
                    3 if curves => Mark::Pinned { direction: DVec3::X, quarters: 4, anywhere: i % 20 == 3 },
                    _ if curves => Mark::Interior(u32::from(positions[i].z > 0.0)),
                    _ => Mark::Interior(0),
                },
                length: f64::from(rng.random_range(0.5f32..2.0)),
            })
            .collect();
        let near = nearest(&positions, &positions, RING, true);
        let offsets = cloud(n, 0.02, 4);
        let centroids = rounded(&(0..n).map(|i| positions[i] + 0.5 * offsets[i]).collect::<Vec<_>>());
        let wanted = rounded(&(0..n).map(|i| positions[i] + offsets[i]).collect::<Vec<_>>());
        let words: Vec<Vec4> = sites.iter().map(|s| s.at.as_vec3().extend(s.mark.encode())).collect();
        let packed: Vec<u32> = sites.iter().map(|s| pack(s.normal)).collect();
        let lengths: Vec<f32> = sites.iter().map(|s| s.length as f32).collect();
        let stage = Sizing::new(device(), n, curves, layout, workgroup).unwrap();
        let lists = Lists::new(device(), n, &ListOptions::new(RING as u32)).unwrap();
        let on_device = Buffer::from_slice(device(), "test.sites", &layout.pack(&words)).unwrap();
        let packed = Buffer::from_slice(device(), "test.normals", &packed).unwrap();
        let blocks = Block::divide(n, if curves { n } else { 240 });
        let near_slots = slots(&near, RING);
        let neighbours = Blocked::from_slice(device(), "test.neighbours", &blocks, &near_slots).unwrap();
        let inputs =
            PlanarInputs { neighbours: &neighbours, ..PlanarInputs::new(&on_device, &packed, &lists) };
        let (targets, centres) = (upload("test.targets", &wanted), upload("test.centroids", &centroids));
        let mut recorder = Recorder::new(device()).unwrap();
        recorder.upload(&stage.lengths, &lengths).unwrap();
        stage.record_drift(&mut recorder, &inputs, (&targets, &centres), STEP as f32).unwrap();
        recorder.submit().unwrap();
        assert_valid(device());
        let mut drifted = 0;
        for (i, got) in targets.to_vec(device()).unwrap().iter().enumerate() {
            let (site, to) = (&sites[i], got.truncate().as_dvec3());
            if site.mark.is_pinned() {
                assert_eq!(to, wanted[i], "curve site {i}");
                continue;
            }
            // A neighbour square to the normal may count or not.
            let close_call = near[i].iter().any(|j| sites[*j as usize].normal.dot(site.normal).abs() < 1e-4);
            let around: Vec<&Site> = near[i].iter().map(|j| &sites[*j as usize]).collect();
            let drift = drift(site, &around, frame(site.normal)).filter(|_| !close_call);
            let Some(drift) = drift else { continue };
            let want = site.at + (wanted[i] - site.at + drift).clamp_length_max(STEP * site.length);
            assert!(to.distance(want) < 2e-6, "{n} sites: site {i}: {to} instead of {want}");
            let step_sq = (centroids[i] + drift).distance_squared(site.at) / site.length.powi(2);
            assert!((f64::from(got.w) - step_sq).abs() < 1e-5 * step_sq.max(1e-3), "site {i}: step");
            drifted += usize::from(drift.length() > 1e-3);
        }
        assert!(n < 700 || drifted > 300, "{drifted} drifts");
    }
}

/// What the drift stands for: the centroid of the density 1 / h⁴ in a hexagon, by sums over small squares.
#[test]
fn the_drift_is_the_way_to_the_centroid_of_the_density() {
    let slope = DVec2::new(0.04, 0.03);
    let (mut weights, mut sum) = (0.0, DVec2::ZERO);
    let steps = 400;
    for k in 0..steps * steps {
        let p = DVec2::new(f64::from(k % steps), f64::from(k / steps)) / f64::from(steps) * 1.2 - 0.6;
        let outside =
            (0..6).any(|e| p.dot(DVec2::from_angle(f64::from(e) * std::f64::consts::FRAC_PI_3)) > 0.5);
        if outside {
            continue;
        }
        // Neighbours are at distance 1, and edges there are to be as long as 1 + slope · p.
        let density = (1.0 + slope.dot(p)).powi(-4);
        weights += density;
        sum += density * p;
    }
    let expected = -4.0 * 5.0 / 72.0 * slope;
    assert!(
        (sum / weights - expected).length() < 0.02 * expected.length(),
        "{} and {expected}",
        sum / weights
    );
}
