//! The zero surface of a field, by marching tetrahedra: closed and manifold by construction.

use std::collections::HashMap;

use glam::DVec3;

use crate::TriMesh;
use crate::mesh::triangle::doubled_normal;

/// Six tetrahedra that fill a cube along its diagonal from corner 0 to 7 (bit 0 is x, bit 1 y, bit 2 z): one
/// for each order of the axes, so that those of neighbouring cubes meet face to face.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// Triangles where `field`, negative inside, crosses zero, on a grid of about `spacing` from `lo` to `hi`.
/// The field must be positive on the box's own surface.
pub(super) fn level_set(field: impl Fn(DVec3) -> f64, lo: DVec3, hi: DVec3, spacing: f64) -> TriMesh {
    let cells = ((hi - lo) / spacing).ceil().to_array().map(|count| count as u32);
    let [nx, ny, nz] = cells.map(|count| count + 1);
    let position = |node: u32| {
        let at = DVec3::new((node % nx).into(), (node / nx % ny).into(), (node / (nx * ny)).into());
        lo + at * spacing
    };
    let values: Vec<f64> = (0..nx * ny * nz).map(|node| field(position(node))).collect();
    let mut surface = Surface { values, position, mesh: TriMesh::default(), known: HashMap::new() };
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let corner = |bits: usize| {
                    let bit = |axis: usize| (bits >> axis & 1) as u32;
                    x + bit(0) + nx * (y + bit(1) + ny * (z + bit(2)))
                };
                for tetrahedron in TETRAHEDRA {
                    surface.cut(tetrahedron.map(corner));
                }
            }
        }
    }
    surface.mesh
}

struct Surface<P> {
    values: Vec<f64>,
    position: P,
    mesh: TriMesh,
    /// The vertex on each grid edge that the surface crosses.
    known: HashMap<(u32, u32), u32>,
}

impl<P: Fn(u32) -> DVec3> Surface<P> {
    fn cut(&mut self, nodes: [u32; 4]) {
        let (inside, outside): (Vec<u32>, Vec<u32>) =
            nodes.iter().partition(|node| self.values[**node as usize] < 0.0);
        match (inside.as_slice(), outside.as_slice()) {
            (&[a], &[p, q, r]) => self.triangle([(a, p), (a, q), (a, r)]),
            (&[a, b, c], &[p]) => self.triangle([(a, p), (b, p), (c, p)]),
            (&[a, b], &[p, q]) => {
                self.triangle([(a, p), (a, q), (b, q)]);
                self.triangle([(a, p), (b, q), (b, p)]);
            }
            _ => {}
        }
    }

    /// A triangle across three edges, each from inside to outside.
    fn triangle(&mut self, edges: [(u32, u32); 3]) {
        let [a, b, c] = edges.map(|(inside, outside)| self.vertex(inside, outside));
        let corners = [a, b, c].map(|vertex| self.mesh.vertices[vertex as usize]);
        let way = |(inside, outside): (u32, u32)| (self.position)(outside) - (self.position)(inside);
        let outward = edges.into_iter().map(way).sum::<DVec3>();
        let faces_out = doubled_normal(corners).dot(outward) > 0.0;
        self.mesh.triangles.push(if faces_out { [a, b, c] } else { [a, c, b] });
    }

    fn vertex(&mut self, inside: u32, outside: u32) -> u32 {
        *self.known.entry((inside, outside)).or_insert_with(|| {
            let [from, to] = [inside, outside].map(|node| self.values[node as usize]);
            // Kept off the nodes, where the vertices of several edges would fall on one point.
            let share = (from / (from - to)).clamp(0.05, 0.95);
            let [from, to] = [inside, outside].map(&self.position);
            self.mesh.vertices.push(from.lerp(to, share));
            self.mesh.vertices.len() as u32 - 1
        })
    }
}
