//! Zero surfaces of fields on sparse grids, against formulas.

use glam::DVec3;
use rtfmesh::ProgressToken;
use rtfmesh::mesh::level_set::{BLOCK, BLOCK_NODES, SparseGrid, extract};
use rtfmesh::mesh::topology::topology;

/// A grid over the cube from -1 to 1 with these values.
fn grid(side: f64, field: impl Fn(DVec3) -> f64) -> SparseGrid {
    let count = (2.4 / side / f64::from(BLOCK)).ceil() as i32;
    let all = (0..count).flat_map(|z| (0..count).flat_map(move |y| (0..count).map(move |x| [x, y, z])));
    let mut grid = SparseGrid::new(DVec3::splat(-1.2), side, all.collect());
    for b in 0..grid.blocks().len() {
        for number in 0..BLOCK_NODES {
            let p = grid.position(SparseGrid::node(grid.blocks()[b], number));
            grid.values[b * BLOCK_NODES + number] = field(p) as f32;
        }
    }
    grid
}

#[test]
fn a_sphere_is_closed_outward_and_where_it_should_be() {
    let found = extract(&grid(0.07, |p| p.length() - 0.8), &ProgressToken::default()).unwrap();
    let t = topology(&found.mesh);
    assert!(t.is_closed_manifold() && t.components == 1 && t.genus == Some(0), "{t:?}");
    let volume: f64 = (0..found.mesh.triangles.len())
        .map(|k| {
            let [a, b, c] = found.mesh.corners(k);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    let want = 4.0 / 3.0 * std::f64::consts::PI * 0.8_f64.powi(3);
    assert!((volume / want - 1.0).abs() < 0.01, "{volume} of {want}");
    // Linear interpolation along edges of a curved field: a quarter of side^2 over the radius is ample.
    let far = found.mesh.vertices.iter().map(|p| (p.length() - 0.8).abs()).fold(0.0, f64::max);
    assert!(far < 0.25 * 0.07 * 0.07 / 0.8, "{far}");
}

#[test]
fn noise_as_a_field_gives_a_manifold_all_the_same() {
    // Every set of corners inside occurs, also those with ambiguous faces on both sides.
    let noise = |p: DVec3| {
        let hashed = (p.x * 127.1 + p.y * 311.7 + p.z * 74.7).sin() * 43758.5453;
        if p.abs().max_element() > 0.9 { 1.0 } else { hashed - hashed.floor() - 0.5 }
    };
    let found = extract(&grid(0.1, noise), &ProgressToken::default()).unwrap();
    let t = topology(&found.mesh);
    assert!(found.mesh.triangles.len() > 5000 && !found.centres.is_empty());
    assert!(t.boundary_edges == 0 && t.nonmanifold_edges == 0 && t.inconsistent_edges == 0, "{t:?}");
    assert_eq!(t.nonmanifold_vertices, 0);
}

#[test]
fn a_gyroid_in_a_ball_is_closed_and_has_handles() {
    let gyroid = |p: DVec3| {
        let q = 7.0 * p;
        let wave = q.x.sin() * q.y.cos() + q.y.sin() * q.z.cos() + q.z.sin() * q.x.cos();
        (0.15 * wave).max(p.length() - 1.0)
    };
    let t = topology(&extract(&grid(0.06, gyroid), &ProgressToken::default()).unwrap().mesh);
    assert!(t.is_closed_manifold() && t.genus.is_some_and(|genus| genus > 3), "{t:?}");
}

#[test]
fn undefined_values_leave_the_surface_open_there() {
    let half = |p: DVec3| if p.z > 0.3 { f64::NAN } else { p.length() - 0.8 };
    let t = topology(&extract(&grid(0.1, half), &ProgressToken::default()).unwrap().mesh);
    assert!(t.boundary_loops == 1 && t.components == 1 && t.nonmanifold_edges == 0, "{t:?}");
    let empty = extract(&grid(0.3, |_| f64::NAN), &ProgressToken::default()).unwrap();
    assert!(empty.mesh.triangles.is_empty());
}
