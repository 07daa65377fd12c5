//! Points found by their position, in the buckets of a grid.

use glam::DVec3;

/// Items filed under points, by grid cell. Cells may share a bucket, so that searches also meet items farther
/// away.
pub(crate) struct HashGrid<T> {
    side: f64,
    buckets: Vec<Vec<T>>,
}

impl<T: Copy> HashGrid<T> {
    /// Of cells of this side length, above 0; fast for up to about `expected` items.
    pub fn new(side: f64, expected: usize) -> Self {
        Self { side, buckets: vec![Vec::new(); expected.max(16).next_power_of_two()] }
    }

    fn bucket(&self, cell: [i64; 3]) -> usize {
        let mixed = cell
            .iter()
            .fold(0_u64, |hash, c| (hash ^ (*c as u64)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
        mixed as usize & (self.buckets.len() - 1)
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        (p / self.side).floor().to_array().map(|c| c as i64)
    }

    /// Files `item` under `p`.
    pub fn insert(&mut self, p: DVec3, item: T) {
        let bucket = self.bucket(self.cell(p));
        self.buckets[bucket].push(item);
    }

    /// Files `item` in all cells with points within `reach` of `p`, where [`HashGrid::in_cell`] finds it.
    pub fn insert_around(&mut self, p: DVec3, reach: f64, item: T) {
        let [low, high] = [p - reach, p + reach].map(|corner| self.cell(corner));
        for (x, y) in (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| (x, y))) {
            for z in low[2]..=high[2] {
                let bucket = self.bucket([x, y, z]);
                self.buckets[bucket].push(item);
            }
        }
    }

    /// The items filed in the cell of `p`, and perhaps others; some more than once.
    pub fn in_cell(&self, p: DVec3) -> &[T] {
        &self.buckets[self.bucket(self.cell(p))]
    }

    /// Whether `accept` holds for any item within a side of `p`; it may be called for items farther away, and
    /// more than once for an item.
    pub fn any(&self, p: DVec3, mut accept: impl FnMut(T) -> bool) -> bool {
        let [x, y, z] = self.cell(p);
        let mut around = (0..27).map(|i| [(x, i % 3), (y, i / 3 % 3), (z, i / 9)]);
        around.any(|cell| {
            let bucket = self.bucket(cell.map(|(c, step)| c.saturating_add(step - 1)));
            self.buckets[bucket].iter().any(|item| accept(*item))
        })
    }
}
