//! Long lists, by all threads and in parts of a constant length: what is summed in their order does not
//! depend on the number of threads.

use bytemuck::Pod;
use bytemuck::allocation::zeroed_vec;
use rayon::prelude::*;
use std::ops::Range;

/// Indices in a part.
pub(crate) const CHUNK: usize = 4096;

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

/// Copies a list by all threads: to touch new pages takes longer than to fill them.
pub(crate) fn par_clone<T: Copy + Send + Sync>(list: &[T]) -> Vec<T> {
    list.par_iter().with_min_len(CHUNK).copied().collect()
}

/// Where each part begins in the list of [`par_concat`].
pub(crate) fn begins<T>(parts: &[Vec<T>]) -> Vec<u32> {
    let begin = |total: &mut u32, part: &Vec<T>| Some(std::mem::replace(total, *total + part.len() as u32));
    parts.iter().scan(0, begin).collect()
}

/// The parts one after the other, in one list.
pub(crate) fn par_concat<T: Pod + Send + Sync>(parts: &[Vec<T>]) -> Vec<T> {
    let mut all: Vec<T> = zeroed_vec(parts.iter().map(Vec::len).sum());
    let mut rest = all.as_mut_slice();
    let mut places = Vec::with_capacity(parts.len());
    for part in parts {
        let (place, after) = rest.split_at_mut(part.len());
        places.push((place, part));
        rest = after;
    }
    places.into_par_iter().for_each(|(place, part)| place.copy_from_slice(part));
    all
}
