//! Half-edges and the undirected edges they lie on: next, previous, twins, edge keys.
//!
//! Half-edge `3 * t + k` runs from corner `k` of triangle `t` to the next corner, so that a half-edge and the
//! corner that it leaves have the same number.

use rayon::slice::ParallelSliceMut;
use std::collections::HashSet;

use super::NONE;

/// The half-edge after `h` in its triangle.
pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The half-edge before `h` in its triangle.
pub(crate) fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// Undirected edges, each as its [`edge_key`].
pub(crate) type EdgeSet = HashSet<(u32, u32)>;

/// The undirected edge between two vertices: the smaller index first.
pub(crate) fn edge_key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// A half-edge, filed under the undirected edge it lies on.
///
/// Ordered by edge, then by number, so that a sorted list groups the half-edges of an edge in a fixed order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    /// Smaller vertex index in the upper half, larger in the lower.
    key: u64,
    number: u32,
}

impl HalfEdge {
    fn new(a: u32, b: u32, number: u32) -> Self {
        let (low, high) = edge_key(a, b);
        Self { key: u64::from(low) << 32 | u64::from(high), number }
    }

    /// The edge's two vertices, the smaller index first; equal where a triangle repeats a vertex.
    pub(crate) fn ends(self) -> (u32, u32) {
        ((self.key >> 32) as u32, self.key as u32)
    }

    /// The triangle it belongs to.
    pub(crate) fn triangle(self) -> usize {
        self.number as usize / 3
    }

    /// The corners (`3 * triangle + k`) that it leaves and reaches; the first is also its own number.
    pub(crate) fn corners(self) -> (usize, usize) {
        (self.number as usize, next(self.number) as usize)
    }
}

/// All half-edges of a mesh, grouped by undirected edge.
#[derive(Debug)]
pub(crate) struct EdgeTable {
    half_edges: Vec<HalfEdge>,
}

impl EdgeTable {
    /// Sorts the half-edges of `triangles`, of which there may be at most `u32::MAX / 3`.
    pub(crate) fn new(triangles: &[[u32; 3]]) -> Self {
        let mut half_edges: Vec<HalfEdge> = (0u32..)
            .zip(triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]))
            .map(|(number, (a, b))| HalfEdge::new(a, b, number))
            .collect();
        half_edges.par_sort_unstable();
        Self { half_edges }
    }

    /// The edges in ascending order of their vertices, each as its half-edges in ascending order.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.half_edges.chunk_by(|a, b| a.key == b.key)
    }

    /// See [`twins`]; `triangles` are those that the table was made of.
    pub(crate) fn twins(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let mut twins = vec![NONE; self.half_edges.len()];
        for edge in self.edges() {
            if let Some([a, b]) = twin_pair(triangles, edge) {
                twins[a] = b as u32;
                twins[b] = a as u32;
            }
        }
        twins
    }
}

/// The two half-edges of an edge if there are just two and they run against each other.
pub(crate) fn twin_pair(triangles: &[[u32; 3]], edge: &[HalfEdge]) -> Option<[usize; 2]> {
    let [one, two] = edge else { return None };
    let [a, b] = [one.corners().0, two.corners().0];
    let corners = triangles.as_flattened();
    (corners[a] != corners[b]).then_some([a, b])
}

/// For each half-edge the one that runs against it: [`NONE`] at boundaries, where more than two triangles
/// meet, and where two meet that run the edge in the same direction.
pub(crate) fn twins(triangles: &[[u32; 3]]) -> Vec<u32> {
    EdgeTable::new(triangles).twins(triangles)
}
