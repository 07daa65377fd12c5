//! Hash tables of indices and positions: with a hash of a few instructions, where the standard one takes most
//! of a table's time. Nothing may depend on the order of such a table.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A map with [`QuickHasher`].
pub(crate) type QuickMap<K, V> = HashMap<K, V, BuildHasherDefault<QuickHasher>>;

/// The golden ratio, in 64 bits.
pub(crate) const GOLDEN_RATIO: u64 = 0x9e37_79b9_7f4a_7c15;

/// Multiplies to 128 bits and folds them, so that all bits of a word count: many coordinates have none but
/// zeros in their lower half.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct QuickHasher(u64);

impl Hasher for QuickHasher {
    #[inline]
    fn finish(&self) -> u64 {
        self.0
    }

    #[inline]
    fn write(&mut self, bytes: &[u8]) {
        // Arrays of numbers come as their bytes.
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.write_u64(u64::from_le_bytes(*word)));
        if !rest.is_empty() {
            let mut word = [0; 8];
            word[..rest.len()].copy_from_slice(rest);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    #[inline]
    fn write_u32(&mut self, word: u32) {
        self.write_u64(u64::from(word));
    }

    #[inline]
    fn write_u64(&mut self, word: u64) {
        let mixed = u128::from(self.0.rotate_left(23) ^ word ^ GOLDEN_RATIO) * u128::from(GOLDEN_RATIO);
        self.0 = (mixed >> 64) as u64 ^ mixed as u64;
    }

    #[inline]
    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::{BuildHasher, Hash};

    /// The largest number of keys that fall into one bucket: by their lowest bits, and by the other bits that
    /// tables use.
    fn fullest(keys: impl Iterator<Item = impl Hash> + Clone) -> [usize; 2] {
        let hashes = keys.map(|key| BuildHasherDefault::<QuickHasher>::default().hash_one(key));
        [0, 57].map(|shift| {
            let mut counts = HashMap::new();
            let mask = if shift == 0 { 0x0fff } else { 0x7f };
            hashes.clone().for_each(|hash| *counts.entry(hash >> shift & mask).or_insert(0) += 1);
            counts.into_values().max().unwrap_or(0)
        })
    }

    #[test]
    fn keys_that_differ_in_few_bits_are_spread() {
        let grid = (0..4096u32).map(|i| [i % 16, i / 16 % 16, i / 256].map(|x| f64::from(x).to_bits()));
        let single = (0..4096u32).map(|i| [f64::from(i as f32 * 0.1).to_bits(), 0, 1.0f64.to_bits()]);
        let triangles = (0..4096u32).map(|i| [i, i + 1, i + 64]);
        let edges = (0..4096u32).map(|i| (i % 64, i / 64));
        // By chance it would be about 7 of 4096 in one bucket, and about 50 in one of 128.
        for (name, found) in [
            ("grid", fullest(grid)),
            ("line", fullest(single)),
            ("triangles", fullest(triangles)),
            ("edges", fullest(edges)),
        ] {
            assert!(found[0] <= 16 && found[1] <= 80, "{name}: {found:?}");
        }
    }
}
