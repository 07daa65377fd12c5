//! Shapes with vertices in a known order.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use crate::TriMesh;
use crate::mesh::half_edges::edge_key;
use crate::mesh::triangle::doubled_normal;

/// A torus around z with radii 1 and 0.35 and `2 * around * tube` triangles.
pub(super) struct Torus {
    /// Vertices the long way round, at least 3.
    pub(super) around: u32,
    /// Vertices round the tube, at least 3.
    pub(super) tube: u32,
    /// How much denser one side is than the other, both ways: 0 (even) to below 1.
    pub(super) warp: f64,
    /// How far vertices stray along the surface: 0 to below 0.5 of their distance.
    pub(super) jitter: f64,
}

pub(super) fn torus(shape: Torus) -> TriMesh {
    let Torus { around, tube, warp, jitter } = shape;
    let mut mesh = TriMesh::default();
    let angle = |step: u32, of: u32, seed: u32| {
        // Strayed before the warp, which is monotonous, so that no triangle folds over.
        let even = TAU * (f64::from(step) + 2.0 * jitter * (noise(seed) - 0.5)) / f64::from(of);
        even + warp * even.sin()
    };
    for i in 0..around {
        for j in 0..tube {
            let seed = 2 * (i * tube + j);
            let (u, v) = (angle(i, around, seed), angle(j, tube, seed + 1));
            let from_axis = 1.0 + 0.35 * v.cos();
            mesh.vertices.push(DVec3::new(from_axis * u.cos(), from_axis * u.sin(), 0.35 * v.sin()));
        }
    }
    for i in 0..around {
        for j in 0..tube {
            let at = |di, dj| (i + di) % around * tube + (j + dj) % tube;
            let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
            if (i + j) % 2 == 0 {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                mesh.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    mesh
}

/// A fixed number in 0..1 for each seed, without visible pattern.
fn noise(seed: u32) -> f64 {
    // The finishing step of SplitMix64.
    let mut bits = (u64::from(seed) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// The unit sphere, `20 * 4^splits` triangles from an icosahedron.
pub(super) fn sphere(splits: u32) -> TriMesh {
    let mut mesh = icosahedron();
    for _ in 0..splits {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let TriMesh { vertices, triangles } = &mut mesh;
        let mut middle = |a: u32, b: u32| {
            *middles.entry(edge_key(a, b)).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        let quarters = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        *triangles = triangles.iter().copied().flat_map(quarters).collect();
    }
    mesh
}

fn icosahedron() -> TriMesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices = Vec::with_capacity(12);
    for turn in 0..3 {
        for (one, long) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut position = [0.0, one, long];
            position.rotate_right(turn);
            vertices.push(DVec3::from_array(position).normalize());
        }
    }
    // Neighbours are the only pairs this close, so the faces are the triples of mutual neighbours.
    let near = |a: u32, b: u32| vertices[a as usize].distance(vertices[b as usize]) < 1.1;
    let mut triangles = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let corners = [a, b, c].map(|vertex| vertices[vertex as usize]);
                    let outward = doubled_normal(corners).dot(corners[0]) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    TriMesh { vertices, triangles }
}

/// The upper half of the unit sphere, open at z = 0, of `rings` rings of `around` vertices below the pole.
pub(super) fn hemisphere(rings: u32, around: u32) -> TriMesh {
    let mut mesh = TriMesh { vertices: vec![DVec3::Z], triangles: Vec::new() };
    let at = |ring: u32, step: u32| 1 + (ring - 1) * around + step % around;
    for ring in 1..=rings {
        let (height, radius) = if ring == rings {
            // The boundary lies in the plane exactly.
            (0.0, 1.0)
        } else {
            let from_pole = FRAC_PI_2 * f64::from(ring) / f64::from(rings);
            (from_pole.cos(), from_pole.sin())
        };
        for step in 0..around {
            let turn = TAU * f64::from(step) / f64::from(around);
            mesh.vertices.push(DVec3::new(radius * turn.cos(), radius * turn.sin(), height));
            if ring == 1 {
                mesh.triangles.push([0, at(1, step), at(1, step + 1)]);
            } else {
                let [a, b] = [at(ring - 1, step), at(ring - 1, step + 1)];
                let [c, d] = [at(ring, step), at(ring, step + 1)];
                mesh.triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
    }
    mesh
}

/// A box from the origin to `size`, its sides cut into `cells` along x, y and z.
pub(super) fn grid_box(size: DVec3, cells: [u32; 3]) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    let mut vertex = |at: [u32; 3]| {
        *known.entry(at).or_insert_with(|| {
            let share = |axis: usize| f64::from(at[axis]) / f64::from(cells[axis]);
            mesh.vertices.push(size * DVec3::new(share(0), share(1), share(2)));
            mesh.vertices.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        // In this order (u, v, axis) is right-handed.
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0, cells[axis]] {
            for i in 0..cells[u] {
                for j in 0..cells[v] {
                    let mut corner = |di, dj| {
                        let mut at = [0; 3];
                        (at[axis], at[u], at[v]) = (side, i + di, j + dj);
                        vertex(at)
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    let far = [[a, b, c], [a, c, d]];
                    let near = [[a, c, b], [a, d, c]];
                    mesh.triangles.extend(if side == 0 { near } else { far });
                }
            }
        }
    }
    mesh
}

/// A regular tetrahedron with corners on the unit sphere.
pub(super) fn tetrahedron() -> TriMesh {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    TriMesh {
        vertices: corners.map(|corner| DVec3::from_array(corner).normalize()).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
    }
}
