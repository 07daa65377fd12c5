//! A hierarchy of boxes over triangles: closest points and overlapping boxes.

mod build;
mod pairs;
mod patch_trees;

use glam::DVec3;
use rayon::prelude::*;

use super::triangle::{closest_on_regular, closest_on_sliver, is_sliver, shortest_height_sq};
use super::{NONE, TriMesh};
use build::{build, build_in_order};
pub(crate) use patch_trees::PatchTrees;

const LEAF_SIZE: usize = 2;
/// Below this depth the heuristic may cut off one triangle at a time; halving then bounds the depth.
const MAX_HEURISTIC_DEPTH: usize = 48;
/// The heuristic's depth and one level for each halving of at most 2^32 triangles.
const STACK: usize = MAX_HEURISTIC_DEPTH + 40;
/// Fewer triangles, or nodes of a tree, than this are done by one thread.
const PARALLEL_SIZE: usize = 1 << 11;
/// Boxes are pruned only beyond the best distance by this factor, since both distances are rounded.
const SLACK: f64 = 1.0 + 1e-12;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates, boundary included.
    pub max: DVec3,
}

impl Aabb {
    /// The box that contains nothing and joins with anything.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box of a triangle.
    #[inline]
    pub fn of([a, b, c]: [DVec3; 3]) -> Self {
        Self { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    #[inline]
    fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[inline]
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The squared distance of a point from the box.
    #[inline]
    pub(crate) fn distance_sq(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }

    /// The least distance between points of both boxes.
    pub fn distance_to(&self, other: &Self) -> f64 {
        (self.min - other.max).max(other.min - self.max).max(DVec3::ZERO).length()
    }
}

/// The triangle closest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// Index of the triangle in the mesh.
    pub triangle: u32,
    /// The closest point on it.
    pub point: DVec3,
    /// Squared distance to that point, in the mesh's unit squared.
    pub distance_sq: f64,
    /// The point's weights for the triangle's corners, each 0..=1, summing to 1.
    pub barycentric: [f64; 3],
}

/// A node and, directly behind it, its first child; the second child starts `skip` nodes further on.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Aabb,
    /// Leaf: first triangle in leaf order. Inner node: distance to the second child.
    start_or_skip: u32,
    /// Triangles in a leaf; 0 marks an inner node.
    count: u32,
}

impl Node {
    /// Without its box, which follows from what is below it.
    fn new(start_or_skip: usize, count: usize) -> Self {
        Self { bounds: Aabb::EMPTY, start_or_skip: start_or_skip as u32, count: count as u32 }
    }
}

/// The nodes of a tree over triangles that a [`Bvh`] has.
trait Tree: Copy {
    fn nodes(&self) -> &[Node];

    /// The rank, in [`Bvh::leaf_order`], of the triangle at this place of the leaves.
    fn rank(&self, item: usize) -> usize;

    /// Whether no triangle below a node is accepted.
    fn is_left_out(&self, node: u32) -> bool;
}

/// The tree over all triangles.
#[derive(Clone, Copy)]
struct WholeTree<'a>(&'a [Node]);

impl Tree for WholeTree<'_> {
    #[inline]
    fn nodes(&self) -> &[Node] {
        self.0
    }

    #[inline]
    fn rank(&self, item: usize) -> usize {
        item
    }

    #[inline]
    fn is_left_out(&self, _: u32) -> bool {
        false
    }
}

/// Computes the box of each node from those of the triangles in the leaves, in parallel. The nodes are those
/// of a tree, the root first.
fn par_fit_boxes(nodes: &mut [Node], of: &(impl Fn(usize) -> Aabb + Sync)) {
    if nodes.len() < PARALLEL_SIZE {
        return fit_boxes(nodes, of);
    }
    if let Some((root, below)) = nodes.split_first_mut() {
        let (one, other) = below.split_at_mut(root.start_or_skip as usize - 1);
        rayon::join(|| par_fit_boxes(one, of), || par_fit_boxes(other, of));
        root.bounds = one[0].bounds.join(other[0].bounds);
    }
}

/// Like [`par_fit_boxes`], by one thread.
fn fit_boxes(nodes: &mut [Node], of: impl Fn(usize) -> Aabb) {
    // Children come after their parent.
    for k in (0..nodes.len()).rev() {
        let Node { start_or_skip, count, .. } = nodes[k];
        let at = start_or_skip as usize;
        nodes[k].bounds = if count > 0 {
            (at..at + count as usize).fold(Aabb::EMPTY, |bounds, item| bounds.join(of(item)))
        } else {
            nodes[k + 1].bounds.join(nodes[k + at].bounds)
        };
    }
}

/// A bounding volume hierarchy over the triangles of a mesh, with its own copy of the corners.
///
/// Coordinates must be finite, and their squares too; scale a mesh outside 1e-100..1e100 first.
#[derive(Debug, Clone)]
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    triangles: Vec<Corners>,
}

/// The corners of a triangle.
#[derive(Debug, Clone, Copy)]
struct Corners {
    at: [DVec3; 3],
    /// The square of the shortest height; [`SLIVER`] marks a triangle without one that is right.
    height_sq: f64,
}

