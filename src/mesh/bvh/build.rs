//! The order of a hierarchy of boxes: which triangles share a box, by the surface area heuristic or by their
//! order in the mesh.
//!
//! Boxes are compared in single precision, relative to that of the whole mesh: this decides how fast a search
//! is, not what it finds.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::{Aabb, LEAF_SIZE, MAX_HEURISTIC_DEPTH, Node, PARALLEL_SIZE};

/// Places along an axis at which a cut is considered, plus one.
const BINS: usize = 16;
/// Maximum number of triangles in a leaf of a tree by their order, which is soon made, and searched a few
/// times only.
const LARGE_LEAF: usize = 16;
/// With at most this many triangles, all cuts along an axis are considered.
const FEW: usize = 8;

/// The nodes over these triangles, without boxes, and the triangles in the order of the leaves. `bounds`
/// gives the box of a triangle.
pub(super) fn build(of: &[u32], bounds: impl Fn(u32) -> Aabb + Sync) -> (Vec<Node>, Vec<u32>) {
    let triangles = || of.par_iter().copied().with_min_len(PARALLEL_SIZE);
    let all = triangles().map(&bounds).reduce(|| Aabb::EMPTY, Aabb::join);
    // A longest side of 1; points that all lie together stay so.
    let size = (all.max - all.min).max_element().max(f64::MIN_POSITIVE);
    let relative = |p: DVec3| ((p - all.min) / size).as_vec3a();
    let mut items: Vec<Item> = triangles()
        .map(|triangle| {
            let Aabb { min, max } = bounds(triangle);
            Item { bounds: Bounds { min: relative(min), max: relative(max) }, triangle }
        })
        .collect();
    let Some(extent) = Extent::of(&items) else { return (Vec::new(), Vec::new()) };
    let parts = build_parts(&mut items, Subtree { start: 0, depth: 0, extent });
    (parts.concat(), items.into_iter().map(|item| item.triangle).collect())
}

/// The nodes, without boxes, over triangles in the order that they have.
pub(super) fn build_in_order(count: usize) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(4 * count.div_ceil(LARGE_LEAF));
    if count > 0 {
        push_halves(0, count, &mut nodes);
    }
    nodes
}

/// Appends the nodes over `count` triangles from `start` on in depth-first order.
fn push_halves(start: usize, count: usize, nodes: &mut Vec<Node>) {
    if count <= LARGE_LEAF {
        nodes.push(Node::new(start, count));
        return;
    }
    let (here, half) = (nodes.len(), count / 2);
    nodes.push(Node::new(0, 0));
    push_halves(start, half, nodes);
    nodes[here] = Node::new(nodes.len() - here, 0);
    push_halves(start + half, count - half, nodes);
}

#[derive(Clone, Copy)]
struct Bounds {
    min: Vec3A,
    max: Vec3A,
}

impl Bounds {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half the surface; 0 for [`Bounds::EMPTY`].
    fn half_surface(&self) -> f32 {
        let d = (self.max - self.min).max(Vec3A::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A triangle.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    triangle: u32,
}

impl Item {
    fn centre(&self) -> Vec3A {
        0.5 * (self.bounds.min + self.bounds.max)
    }
}

/// The box of items, and that of their centres.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Bounds,
    centres: Bounds,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, centres: Bounds::EMPTY };

    /// `None` without items.
    fn of(items: &[Item]) -> Option<Self> {
        let all = items.iter().fold(Self::EMPTY, Self::with);
        (!items.is_empty()).then_some(all)
    }

    fn with(self, item: &Item) -> Self {
        let centre = item.centre();
        self.join(Self { bounds: item.bounds, centres: Bounds { min: centre, max: centre } })
    }

    fn join(self, other: Self) -> Self {
        Self { bounds: self.bounds.join(other.bounds), centres: self.centres.join(other.centres) }
    }
}

/// Where a subtree lies.
#[derive(Clone, Copy)]
struct Subtree {
    /// Rank of its first triangle among all.
    start: usize,
    depth: usize,
    extent: Extent,
}

/// The nodes of a subtree in depth-first order, in parts that different threads have made.
fn build_parts(items: &mut [Item], subtree: Subtree) -> Vec<Vec<Node>> {
    if items.len() < PARALLEL_SIZE {
        let mut nodes = Vec::with_capacity(2 * items.len());
        push_subtree(items, subtree, &mut nodes);
        return vec![nodes];
    }
    let (left, right) = subtree.split(items);
    let (left_items, right_items) = items.split_at_mut(right.start - left.start);
    let (left, right) = rayon::join(|| build_parts(left_items, left), || build_parts(right_items, right));
    let skip = 1 + left.iter().map(Vec::len).sum::<usize>();
    let mut parts = vec![vec![Node::new(skip, 0)]];
    parts.extend(left);
    parts.extend(right);
    parts
}

