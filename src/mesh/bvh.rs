//! A hierarchy of boxes over triangles: closest points and overlapping boxes.

use glam::DVec3;

use super::TriMesh;
use super::triangle::{closest_on_regular, closest_on_sliver, is_sliver};

const LEAF_SIZE: usize = 2;
const BINS: usize = 16;
/// Below this depth the heuristic may cut off one triangle at a time; halving then bounds the depth.
const MAX_HEURISTIC_DEPTH: usize = 48;
/// The heuristic's depth and one level for each halving of at most 2^32 triangles.
const STACK: usize = MAX_HEURISTIC_DEPTH + 40;
/// Subtrees below this size are built by one thread.
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
    pub fn of([a, b, c]: [DVec3; 3]) -> Self {
        Self { min: a.min(b).min(c), max: a.max(b).max(c) }
    }

    fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    pub(super) fn distance_sq(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }

    /// The least distance between points of both boxes.
    pub fn distance_to(&self, other: &Self) -> f64 {
        (self.min - other.max).max(other.min - self.max).max(DVec3::ZERO).length()
    }

    /// Half the surface, in the unit of the coordinates squared; 0 for [`Aabb::EMPTY`].
    fn half_surface(&self) -> f64 {
        let d = (self.max - self.min).max(DVec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
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

/// A bounding volume hierarchy over the triangles of a mesh, with its own copy of the corners.
///
/// Coordinates must be finite, and their squares too; scale a mesh outside 1e-100..1e100 first.
#[derive(Debug, Clone)]
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    triangles: Vec<Corners>,
}

/// The corners of a triangle, and whether it is a sliver.
#[derive(Debug, Clone, Copy)]
struct Corners {
    at: [DVec3; 3],
    sliver: bool,
}

#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    centre: DVec3,
    triangle: u32,
}

