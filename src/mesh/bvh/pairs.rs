//! Pairs of triangles whose boxes overlap, found by going down the hierarchy from two nodes at once.

use std::ops::Range;

use super::{Aabb, Bvh, PARALLEL_SIZE};
use crate::{ProgressToken, Result};

impl Bvh {
    /// Calls `visit` once with each two triangles whose boxes overlap or touch, in no particular order and
    /// from several threads. Polls `progress`, but leaves it to the caller to report any.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn overlapping_pairs(&self, progress: &ProgressToken, visit: impl Fn(u32, u32) + Sync) -> Result<()> {
        self.within(0..self.nodes.len(), progress, &visit)
    }

    /// The pairs of a subtree, which has these nodes.
    fn within(
        &self,
        subtree: Range<usize>,
        progress: &ProgressToken,
        visit: &(impl Fn(u32, u32) + Sync),
    ) -> Result<()> {
        let Some(node) = self.nodes.get(subtree.start) else { return Ok(()) };
        if node.count > 0 {
            let ranks = self.ranks(subtree.start);
            for first in ranks.clone() {
                (first + 1..ranks.end).for_each(|second| self.offer(first, second, visit));
            }
            return Ok(());
        }
        let [left, right] = self.children(&subtree);
        both(
            subtree.len(),
            progress,
            || self.within(left.clone(), progress, visit),
            || self.within(right.clone(), progress, visit),
        )?;
        self.between(left.clone(), right.clone(), progress, visit)
    }

    /// The pairs of a triangle of one subtree and one of another.
    fn between(
        &self,
        one: Range<usize>,
        other: Range<usize>,
        progress: &ProgressToken,
        visit: &(impl Fn(u32, u32) + Sync),
    ) -> Result<()> {
        let (first, second) = (&self.nodes[one.start], &self.nodes[other.start]);
        if !first.bounds.overlaps(&second.bounds) {
            return Ok(());
        }
        if first.count > 0 && second.count > 0 {
            for rank in self.ranks(one.start) {
                self.ranks(other.start).for_each(|beside| self.offer(rank, beside, visit));
            }
            return Ok(());
        }
        let nodes = one.len() + other.len();
        let descends =
            first.count == 0 && (second.count > 0 || extent(&first.bounds) >= extent(&second.bounds));
        let (parts, whole) = if descends { (one, other) } else { (other, one) };
        let [left, right] = self.children(&parts);
        both(
            nodes,
            progress,
            || self.between(left.clone(), whole.clone(), progress, visit),
            || self.between(right.clone(), whole.clone(), progress, visit),
        )
    }

    /// The nodes of the two subtrees below an inner node.
    fn children(&self, subtree: &Range<usize>) -> [Range<usize>; 2] {
        let right = subtree.start + self.nodes[subtree.start].start_or_skip as usize;
        [subtree.start + 1..right, right..subtree.end]
    }

    /// The ranks of a leaf's triangles.
    fn ranks(&self, leaf: usize) -> Range<usize> {
        let node = &self.nodes[leaf];
        let start = node.start_or_skip as usize;
        start..start + node.count as usize
    }

    fn offer(&self, one: usize, other: usize, visit: &(impl Fn(u32, u32) + Sync)) {
        let bounds = |rank: usize| Aabb::of(self.triangles[rank].at);
        if bounds(one).overlaps(&bounds(other)) {
            visit(self.order[one], self.order[other]);
        }
    }
}

/// Does both pieces of work on this many nodes, on several threads if there are many.
fn both(
    nodes: usize,
    progress: &ProgressToken,
    one: impl FnOnce() -> Result<()> + Send,
    other: impl FnOnce() -> Result<()> + Send,
) -> Result<()> {
    if nodes < PARALLEL_SIZE {
        return one().and_then(|()| other());
    }
    progress.poll()?;
    let (one, other) = rayon::join(one, other);
    one.and(other)
}

fn extent(bounds: &Aabb) -> f64 {
    (bounds.max - bounds.min).max_element()
}
