//! Long lists, by all threads and in parts of a constant length: what is summed in their order does not
//! depend on the number of threads.

use rayon::prelude::*;
use std::ops::Range;

/// Indices in a part.
const CHUNK: usize = 4096;

/// What `of` gives for parts of `0..count`, in their order.
pub(crate) fn par_map_chunks<T: Send>(count: usize, of: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    par_map_chunks_of(CHUNK, count, of)
}

/// Like [`par_map_chunks`], with a given number of indices in a part.
pub(crate) fn par_map_chunks_of<T: Send>(
    size: usize,
    count: usize,
    of: impl Fn(Range<usize>) -> T + Sync,
) -> Vec<T> {
    let part = |chunk: usize| of(chunk * size..count.min((chunk + 1) * size));
    (0..count.div_ceil(size)).into_par_iter().map(part).collect()
}