/// In place of a height.
const SLIVER: f64 = -1.0;

impl Corners {
    fn new(at: [DVec3; 3]) -> Self {
        let height_sq = if is_sliver(at) { SLIVER } else { shortest_height_sq(at) };
        Self { at, height_sq }
    }
}

impl Bvh {
    /// Builds the hierarchy; the same mesh always gives the same one. Panics if an index is out of range.
    pub fn new(mesh: &TriMesh) -> Self {
        let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let (nodes, order) = build(&all, |t| Aabb::of(mesh.corners(t as usize)));
        let mut bvh = Self { nodes, order, triangles: Vec::new() };
        bvh.refit(mesh);
        bvh
    }

    /// Like [`Bvh::new`], for triangles that follow each other in space as they do in the mesh. It takes a
    /// quarter of the time, and a search takes longer the farther they are from such an order.
    pub fn in_order(mesh: &TriMesh) -> Self {
        let count = mesh.triangles.len();
        let mut bvh =
            Self { nodes: build_in_order(count), order: (0..count as u32).collect(), triangles: Vec::new() };
        bvh.refit(mesh);
        bvh
    }

    /// Updates the positions of the vertices, which have moved but not far: the tree keeps its structure.
    /// Panics if the mesh has another number of triangles.
    pub fn refit(&mut self, mesh: &TriMesh) {
        let Self { nodes, order, triangles } = self;
        let corners = |&t: &u32| Corners::new(mesh.corners(t as usize));
        assert_eq!(order.len(), mesh.triangles.len(), "the tree is that of another mesh");
        *triangles = order.par_iter().with_min_len(PARALLEL_SIZE).map(corners).collect();
        par_fit_boxes(nodes, &|rank| Aabb::of(triangles[rank].at));
    }

    /// The box of all triangles; [`Aabb::EMPTY`] without any.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// The triangles' indices in leaf order: neighbours in this list are near each other in space.
    pub fn leaf_order(&self) -> &[u32] {
        &self.order
    }

    /// For each triangle where it is in [`Bvh::leaf_order`].
    pub(crate) fn rank_of_each(&self) -> Vec<u32> {
        let mut ranks = vec![0; self.order.len()];
        (0..).zip(&self.order).for_each(|(rank, t)| ranks[*t as usize] = rank);
        ranks
    }

    /// The point of the mesh closest to `p`, of equally close triangles that with the lowest index; `None`
    /// without triangles.
    pub fn closest(&self, p: DVec3) -> Option<Closest> {
        let mut rank = 0;
        self.closest_from(p, &mut rank)
    }

    /// Like [`Bvh::closest`], but looks at the triangle at `rank` of [`Bvh::leaf_order`] first, which saves
    /// most of the work if that one is near, and stores the rank of the one found. A `rank` out of range
    /// counts as 0.
    pub fn closest_from(&self, p: DVec3, rank: &mut usize) -> Option<Closest> {
        self.closest_accepted(p, rank, |_| true)
    }

