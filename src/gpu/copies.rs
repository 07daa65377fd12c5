//! Copies of long lists to and from memory that the device shares, by all threads: one alone takes longer
//! than the bus.

use rayon::prelude::*;

/// Bytes that one thread copies at a time.
const PART: usize = 1 << 20;

/// Copies bytes into a list of the same length.
pub(super) fn par_copy(from: &[u8], to: &mut [u8]) {
    if from.len() <= PART {
        return to.copy_from_slice(from);
    }
    to.par_chunks_mut(PART).zip(from.par_chunks(PART)).for_each(|(to, from)| to.copy_from_slice(from));
}
