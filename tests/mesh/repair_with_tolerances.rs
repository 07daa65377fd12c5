//! Repair with tolerances: cracks, flipped faces, small components.

use crate::support::shapes::{cube, moved, plane, sphere, union};
use glam::DVec3;
use rtfmesh::TriMesh;
use rtfmesh::mesh::repair::{RepairCounts, RepairOptions, Repaired, repair, repair_with};
use rtfmesh::mesh::samples::sample;
use rtfmesh::mesh::topology::topology;
use rtfmesh::mesh::triangle::closest_on_triangle;

fn welded(mesh: &TriMesh, weld: f64) -> Repaired {
    repair_with(mesh, &RepairOptions::default().weld(weld)).unwrap()
}

/// Every triangle with corners of its own, each a little off.
fn shattered(mesh: &TriMesh, off: f64) -> TriMesh {
    let noise = |k: usize| DVec3::new((k % 7) as f64, (k % 5) as f64, (k % 3) as f64) * off / 12.0;
    let corners = mesh.triangles.as_flattened().iter().enumerate();
    let vertices = corners.map(|(k, v)| mesh.vertices[*v as usize] + noise(k)).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriMesh { vertices, triangles }
}

/// Every triangle is that of the input, or a part of it.
#[track_caller]
fn assert_lies_on(mesh: &TriMesh, origin: &[u32], input: &TriMesh, off: f64) {
    assert_eq!(origin.len(), mesh.triangles.len());
    let size = input.bounds().map(|[low, high]| (high - low).length()).unwrap();
    for (t, from) in origin.iter().enumerate() {
        for corner in mesh.corners(t) {
            let nearest = closest_on_triangle(corner, input.corners(*from as usize)).point;
            assert!(corner.distance(nearest) <= 1.01 * off * size + 1e-12, "{t} from {from}");
        }
    }
}

#[test]
fn nearly_equal_vertices_become_one_within_the_tolerance_only() {
    let ball = sphere(1.0, 3);
    let soup = shattered(&ball, 3e-5);
    assert!(topology(&repair(&soup).unwrap().mesh).components > 200);
    let Repaired { mesh, origin, counts, .. } = welded(&soup, 1e-4);
    assert_lies_on(&mesh, &origin, &soup, 1e-4);
    assert!(topology(&mesh).is_closed_manifold());
    assert_eq!(topology(&mesh).euler, 2);
    let welds = counts.near_vertices_welded + counts.crack_vertices_welded + counts.duplicate_vertices_welded;
    assert_eq!(welds, soup.vertices.len() - ball.vertices.len());
    assert_eq!(welded(&soup, 1e-9).counts.near_vertices_welded, 0);
    // Coarse tolerances drop triangles, and never make a surface touch itself.
    for weld in [0.003, 0.03, 0.1, 0.3, 0.9] {
        for mesh in [&ball, &soup, &sample("thin-plate").unwrap(), &sample("genus3").unwrap()] {
            if let Ok(repaired) = repair_with(mesh, &RepairOptions::default().weld(weld)) {
                let got = topology(&repaired.mesh);
                assert_eq!((got.nonmanifold_edges, got.duplicate_faces), (0, 0), "{weld}");
                assert_eq!(repair(&repaired.mesh).unwrap().mesh, repaired.mesh, "{weld}");
            }
        }
    }
}

#[test]
fn sheets_closer_than_the_tolerance_stay_apart() {
    let two = union(&plane(4, 0.0), &moved(&plane(4, 0.001), |v| v));
    let mut turned = two.clone();
    turned.triangles[32..].iter_mut().for_each(|t| t.swap(0, 1));
    let got = topology(&welded(&turned, 0.01).mesh);
    assert_eq!((got.nonmanifold_edges, got.duplicate_faces, got.components), (0, 0, 2), "{got:?}");
    // Twice the same sheet, facing the same way, is one.
    assert_eq!(topology(&welded(&two, 0.01).mesh).faces, 32);
}

#[test]
fn long_edges_are_joined_to_the_vertices_on_them() {
    // A coarse and a fine strip side by side, with vertices of the fine one up to 1e-4 off the edge.
    let coarse = plane(2, 0.0);
    let fine = moved(&plane(6, 0.0), |v| {
        let off = if v.x == 0.0 && v.y > 0.1 && v.y < 0.9 { 1e-4 * (7.0 * v.y).sin() } else { 0.0 };
        DVec3::new(1.0 + v.x + off, v.y, 0.0)
    });
    let both = union(&coarse, &fine);
    let Repaired { mesh, origin, counts, .. } = welded(&both, 1e-3);
    assert_lies_on(&mesh, &origin, &both, 1e-3);
    let got = topology(&mesh);
    assert_eq!((got.components, got.boundary_loops, got.euler), (1, 1, 1), "{got:?}");
    assert_eq!((counts.edges_joined, got.nonmanifold_edges, got.inconsistent_edges), (4, 0, 0));
    assert_eq!(welded(&both, 1e-9).counts.edges_joined, 0);
    assert_eq!(welded(&mesh, 1e-3).mesh, mesh);
}

