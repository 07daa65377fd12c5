//! Half-edges and the undirected edges they lie on: next, previous, twins, edge keys.
//!
//! Half-edge `3 * t + k` runs from corner `k` of triangle `t` to the next corner, so that a half-edge and the
//! corner that it leaves have the same number.

use bytemuck::allocation::zeroed_vec;
use rayon::iter::{Either, once};
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicU32, Ordering};

use super::NONE;

/// The half-edge after `h` in its triangle.
#[inline]
pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The half-edge before `h` in its triangle.
#[inline]
pub(crate) fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// Undirected edges, each as its [`edge_key`].
pub(crate) type EdgeSet = HashSet<(u32, u32)>;

/// The undirected edge between two vertices: the smaller index first.
#[inline]
pub(crate) fn edge_key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// A half-edge, filed under the undirected edge it lies on.
///
/// Ordered by edge, then by number, so that a sorted list groups the half-edges of an edge in a fixed order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct HalfEdge {
    /// Its vertex with the smaller index, and the other.
    low: u32,
    high: u32,
    number: u32,
}

impl HalfEdge {
    fn new(a: u32, b: u32, number: u32) -> Self {
        let (low, high) = edge_key(a, b);
        Self { low, high, number }
    }

    /// The edge's two vertices, the smaller index first; equal where a triangle repeats a vertex.
    #[inline]
    pub(crate) fn ends(self) -> (u32, u32) {
        (self.low, self.high)
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

/// Ranges of buckets or vertices that are filled at the same time, at most: each takes a look at everything.
const MOST_RANGES: usize = 8;
/// Fewer corners than this are looked at by one thread.
const FEW_CORNERS: usize = 1 << 14;
/// Buckets of half-edges that one thread sorts at a time.
const BUCKETS: usize = 4096;

/// All half-edges of a mesh, grouped by undirected edge.
#[derive(Debug)]
pub(crate) struct EdgeTable {
    half_edges: Vec<HalfEdge>,
}

impl EdgeTable {
    /// Sorts the half-edges of `triangles`, of which there may be at most `u32::MAX / 3`.
    pub(crate) fn new(triangles: &[[u32; 3]]) -> Self {
        let largest = triangles.as_flattened().par_iter().max().copied().unwrap_or(0);
        // Buckets by the smaller vertex, of several where there are more vertices than half-edges; a bucket
        // holds few half-edges, and near ones are near in memory.
        let wide = u64::from(largest) / (3 * triangles.len().max(1) as u64) + 1;
        let shift = wide.next_power_of_two().trailing_zeros();
        // Every thread looks at all half-edges and takes those of its own range of buckets.
        let in_range = |first: usize, count: usize, visit: &mut dyn FnMut(usize, HalfEdge)| {
            for (number, &[a, b, c]) in (0u32..).step_by(3).zip(triangles) {
                for (k, (a, b)) in (0..).zip([(a, b), (b, c), (c, a)]) {
                    let bucket = ((a.min(b) >> shift) as usize).wrapping_sub(first);
                    if bucket < count {
                        visit(bucket, HalfEdge::new(a, b, number + k));
                    }
                }
            }
        };
        let mut ends = vec![0u32; (largest >> shift) as usize + 1];
        let wide = ends.len().div_ceil(rayon::current_num_threads().min(MOST_RANGES));
        ends.par_chunks_mut(wide).enumerate().for_each(|(r, counts)| {
            in_range(r * wide, counts.len(), &mut |bucket, _| counts[bucket] += 1);
        });
        let mut half_edges: Vec<HalfEdge> = zeroed_vec(3 * triangles.len());
        let mut rest = half_edges.as_mut_slice();
        let mut ranges = Vec::new();
        for (r, counts) in ends.chunks_mut(wide).enumerate() {
            let mut end = 0;
            for count in counts.iter_mut() {
                (*count, end) = (end, end + *count);
            }
            let (range, after) = rest.split_at_mut(end as usize);
            ranges.push((r * wide, range, counts));
            rest = after;
        }
        ranges.into_par_iter().for_each(|(first, range, starts)| {
            // What was the start of a bucket becomes its end.
            in_range(first, starts.len(), &mut |bucket, half_edge| {
                range[starts[bucket] as usize] = half_edge;
                starts[bucket] += 1;
            });
            sort_buckets(range, starts);
        });
        Self { half_edges }
    }

    /// The edges in ascending order of their vertices, each as its half-edges in ascending order.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.half_edges.chunk_by(|a, b| a.ends() == b.ends())
    }

    /// Like [`EdgeTable::edges`], by all threads, or by one if there are few.
    pub(crate) fn par_edges(&self) -> impl ParallelIterator<Item = &[HalfEdge]> {
        if self.half_edges.len() < FEW_CORNERS {
            return Either::Left(once(()).flat_map_iter(|()| self.edges()));
        }
        Either::Right(self.half_edges.par_chunk_by(|a, b| a.ends() == b.ends()))
    }

    /// See [`twins`]; `triangles` are those that the table was made of.
    pub(crate) fn twins(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        // Each is written at most once, by any thread.
        let half_edges = self.half_edges.par_iter().with_min_len(FEW_CORNERS);
        let twins: Vec<AtomicU32> = half_edges.map(|_| AtomicU32::new(NONE)).collect();
        self.par_edges().for_each(|edge| {
            if let Some([a, b]) = twin_pair(triangles, edge) {
                twins[a].store(b as u32, Ordering::Relaxed);
                twins[b].store(a as u32, Ordering::Relaxed);
            }
        });
        twins.into_iter().map(AtomicU32::into_inner).collect()
    }
}

/// Sorts each bucket of a list, given where they end.
fn sort_buckets(half_edges: &mut [HalfEdge], ends: &[u32]) {
    let mut rest = half_edges;
    let mut start = 0;
    let mut groups = Vec::with_capacity(ends.len().div_ceil(BUCKETS));
    for ends in ends.chunks(BUCKETS) {
        let end = ends.last().map_or(start, |end| *end as usize);
        let (group, after) = rest.split_at_mut(end - start);
        groups.push((start, group, ends));
        (rest, start) = (after, end);
    }
    groups.into_par_iter().for_each(|(mut start, mut group, ends)| {
        for end in ends {
            let (bucket, after) = group.split_at_mut(*end as usize - start);
            bucket.sort_unstable();
            (group, start) = (after, *end as usize);
        }
    });
}

/// The two half-edges of an edge if there are just two and they run against each other.
pub(crate) fn twin_pair(triangles: &[[u32; 3]], edge: &[HalfEdge]) -> Option<[usize; 2]> {
    let [one, two] = edge else { return None };
    let [a, b] = [one.corners().0, two.corners().0];
    let corners = triangles.as_flattened();
    (corners[a] != corners[b]).then_some([a, b])
}

/// Calls `fold` with the value of the vertex at each of `corners` and with the number of the corner, for each
/// vertex in ascending order. Panics if an index is out of range.
pub(crate) fn par_fold_corners<T: Send>(
    corners: &[u32],
    values: &mut [T],
    fold: impl Fn(&mut T, u32) + Sync,
) {
    let count = values.len();
    assert!(count > 0 || corners.is_empty(), "there are corners, but no vertices");
    let ranges = if corners.len() < FEW_CORNERS { 1 } else { rayon::current_num_threads().min(MOST_RANGES) };
    let wide = count.div_ceil(ranges).max(1);
    // Every thread looks at all corners and takes those at its own range of vertices.
    values.par_chunks_mut(wide).enumerate().for_each(|(r, values)| {
        for (corner, &v) in (0u32..).zip(corners) {
            assert!((v as usize) < count, "there is no vertex {v}");
            if let Some(value) = values.get_mut((v as usize).wrapping_sub(r * wide)) {
                fold(value, corner);
            }
        }
    });
}

/// For each half-edge the one that runs against it: [`NONE`] at boundaries, where more than two triangles
/// meet, and where two meet that run the edge in the same direction.
pub(crate) fn twins(triangles: &[[u32; 3]]) -> Vec<u32> {
    EdgeTable::new(triangles).twins(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn corners_are_folded_in_ascending_order_at_each_vertex() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        for (count, vertices) in [(0, 3), (9, 4), (3 * FEW_CORNERS, 5), (3 * FEW_CORNERS, 10_000)] {
            let corners: Vec<u32> = (0..count).map(|_| rng.random_range(0..vertices as u32)).collect();
            let mut wanted = vec![Vec::new(); vertices];
            (0..).zip(&corners).for_each(|(corner, v): (u32, _)| wanted[*v as usize].push(corner));
            for threads in [1, 3, 16] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let mut found = vec![Vec::new(); vertices];
                pool.install(|| par_fold_corners(&corners, &mut found, |list, corner| list.push(corner)));
                assert_eq!(found, wanted, "{count} corners, {threads} threads");
            }
        }
    }

    #[test]
    #[should_panic(expected = "no vertices")]
    fn corners_without_vertices_are_refused() {
        par_fold_corners(&[0], &mut [], |(), _| ());
    }

    #[test]
    fn half_edges_are_sorted_by_edge_and_number() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        // Many triangles at few vertices, few at many, and the largest index there is.
        for (count, most) in
            [(0, 1), (1, 3), (7, 4), (20_000, 50), (20_000, 10_000), (9, 1 << 31), (3, u32::MAX)]
        {
            let mut vertex = || rng.random_range(0..=most);
            let triangles: Vec<[u32; 3]> =
                (0..count).map(|_| std::array::from_fn(|_| vertex())).chain([[most; 3]]).collect();
            let mut wanted: Vec<HalfEdge> = (0u32..)
                .zip(triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]))
                .map(|(number, (a, b))| HalfEdge::new(a, b, number))
                .collect();
            wanted.sort_unstable();
            assert!(EdgeTable::new(&triangles).half_edges == wanted, "{count} triangles");
        }
    }
}
