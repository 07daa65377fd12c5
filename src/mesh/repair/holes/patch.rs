//! The patch that fills a hole: triangulated, then divided until it is as dense as its surroundings.

use std::collections::HashMap;
use std::f64::consts::SQRT_2;

use glam::DVec3;

use super::{Hole, sides, triangulate};
use crate::mesh::TriMesh;
use crate::mesh::half_edges::{EdgeSet, edge_key};
use crate::mesh::triangle::doubled_normal;

/// Rounds of divisions, each followed by flips.
const ROUNDS: usize = 24;
/// Sweeps of flips after a division.
const SWEEPS: usize = 12;
/// A patch gets about this many new vertices at most, since making it fair takes time: larger triangles where
/// it would have more.
const MOST: f64 = 4000.0;

/// Triangles over a hole. Its vertices come first, then new ones.
pub(super) struct Patch {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// How long edges at each vertex are to be.
    lengths: Vec<f64>,
    /// How many vertices the hole has.
    around: usize,
}

impl Patch {
    /// Without edges between vertices of the hole that the mesh has already; `None` if there is none.
    pub fn of(hole: &Hole, mesh: &TriMesh, taken: &EdgeSet) -> Option<Self> {
        let mut triangles = Vec::new();
        if !triangulate(&hole.vertices, &mesh.vertices, taken, &mut triangles) {
            return None;
        }
        let place: HashMap<u32, u32> = hole.vertices.iter().copied().zip(0..).collect();
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| place[&v])).collect();
        let vertices: Vec<DVec3> = hole.vertices.iter().map(|v| mesh.vertices[*v as usize]).collect();
        let around = vertices.len();
        let side = |k: usize| vertices[k % around].distance(vertices[(k + around - 1) % around]);
        let lengths = (0..around).map(|k| 0.5 * (side(k) + side(k + 1))).collect();
        let mut patch = Self { vertices, triangles, lengths, around };
        patch.limit_density();
        let number = |v: u32| hole.vertices.get(v as usize).copied();
        let is_taken =
            |v: u32, w: u32| number(v).zip(number(w)).is_some_and(|(v, w)| taken.contains(&edge_key(v, w)));
        patch.flip(is_taken);
        for _ in 0..ROUNDS {
            if !patch.divide() {
                break;
            }
            patch.flip(is_taken);
        }
        Some(patch)
    }

    /// The new vertices.
    pub fn inner(&self) -> &[DVec3] {
        &self.vertices[self.around..]
    }

    /// Whether a vertex is one of the hole's.
    pub fn is_around(&self, v: u32) -> bool {
        (v as usize) < self.around
    }

    fn corners(&self, t: [u32; 3]) -> [DVec3; 3] {
        t.map(|v| self.vertices[v as usize])
    }

    /// Makes the lengths so long that there will not be too many vertices.
    fn limit_density(&mut self) {
        let area: f64 = self.triangles.iter().map(|t| 0.5 * doubled_normal(self.corners(*t)).length()).sum();
        let mean = self.lengths.iter().sum::<f64>() / self.around as f64;
        // Of equilateral triangles, two for each vertex.
        let count = area / (0.75_f64.sqrt() * mean * mean).max(f64::MIN_POSITIVE);
        let factor = (count / MOST).sqrt();
        if factor > 1.0 {
            self.lengths.iter_mut().for_each(|length| *length *= factor);
        }
    }

    /// Puts vertices into triangles that are larger than those around the hole; returns whether there are
    /// any.
    fn divide(&mut self) -> bool {
        let count = self.triangles.len();
        for t in 0..count {
            let triangle = self.triangles[t];
            let centre = self.corners(triangle).into_iter().sum::<DVec3>() / 3.0;
            let length = triangle.iter().map(|v| self.lengths[*v as usize]).sum::<f64>() / 3.0;
            let is_large = triangle.iter().all(|v| {
                let reach = SQRT_2 * self.vertices[*v as usize].distance(centre);
                reach > length && reach > self.lengths[*v as usize]
            });
            if is_large {
                let new = self.vertices.len() as u32;
                self.vertices.push(centre);
                self.lengths.push(length);
                let [a, b, c] = triangle;
                self.triangles[t] = [a, b, new];
                self.triangles.extend([[b, c, new], [c, a, new]]);
            }
        }
        self.triangles.len() > count
    }

    /// Flips edges until the angles opposite each have a sum of at most 180 degrees, as in Delaunay
    /// triangulations, but makes no edge that is taken.
    fn flip(&mut self, is_taken: impl Fn(u32, u32) -> bool) {
        for _ in 0..SWEEPS {
            let mut edges: HashMap<(u32, u32), (usize, u32)> = HashMap::new();
            let mut pairs = Vec::new();
            for (t, [a, b, c]) in self.triangles.iter().enumerate() {
                for (v, w, opposite) in [(*a, *b, *c), (*b, *c, *a), (*c, *a, *b)] {
                    // In the order of the other side's triangle.
                    if let Some((other, beyond)) = edges.insert(edge_key(v, w), (t, opposite)) {
                        pairs.push(([w, v], [other, t], [beyond, opposite]));
                    }
                }
            }
            let mut is_stale = vec![false; self.triangles.len()];
            let mut has_flipped = false;
            for (ends, sides, opposite) in pairs {
                let new = edge_key(opposite[0], opposite[1]);
                let is_there = is_taken(new.0, new.1) || edges.contains_key(&new);
                if sides.iter().any(|t| is_stale[*t]) || is_there || !self.is_flipped(ends, opposite) {
                    continue;
                }
                let ([v, w], [c, d]) = (ends, opposite);
                (self.triangles[sides[0]], self.triangles[sides[1]]) = ([v, d, c], [d, w, c]);
                sides.iter().for_each(|t| is_stale[*t] = true);
                edges.insert(new, (sides[0], v));
                has_flipped = true;
            }
            if !has_flipped {
                break;
            }
        }
    }

    /// Whether an edge v w, with `c` on its left and `d` on its right, is to be flipped.
    fn is_flipped(&self, [v, w]: [u32; 2], [c, d]: [u32; 2]) -> bool {
        let at = |v: u32| self.vertices[v as usize];
        let cosine_and_sine = |apex: u32| {
            let (p, q) = (at(v) - at(apex), at(w) - at(apex));
            (p.dot(q), p.cross(q).length())
        };
        let ((x, s), (y, t)) = (cosine_and_sine(c), cosine_and_sine(d));
        // The sine of the sum of both angles, times lengths.
        let is_obtuse = x * t + y * s < -1e-9 * (x.hypot(s) * y.hypot(t));
        let normals = [[v, w, c], [w, v, d], [v, d, c], [d, w, c]].map(|t| doubled_normal(self.corners(t)));
        let before = normals[0] + normals[1];
        is_obtuse && normals[2].dot(before) > 0.0 && normals[3].dot(before) > 0.0
    }

    /// For each triangle, the number of a vertex of the hole whose side is closest to it over the triangles.
    pub fn sides(&self) -> Vec<usize> {
        let mut of_edge: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
        for (t, triangle) in self.triangles.iter().enumerate() {
            sides(triangle).into_iter().for_each(|edge| of_edge.entry(edge).or_default().push(t));
        }
        const NOWHERE: usize = usize::MAX;
        let mut side = vec![NOWHERE; self.triangles.len()];
        let mut front = Vec::new();
        for k in 0..self.around {
            let before = (k + self.around - 1) % self.around;
            for t in of_edge.get(&edge_key(k as u32, before as u32)).into_iter().flatten() {
                if side[*t] == NOWHERE {
                    side[*t] = k;
                    front.push(*t);
                }
            }
        }
        let mut next = 0;
        while next < front.len() {
            let t = front[next];
            next += 1;
            for other in sides(&self.triangles[t]).iter().flat_map(|edge| &of_edge[edge]) {
                if side[*other] == NOWHERE {
                    side[*other] = side[t];
                    front.push(*other);
                }
            }
        }
        side
    }
}
