//! The undirected edges of a mesh, each with the corners it comes from: the base of topology and quality.

use rayon::slice::ParallelSliceMut;

use super::NONE;

/// One side of a triangle, filed under the undirected edge it lies on.
///
/// Ordered by edge, then by side, so that a sorted list groups the sides of an edge in a fixed order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    /// Smaller vertex index in the upper half, larger in the lower.
    key: u64,
    /// `3 * triangle + k`: the side from corner `k` to corner `(k + 1) % 3`.
    half: u32,
}

impl HalfEdge {
    /// The edge's two vertices, the smaller index first; equal where a triangle repeats a vertex.
    pub(crate) fn ends(self) -> (u32, u32) {
        ((self.key >> 32) as u32, self.key as u32)
    }

    /// The triangle this side belongs to.
    pub(crate) fn triangle(self) -> usize {
        self.half as usize / 3
    }

    /// The two corners (`3 * triangle + k`) in the order in which the triangle passes them.
    pub(crate) fn corners(self) -> (usize, usize) {
        let (t, k) = (self.half as usize / 3, self.half as usize % 3);
        (3 * t + k, 3 * t + (k + 1) % 3)
    }
}

/// All sides of all triangles, grouped by undirected edge.
#[derive(Debug)]
pub(crate) struct EdgeTable {
    sides: Vec<HalfEdge>,
}

impl EdgeTable {
    /// Sorts the sides of `triangles`, of which there may be at most `u32::MAX / 3`.
    pub(crate) fn new(triangles: &[[u32; 3]]) -> Self {
        let mut sides: Vec<HalfEdge> = (0u32..)
            .zip(triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]))
            .map(|(half, (a, b))| HalfEdge { key: u64::from(a.min(b)) << 32 | u64::from(a.max(b)), half })
            .collect();
        sides.par_sort_unstable();
        Self { sides }
    }

    /// The edges in ascending order of their vertices, each as its sides in ascending order.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.sides.chunk_by(|a, b| a.key == b.key)
    }
}

/// For each half-edge `3 * triangle + side` the one that runs against it: [`NONE`] at boundaries, where more than two
/// triangles meet, and where two meet that run the same way along the side.
pub(crate) fn twins(triangles: &[[u32; 3]]) -> Vec<u32> {
    let corners = triangles.as_flattened();
    let mut twins = vec![NONE; corners.len()];
    for sides in EdgeTable::new(triangles).edges() {
        if let [one, two] = sides {
            let ((a, _), (b, _)) = (one.corners(), two.corners());
            if corners[a] != corners[b] {
                twins[a] = b as u32;
                twins[b] = a as u32;
            }
        }
    }
    twins
}
