//! A queue whose greatest entry comes first, and most of whose entries are known from the beginning.

use rayon::slice::ParallelSliceMut;
use std::collections::BinaryHeap;

/// Those known at first are sorted, which takes less time than a heap of them, and can be looked at ahead.
pub(crate) struct Queue<T> {
    /// Ascending.
    first: Vec<T>,
    later: BinaryHeap<T>,
}

impl<T: Ord + Send> Queue<T> {
    /// Of these entries, each once.
    pub fn new(mut first: Vec<T>) -> Self {
        first.par_sort_unstable();
        first.dedup();
        Self { first, later: BinaryHeap::new() }
    }

    /// Takes the greatest entry out.
    pub fn pop(&mut self) -> Option<T> {
        match (self.first.last(), self.later.peek()) {
            (first, Some(later)) if first.is_none_or(|first| first < later) => self.later.pop(),
            _ => self.first.pop(),
        }
    }

    /// Of those known at first, what is left: the next comes last.
    pub fn first(&self) -> &[T] {
        &self.first
    }

    pub fn push(&mut self, entry: T) {
        self.later.push(entry);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_come_in_descending_order() {
        let mut queue = Queue::new(vec![3, 9, 5, 3]);
        let mut popped = vec![queue.pop()];
        [4, 8, 5].into_iter().for_each(|entry| queue.push(entry));
        assert_eq!(queue.first(), [3, 5]);
        popped.extend((0..6).map(|_| queue.pop()));
        assert_eq!(popped, [Some(9), Some(8), Some(5), Some(5), Some(4), Some(3), None]);
    }
}
