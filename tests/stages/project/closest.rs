//! `project/closest` with its tree of boxes, and the walk before it, against a look at every triangle.

use super::model::{Model, fan};
use crate::support::{cloud, rounded};
use glam::DVec3;
use rtfmesh::TriMesh;

#[test]
fn projections_are_the_closest_points() {
    for name in ["torus", "genus3", "box", "thin-plate", "open-hemisphere", "two-components", "tetrahedron"] {
        let model = Model::of(name);
        for far in [1e-4, 0.01, 0.2] {
            let (targets, from) = model.near(150, far, 1);
            model.assert_projects(&targets, &from);
        }
        // From anywhere to anywhere.
        let (_, from) = model.near(150, 0.0, 2);
        model.assert_projects(&rounded(&cloud(150, 0.9, 3)), &from);
    }
}

#[test]
fn sizes_do_not_change_results() {
    let model = Model::of("torus");
    let (targets, from) = model.near(200, 0.05, 4);
    let whole = model.project(&targets, &from, 64);
    for count in [0, 1, 15, 16, 17, 63, 64, 65] {
        for workgroup in [16, 64] {
            let some = model.project(&targets[..count], &from[..count], workgroup);
            for (some, whole) in some.iter().zip(&whole) {
                assert_eq!(some.projected, whole.projected[..count]);
                assert_eq!(some.normals, whole.normals[..count]);
                assert_eq!(some.under, whole.under[..count]);
            }
        }
    }
}

#[test]
fn trees_of_every_size() {
    for triangles in [1, 2, 3, 4, 5, 15, 16, 17, 63, 64, 65, 257] {
        let model = Model::new(&fan(triangles, 6.0 / triangles as f64));
        let (_, from) = model.near(60, 0.0, 5);
        model.assert_projects(&rounded(&cloud(60, 1.0, 6)), &from);
    }
}

#[test]
fn a_plate_keeps_its_sides() {
    let model = Model::of("thin-plate");
    // Far from the rim, and up to five thicknesses beyond the other side.
    let inside = |t: &u32| model.corners[*t as usize].iter().all(|p| p.truncate().abs().max_element() < 0.25);
    let up = |t: &u32| model.surface.normals[*t as usize].z;
    let from: Vec<u32> = (0..model.corners.len() as u32).filter(|t| inside(t) && up(t).abs() > 0.9).collect();
    assert!(from.len() > 50);
    let shifts = cloud(from.len(), 0.1, 8);
    let targets: Vec<DVec3> = from
        .iter()
        .zip(shifts)
        .map(|(t, off)| {
            let [a, b, c] = model.corners[*t as usize];
            (a + b + c) / 3.0 + off.with_z(-up(t) * off.z.abs())
        })
        .collect();
    let targets = rounded(&targets);
    for landed in model.project(&targets, &from, 64) {
        assert!(landed.under.iter().zip(&from).all(|(to, from)| up(to) * up(from) > 0.0));
        assert!(landed.normals.iter().zip(&from).all(|(n, t)| f64::from(n.z) * up(t) > 0.9));
    }
}

#[test]
fn slivers_and_large_triangles_among_tiny_ones() {
    // Needles of 1e-4 to 1.
    let model = Model::new(&fan(300, 1e-4));
    let (targets, from) = model.near(200, 0.1, 9);
    let [walked, landed] = model.project(&targets, &from, 64);
    model.assert_closest(&targets, &walked, &landed);
    assert!(walked.normals.iter().chain(&landed.normals).all(|n| (n.length() - 1.0).abs() < 1e-5));

    // A bent sheet of tiny triangles beside two large ones that overlap it.
    let mut mesh = TriMesh {
        vertices: [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| DVec3::new(x, y, 0.01))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let side = 24;
    for k in 0..side * side {
        let (x, y) = (f64::from(k % side), f64::from(k / side));
        mesh.vertices.push(DVec3::new(0.5 + 0.002 * x, 0.3 + 0.003 * y, 0.02 * (0.4 * x).sin()));
        if k % side + 1 < side && k / side + 1 < side {
            let v = 4 + k;
            mesh.triangles.extend([[v, v + 1, v + side + 1], [v, v + side + 1, v + side]]);
        }
    }
    let model = Model::new(&mesh);
    for far in [0.003, 0.1] {
        let (targets, from) = model.near(200, far, 10);
        model.assert_projects(&targets, &from);
    }
}