    /// Like [`Bvh::closest_from`], but stops at the triangle at `rank` if its squared distance from `p`
    /// is at most `enough`.
    pub fn closest_or_near(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<Closest> {
        self.closest_at(*rank, p)
            .filter(|near| near.distance_sq <= enough)
            .or_else(|| self.closest_from(p, rank))
    }

    /// The squared distance of `p` if it is more than `enough`. The search begins as that of
    /// [`Bvh::closest_from`] and ends at any triangle that is near enough.
    pub fn distance_sq_beyond(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<f64> {
        let found = self.search(p, rank, |_| true, enough)?;
        (found.distance_sq > enough).then_some(found.distance_sq)
    }

    /// Like [`Bvh::closest_from`], among the triangles that `accept` holds for; `None` if there is none.
    pub fn closest_accepted(
        &self,
        p: DVec3,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        self.search(p, rank, accept, -1.0)
    }

    /// Like [`Bvh::closest`], among the triangles that `accept` holds for and that are not farther from `p`
    /// than the root of `most_sq`; `None` if there is none.
    pub fn closest_accepted_within(
        &self,
        p: DVec3,
        most_sq: f64,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        self.search_tree(WholeTree(&self.nodes), p, &mut 0, accept, [-1.0, most_sq])
    }

    /// Like [`Bvh::closest_accepted`], up to the first triangle whose squared distance is at most `enough`.
    fn search(
        &self,
        p: DVec3,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
        enough: f64,
    ) -> Option<Closest> {
        self.search_tree(WholeTree(&self.nodes), p, rank, accept, [enough, f64::INFINITY])
    }

    /// Like [`Bvh::search`], in a tree over all of the triangles or some of them, and among those up to a
    /// squared distance of `most`.
    fn search_tree(
        &self,
        tree: impl Tree,
        p: DVec3,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
        [enough, most]: [f64; 2],
    ) -> Option<Closest> {
        let nodes = tree.nodes();
        if nodes.is_empty() {
            return None;
        }
        if *rank >= self.order.len() {
            *rank = 0;
        }
        let mut best =
            Closest { triangle: NONE, point: DVec3::ZERO, distance_sq: most, barycentric: [0.0; 3] };
        if accept(self.order[*rank]) {
            let first = self.on_triangle(*rank, p);
            if first.distance_sq <= enough {
                return Some(first);
            }
            if first.distance_sq <= most {
                best = first;
            }
        }
        let mut stack = [(0u32, 0f64); STACK];
        stack[0] = (0, nodes[0].bounds.distance_sq(p));
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (index, distance_sq) = stack[top];
            if distance_sq > best.distance_sq * SLACK || tree.is_left_out(index) {
                continue;
            }
            let node = nodes[index as usize];
            if node.count > 0 {
                let start = node.start_or_skip as usize;
                for item in start..start + node.count as usize {
                    let candidate_rank = tree.rank(item);
                    if !accept(self.order[candidate_rank]) {
                        continue;
                    }
                    let found = self.on_triangle(candidate_rank, p);
                    if (found.distance_sq, found.triangle) < (best.distance_sq, best.triangle) {
                        best = found;
                        *rank = candidate_rank;
                        if best.distance_sq <= enough {
                            return Some(best);
                        }
                    }
                }
                continue;
            }
            let (first, second) = (index + 1, index + node.start_or_skip);
            let near = (first, nodes[first as usize].bounds.distance_sq(p));
            let far = (second, nodes[second as usize].bounds.distance_sq(p));
            let (near, far) = if far.1 < near.1 { (far, near) } else { (near, far) };
            stack[top] = far;
            stack[top + 1] = near;
            top += 2;
        }
        (best.triangle != NONE && best.distance_sq.is_finite()).then_some(best)
    }

    /// The closest point of the one triangle at `rank` of [`Bvh::leaf_order`]; `None` if that is out of
    /// range.
    pub fn closest_at(&self, rank: usize, p: DVec3) -> Option<Closest> {
        (rank < self.order.len()).then(|| self.on_triangle(rank, p))
    }

    /// The corners of the triangle at `rank` of [`Bvh::leaf_order`]; `None` if that is out of range.
    pub fn corners_at(&self, rank: usize) -> Option<[DVec3; 3]> {
        self.triangles.get(rank).map(|corners| corners.at)
    }

    /// The square of the shortest height of the triangle at `rank` of [`Bvh::leaf_order`]; negative for a
    /// sliver. Panics if that is out of range.
    pub(super) fn height_sq_at(&self, rank: usize) -> f64 {
        self.triangles[rank].height_sq
    }

    #[inline]
    fn on_triangle(&self, rank: usize, p: DVec3) -> Closest {
        let Corners { at, height_sq } = self.triangles[rank];
        let found = if height_sq < 0.0 { closest_on_sliver(p, at) } else { closest_on_regular(p, at) };
        Closest {
            triangle: self.order[rank],
            point: found.point,
            distance_sq: found.point.distance_squared(p),
            barycentric: found.barycentric,
        }
    }

    /// Calls `visit` with each triangle whose box overlaps or touches `bounds`, in a fixed order.
    pub fn overlapping(&self, bounds: &Aabb, mut visit: impl FnMut(u32)) {
        self.overlapping_ranks(bounds, |rank| visit(self.order[rank]));
    }

    /// Like [`Bvh::overlapping`], with the triangles' corners.
    pub fn overlapping_corners(&self, bounds: &Aabb, mut visit: impl FnMut([DVec3; 3])) {
        self.overlapping_ranks(bounds, |rank| visit(self.triangles[rank].at));
    }

    fn overlapping_ranks(&self, bounds: &Aabb, mut visit: impl FnMut(usize)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut stack = [0u32; STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let index = stack[top];
            let node = &self.nodes[index as usize];
            if !node.bounds.overlaps(bounds) {
                continue;
            }
            if node.count > 0 {
                let start = node.start_or_skip as usize;
                for rank in start..start + node.count as usize {
                    if Aabb::of(self.triangles[rank].at).overlaps(bounds) {
                        visit(rank);
                    }
                }
            } else {
                stack[top] = index + node.start_or_skip;
                stack[top + 1] = index + 1;
                top += 2;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn nothing_farther_than_the_limit_is_found() {
        let mesh = sample("genus3").unwrap();
        let bvh = Bvh::new(&mesh);
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        let (mut found, mut none) = (0, 0);
        for _ in 0..500 {
            let p = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-2.0..2.0)));
            let accept = |t: u32| t % 7 == 3;
            let whole = bvh.closest_accepted(p, &mut 0, accept).unwrap();
            let most = rng.random_range(0.0..2.0) * whole.distance_sq;
            let within = bvh.closest_accepted_within(p, most, accept);
            assert_eq!(within, (whole.distance_sq <= most).then_some(whole));
            // Right at the limit as well.
            assert_eq!(bvh.closest_accepted_within(p, whole.distance_sq, accept), Some(whole));
            if within.is_some() { found += 1 } else { none += 1 }
        }
        assert!(found > 100 && none > 100, "{found}, {none}");
    }
}