#[test]
fn faces_agree_with_the_larger_part() {
    let mut mesh = sample("torus").unwrap();
    let whole = mesh.clone();
    for t in (0..mesh.triangles.len()).step_by(3) {
        mesh.triangles[t].swap(1, 2);
    }
    let Repaired { mesh: got, origin, counts, .. } = repair(&mesh).unwrap();
    assert!(topology(&got).is_closed_manifold());
    assert_eq!(got, whole);
    assert_lies_on(&got, &origin, &mesh, 0.0);
    assert_eq!(counts.faces_turned, mesh.triangles.len().div_ceil(3));
    assert_eq!(
        counts.notes(),
        [format!("{} faces were flipped to agree with the neighbours", counts.faces_turned)]
    );
    // Inside out stays inside out.
    let mut inward = cube();
    inward.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert_eq!(repair(&inward).unwrap().mesh, inward);
}

#[test]
fn what_has_no_two_sides_stays() {
    let (along, tau) = (24, std::f64::consts::TAU);
    let mut band = TriMesh::default();
    for i in 0..along {
        let a = tau * f64::from(i) / f64::from(along);
        for side in [-0.3, 0.3] {
            let r = 1.0 + side * (0.5 * a).cos();
            band.vertices.push(DVec3::new(r * a.cos(), r * a.sin(), side * (0.5 * a).sin()));
        }
    }
    for i in 0..along {
        let (p, q) = (2 * i, 2 * i + 1);
        let [r, s] = if i + 1 < along { [p + 2, q + 2] } else { [1, 0] };
        band.triangles.extend([[p, r, q], [q, r, s]]);
    }
    let Repaired { mesh, counts, .. } = repair(&band).unwrap();
    assert_eq!(mesh, band);
    assert_eq!((counts.unorientable_components, counts.faces_turned), (1, 0));
}

#[test]
fn small_components_are_dropped_but_never_all() {
    let far = |mesh: &TriMesh, x: f64| moved(mesh, |v| v + DVec3::X * x);
    let three = union(&union(&sphere(1.0, 2), &far(&sphere(0.1, 2), 3.0)), &far(&sphere(0.01, 2), 5.0));
    let left = |share: f64| {
        let options = RepairOptions::default().min_component(share);
        let Repaired { mesh, origin, counts, .. } = repair_with(&three, &options).unwrap();
        assert_lies_on(&mesh, &origin, &three, 0.0);
        assert_eq!(topology(&mesh).components + counts.components_removed, 3);
        topology(&mesh).components
    };
    assert_eq!([0.0, 1e-3, 0.5, 0.999].map(left), [3, 2, 1, 1]);
    let options = RepairOptions::default().min_component(1.0);
    assert!(repair_with(&three, &options).unwrap_err().to_string().contains("`min_component` 1"));
    assert_eq!(repair(&three).unwrap().counts, RepairCounts::default());
}

/// Squares of such lengths vanish or overflow. Found by `fuzz/`.
#[test]
fn tolerances_and_areas_work_at_every_size() {
    let small = moved(&cube(), |v| 0.1 * v + DVec3::splat(4.0));
    let mut input = union(&shattered(&sphere(1.0, 2), 1e-4), &small);
    for t in [3, 50, 51] {
        input.triangles[t].swap(1, 2);
    }
    let options = RepairOptions::default().weld(1e-3).min_component(0.1);
    let want = repair_with(&input, &options).unwrap();
    assert!(want.counts.near_vertices_welded > 100 && want.counts.components_removed == 1);
    assert_eq!(want.counts.faces_turned, 3);
    for power in [-1000, -700, -300, 300, 700, 1000] {
        // A power of two changes no digit.
        let scale = 2_f64.powi(power);
        let got = repair_with(&moved(&input, |v| v * scale), &options).unwrap();
        assert_eq!(got.mesh, moved(&want.mesh, |v| v * scale), "2^{power}");
        assert_eq!((got.counts, &got.origin), (want.counts, &want.origin), "2^{power}");
    }
}