impl Bvh {
    /// Builds the hierarchy; the same mesh always gives the same one. Panics if an index is out of range.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut items: Vec<Item> = (0u32..)
            .take(mesh.triangles.len())
            .map(|triangle| {
                let bounds = Aabb::of(mesh.corners(triangle as usize));
                Item { bounds, centre: 0.5 * (bounds.min + bounds.max), triangle }
            })
            .collect();
        let nodes = if items.is_empty() { Vec::new() } else { build(&mut items, 0, 0) };
        let order: Vec<u32> = items.iter().map(|item| item.triangle).collect();
        let corners = |&t: &u32| mesh.corners(t as usize);
        let triangles = order.iter().map(corners).map(|at| Corners { at, sliver: is_sliver(at) }).collect();
        Self { nodes, order, triangles }
    }

    /// The box of all triangles; [`Aabb::EMPTY`] without any.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// The triangles' indices in leaf order: neighbours in this list are near each other in space.
    pub fn leaf_order(&self) -> &[u32] {
        &self.order
    }

    /// The point of the mesh closest to `p`, of equally close triangles that with the lowest index; `None`
    /// without triangles.
    pub fn closest(&self, p: DVec3) -> Option<Closest> {
        let mut rank = 0;
        self.closest_from(p, &mut rank)
    }

    /// As [`Bvh::closest`], but looks at the triangle at `rank` of [`Bvh::leaf_order`] first, which saves
    /// most of the work if that one is near, and stores the rank of the one found. A `rank` out of range
    /// counts as 0.
    pub fn closest_from(&self, p: DVec3, rank: &mut usize) -> Option<Closest> {
        self.closest_accepted(p, rank, |_| true)
    }

    /// As [`Bvh::closest_from`], but stops at the triangle at `rank` if its squared distance from `p`
    /// is at most `enough`.
    pub fn closest_or_near(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<Closest> {
        self.closest_at(*rank, p)
            .filter(|near| near.distance_sq <= enough)
            .or_else(|| self.closest_from(p, rank))
    }

    /// As [`Bvh::closest_from`] among the triangles that `accept` holds for; `None` if there is none.
    pub fn closest_accepted(
        &self,
        p: DVec3,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        if self.nodes.is_empty() {
            return None;
        }
        if *rank >= self.order.len() {
            *rank = 0;
        }
        let mut best = Closest {
            triangle: u32::MAX,
            point: DVec3::ZERO,
            distance_sq: f64::INFINITY,
            barycentric: [0.0; 3],
        };
        if accept(self.order[*rank]) {
            best = self.on_triangle(*rank, p);
        }
        let mut stack = [(0u32, 0f64); STACK];
        stack[0] = (0, self.nodes[0].bounds.distance_sq(p));
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (index, distance_sq) = stack[top];
            if distance_sq > best.distance_sq * SLACK {
                continue;
            }
            let node = self.nodes[index as usize];
            if node.count > 0 {
                let start = node.start_or_skip as usize;
                for candidate_rank in start..start + node.count as usize {
                    if !accept(self.order[candidate_rank]) {
                        continue;
                    }
                    let found = self.on_triangle(candidate_rank, p);
                    if (found.distance_sq, found.triangle) < (best.distance_sq, best.triangle) {
                        best = found;
                        *rank = candidate_rank;
                    }
                }
                continue;
            }
            let (first, second) = (index + 1, index + node.start_or_skip);
            let near = (first, self.nodes[first as usize].bounds.distance_sq(p));
            let far = (second, self.nodes[second as usize].bounds.distance_sq(p));
            let (near, far) = if far.1 < near.1 { (far, near) } else { (near, far) };
            stack[top] = far;
            stack[top + 1] = near;
            top += 2;
        }
        best.distance_sq.is_finite().then_some(best)
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

    fn on_triangle(&self, rank: usize, p: DVec3) -> Closest {
        let Corners { at, sliver } = self.triangles[rank];
        let found = if sliver { closest_on_sliver(p, at) } else { closest_on_regular(p, at) };
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

    /// As [`Bvh::overlapping`], with the triangles' corners.
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

/// The nodes of a subtree in depth-first order; `start` is the rank of `items[0]` among all triangles.
fn build(items: &mut [Item], start: usize, depth: usize) -> Vec<Node> {
    let bounds = items.iter().fold(Aabb::EMPTY, |b, item| b.join(item.bounds));
    let leaf = Node { bounds, start_or_skip: start as u32, count: items.len() as u32 };
    if items.len() <= LEAF_SIZE {
        return vec![leaf];
    }
    let middle = split(items, depth);
    let parallel = items.len() >= PARALLEL_SIZE;
    let (left, right) = items.split_at_mut(middle);
    let (left, right) = if parallel {
        rayon::join(|| build(left, start, depth + 1), || build(right, start + middle, depth + 1))
    } else {
        (build(left, start, depth + 1), build(right, start + middle, depth + 1))
    };
    let mut nodes = Vec::with_capacity(1 + left.len() + right.len());
    nodes.push(Node { bounds, start_or_skip: 1 + left.len() as u32, count: 0 });
    nodes.extend(left);
    nodes.extend(right);
    nodes
}

/// Reorders the items into two groups, neither empty, and returns the size of the first.
fn split(items: &mut [Item], depth: usize) -> usize {
    let centres =
        items.iter().fold(Aabb::EMPTY, |b, item| b.join(Aabb { min: item.centre, max: item.centre }));
    let extent = centres.max - centres.min;
    let axis = extent.max_position();
    let half = items.len() / 2;
    let by_centre =
        |a: &Item, b: &Item| a.centre[axis].total_cmp(&b.centre[axis]).then(a.triangle.cmp(&b.triangle));
    let factor = BINS as f64 / extent[axis];
    if depth >= MAX_HEURISTIC_DEPTH || !factor.is_finite() {
        items.select_nth_unstable_by(half, by_centre);
        return half;
    }
    let bin = |item: &Item| (((item.centre[axis] - centres.min[axis]) * factor) as usize).min(BINS - 1);
    let cut = cheapest_cut(items, bin);
    let first = partition(items, |item| bin(item) < cut);
    if first == 0 || first == items.len() {
        items.select_nth_unstable_by(half, by_centre);
        return half;
    }
    first
}

/// The bin boundary with the smallest sum of surface times number of triangles on both sides.
fn cheapest_cut(items: &[Item], bin: impl Fn(&Item) -> usize) -> usize {
    let mut bins = [(Aabb::EMPTY, 0usize); BINS];
    for item in items {
        let (bounds, count) = &mut bins[bin(item)];
        *bounds = bounds.join(item.bounds);
        *count += 1;
    }
    let mut cost = [0.0; BINS];
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    for k in 1..BINS {
        bounds = bounds.join(bins[k - 1].0);
        count += bins[k - 1].1;
        cost[k] += bounds.half_surface() * count as f64;
    }
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    for k in (1..BINS).rev() {
        bounds = bounds.join(bins[k].0);
        count += bins[k].1;
        cost[k] += bounds.half_surface() * count as f64;
    }
    (1..BINS).fold(1, |best, k| if cost[k] < cost[best] { k } else { best })
}

/// Moves the items that satisfy `first` to the front and counts them.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut end = 0;
    for k in 0..items.len() {
        if first(&items[k]) {
            items.swap(k, end);
            end += 1;
        }
    }
    end
}
