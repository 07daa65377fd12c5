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
        let (left, right) = (subtree.start + 1, subtree.start + node.start_or_skip as usize);
        if subtree.len() < PARALLEL_SIZE {
            self.within(left..right, progress, visit)?;
            self.within(right..subtree.end, progress, visit)?;
        } else {
            progress.poll()?;
            let (one, other) = rayon::join(
                || self.within(left..right, progress, visit),
                || self.within(right..subtree.end, progress, visit),
            );
            one.and(other)?;
        }
        self.between(left, right, visit);
        Ok(())
    }

    /// The pairs of a triangle below one node and one below another.
    fn between(&self, one: usize, other: usize, visit: &(impl Fn(u32, u32) + Sync)) {
        let (first, second) = (&self.nodes[one], &self.nodes[other]);
        if !first.bounds.overlaps(&second.bounds) {
            return;
        }
        let descends =
            first.count == 0 && (second.count > 0 || extent(&first.bounds) >= extent(&second.bounds));
        if descends {
            self.between(one + 1, other, visit);
            self.between(one + first.start_or_skip as usize, other, visit);
        } else if second.count == 0 {
            self.between(one, other + 1, visit);
            self.between(one, other + second.start_or_skip as usize, visit);
        } else {
            for rank in self.ranks(one) {
                self.ranks(other).for_each(|beside| self.offer(rank, beside, visit));
            }
        }
    }

    /// The ranks of a leaf's triangles.
    fn ranks(&self, leaf: usize) -> Range<usize> {
        let node = &self.nodes[leaf];
        let start = node.start_or_skip as usize;
        start..start + node.count as usize
    }

    fn offer(&self, one: usize, other: usize, visit: &(impl Fn(u32, u32) + Sync)) {
        let [first, second] = [one, other].map(|rank| Aabb::of(self.triangles[rank].at));
        if first.overlaps(&second) {
            visit(self.order[one], self.order[other]);
        }
    }
}

fn extent(bounds: &Aabb) -> f64 {
    (bounds.max - bounds.min).max_element()
}
