//! Plates with tunnels, rings and bridges, whose handles are known.

use super::{most_handles, remove_small_handles};
use crate::mesh::topology::topology;
use crate::{ProgressToken, TriMesh};
use glam::DVec3;
use std::collections::HashMap;

/// The surface of these voxels of side 1, which must meet at faces only.
fn voxels(is_solid: impl Fn([i32; 3]) -> bool, size: [i32; 3]) -> TriMesh {
    let mut known = HashMap::new();
    let mut mesh = TriMesh::default();
    let cells =
        (0..size[0]).flat_map(|x| (0..size[1]).flat_map(move |y| (0..size[2]).map(move |z| [x, y, z])));
    let cells: Vec<[i32; 3]> = cells.collect();
    for cell in cells.into_iter().filter(|cell| is_solid(*cell)) {
        for (axis, step) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beside = cell;
            beside[axis] += 2 * step - 1;
            let is_inside = (0..3).all(|k| (0..size[k]).contains(&beside[k]));
            if is_inside && is_solid(beside) {
                continue;
            }
            let corner = |[i, j]: [i32; 2]| {
                let mut at = cell;
                at[axis] += step;
                at[(axis + 1) % 3] += i;
                at[(axis + 2) % 3] += j;
                at
            };
            let mut square = [[0, 0], [1, 0], [1, 1], [0, 1]].map(corner);
            if step == 0 {
                square.reverse();
            }
            let [a, b, c, d] = square.map(|at| {
                *known.entry(at).or_insert_with(|| {
                    mesh.vertices.push(DVec3::from_array(at.map(f64::from)));
                    mesh.vertices.len() as u32 - 1
                })
            });
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn volume(mesh: &TriMesh) -> f64 {
    let of = |[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.vertices[*v as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(of).sum()
}

/// Removes handles within half of `radius`, and compares what is left with what should be.
fn check(mut mesh: TriMesh, radius: f64, removed: usize, genus: i64) {
    let before = (volume(&mesh), mesh.triangles.len());
    assert_eq!(topology(&mesh).genus, Some(genus + removed as i64));
    let most = most_handles(&mesh);
    let found = remove_small_handles(&mut mesh, radius, most, &ProgressToken::default()).unwrap();
    let after = topology(&mesh);
    assert_eq!((found, after.genus), (removed, Some(genus)));
    assert!(after.is_closed_manifold() && after.components == 1, "{after:?}");
    // What a tunnel or bridge of a voxel or two fills.
    let change = (volume(&mesh) - before.0).abs();
    assert!(change <= 4.0 * removed as f64, "{change}");
    assert_eq!(removed == 0, mesh.triangles.len() == before.1);
}

#[test]
fn tunnels_are_removed_where_they_are_small_both_ways() {
    let plate = |holes: &'static [[i32; 2]]| voxels(|[x, y, _]| !holes.contains(&[x, y]), [32, 32, 2]);
    check(plate(&[]), 4.0, 0, 0);
    check(plate(&[[1, 9]]), 6.0, 1, 0);
    // In reach of each other, so that a cut changes the region of the next.
    check(plate(&[[1, 5], [1, 7], [1, 9], [30, 15]]), 6.0, 4, 0);
    // The way through this one and back leads around the plate.
    check(plate(&[[9, 9]]), 6.0, 0, 1);
    let is_wide = |[x, y, _]: [i32; 3]| !((3..29).contains(&x) && (3..29).contains(&y));
    check(voxels(is_wide, [32, 32, 2]), 6.0, 0, 1);
    let with_both = |[x, y, z]: [i32; 3]| is_wide([x, y, z]) && [x, y] != [1, 9];
    check(voxels(with_both, [32, 32, 2]), 6.0, 1, 1);
}

#[test]
fn bridges_are_cut_where_they_are_small_and_long_thin_ones_are_kept() {
    // An arch over a block; its legs are two voxels high, its span `wide`.
    let arch = |wide: i32| {
        let is_solid = move |[x, y, z]: [i32; 3]| {
            let is_leg = y == 5 && (4..6).contains(&z) && (x == 3 || x == 3 + wide);
            let is_beam = y == 5 && z == 6 && (3..=3 + wide).contains(&x);
            z < 4 || is_leg || is_beam
        };
        voxels(is_solid, [20, 11, 7])
    };
    check(arch(2), 6.0, 1, 0);
    check(arch(12), 6.0, 0, 1);
}

#[test]
fn a_small_ring_and_a_lattice_stay() {
    check(voxels(|[x, y, _]| [x, y] != [1, 1], [3, 3, 1]), 10.0, 0, 1);
    // Beams along three axes: 9 columns of 3 holes each way.
    let is_beam = |at: [i32; 3]| at.iter().filter(|k| **k % 3 == 0).count() >= 2;
    let lattice = voxels(is_beam, [10, 10, 10]);
    let genus = topology(&lattice).genus.unwrap();
    assert!(genus > 50);
    check(lattice, 4.0, 0, genus);
}