/// Appends the nodes of a subtree in depth-first order.
fn push_subtree(items: &mut [Item], subtree: Subtree, nodes: &mut Vec<Node>) {
    if items.len() <= LEAF_SIZE {
        nodes.push(Node::new(subtree.start, items.len()));
        return;
    }
    let (left, right) = subtree.split(items);
    let (left_items, right_items) = items.split_at_mut(right.start - left.start);
    let here = nodes.len();
    nodes.push(Node::new(0, 0));
    push_subtree(left_items, left, nodes);
    nodes[here] = Node::new(nodes.len() - here, 0);
    push_subtree(right_items, right, nodes);
}

impl Subtree {
    /// Reorders the items into two groups, neither empty, and returns their subtrees.
    fn split(self, items: &mut [Item]) -> (Self, Self) {
        let size = self.extent.centres.max - self.extent.centres.min;
        let axis = size.max_position();
        let factor = BINS as f32 / size[axis];
        if self.depth < MAX_HEURISTIC_DEPTH && factor.is_finite() {
            if items.len() <= FEW {
                return self.split_few(items, axis);
            }
            let least = self.extent.centres.min[axis];
            let bin = |item: &Item| (((item.centre()[axis] - least) * factor) as usize).min(BINS - 1);
            let (cut, halves) = cheapest_cut(items, bin);
            let first = partition(items, |item| bin(item) < cut);
            if first > 0 && first < items.len() {
                return self.children(first, halves);
            }
        }
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| by_centre(a, b, axis));
        let halves = [&items[..half], &items[half..]].map(|part| Extent::of(part).unwrap_or(self.extent));
        self.children(half, halves)
    }

    /// Like [`Subtree::split`] at the best of all cuts along an axis.
    fn split_few(self, items: &mut [Item], axis: usize) -> (Self, Self) {
        items.sort_unstable_by(|a, b| by_centre(a, b, axis));
        let count = items.len();
        let mut behind = [Extent::EMPTY; FEW + 1];
        for k in (1..count).rev() {
            behind[k] = behind[k + 1].with(&items[k]);
        }
        let mut before = Extent::EMPTY;
        let mut best = Cut::NONE;
        for k in 1..count {
            before = before.with(&items[k - 1]);
            best.offer(k, [(before, k), (behind[k], count - k)]);
        }
        self.children(best.at, best.halves)
    }

    /// The subtrees of the first items and of the others.
    fn children(self, first: usize, [left, right]: [Extent; 2]) -> (Self, Self) {
        let depth = self.depth + 1;
        (
            Self { start: self.start, depth, extent: left },
            Self { start: self.start + first, depth, extent: right },
        )
    }
}

/// The cut with the smallest sum of surface times number of triangles on both sides.
struct Cut {
    cost: f32,
    at: usize,
    halves: [Extent; 2],
}

impl Cut {
    const NONE: Self = Self { cost: f32::INFINITY, at: 1, halves: [Extent::EMPTY; 2] };

    /// Takes another cut if it is better: where it is, and extent and number of triangles on both sides.
    fn offer(&mut self, at: usize, sides: [(Extent, usize); 2]) {
        let cost = sides.iter().map(|(extent, count)| extent.bounds.half_surface() * *count as f32).sum();
        if cost < self.cost {
            *self = Self { cost, at, halves: sides.map(|(extent, _)| extent) };
        }
    }
}

fn by_centre(a: &Item, b: &Item, axis: usize) -> std::cmp::Ordering {
    a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.triangle.cmp(&b.triangle))
}

/// The bin before which it is best to cut, and what lies on both sides.
fn cheapest_cut(items: &[Item], bin: impl Fn(&Item) -> usize) -> (usize, [Extent; 2]) {
    let mut bins = [(Extent::EMPTY, 0usize); BINS];
    for item in items {
        let (extent, count) = &mut bins[bin(item)];
        *extent = extent.with(item);
        *count += 1;
    }
    let add = |sum: (Extent, usize), bin: (Extent, usize)| (sum.0.join(bin.0), sum.1 + bin.1);
    let mut behind = [(Extent::EMPTY, 0); BINS + 1];
    for k in (1..BINS).rev() {
        behind[k] = add(behind[k + 1], bins[k]);
    }
    let mut before = (Extent::EMPTY, 0);
    let mut best = Cut::NONE;
    for k in 1..BINS {
        before = add(before, bins[k - 1]);
        best.offer(k, [before, behind[k]]);
    }
    (best.at, best.halves)
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
