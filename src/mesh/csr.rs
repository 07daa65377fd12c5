//! Many short lists in one: compressed sparse rows.

/// Lists 0, 1, 2 … of entries, packed one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Csr<T = u32> {
    /// First entry of each list, and the end of the last.
    pub(crate) start: Vec<u32>,
    pub(crate) entries: Vec<T>,
}

impl<T: Copy + Default> Csr<T> {
    /// `count` lists of `items`, each an entry with the list that it belongs to; entries of a list stay in
    /// their order. The iterator is run through twice. Panics if an item names a list that is not there.
    pub(crate) fn group(count: usize, items: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut start = vec![0_u32; count + 1];
        for (list, _) in items.clone() {
            start[list as usize + 1] += 1;
        }
        for list in 0..count {
            start[list + 1] += start[list];
        }
        let mut next = start.clone();
        let mut entries = vec![T::default(); start[count] as usize];
        for (list, entry) in items {
            let slot = &mut next[list as usize];
            entries[*slot as usize] = entry;
            *slot += 1;
        }
        Self { start, entries }
    }

    /// The entries of a list. Panics if it is not there.
    pub(crate) fn of(&self, list: u32) -> &[T] {
        let list = list as usize;
        &self.entries[self.start[list] as usize..self.start[list + 1] as usize]
    }
}

/// The triangles around each vertex, ascending; one that repeats a vertex is listed as often.
pub(crate) fn triangles_around(vertices: usize, triangles: &[[u32; 3]]) -> Csr {
    Csr::group(vertices, (0..).zip(triangles).flat_map(|(t, triangle)| triangle.map(|v| (v, t))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_keep_their_order() {
        let lists = Csr::group(4, [(2, 'a'), (0, 'b'), (2, 'c'), (3, 'd')].into_iter());
        assert_eq!([0, 1, 2, 3].map(|list| String::from_iter(lists.of(list))), ["b", "", "ac", "d"]);
        let around = triangles_around(4, &[[0, 1, 2], [2, 1, 3]]);
        assert_eq!((around.start, around.entries), (vec![0, 1, 3, 5, 6], vec![0, 0, 1, 0, 1, 1]));
    }
}
