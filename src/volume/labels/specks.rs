//! Specks of labels: parts so small compared with the largest of their label that they are noise. They become
//! what is around them.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::io::Volume;
use crate::mesh::topology::Partition;
use crate::volume::specks::{VOXELS, least_volume};
use crate::{ProgressToken, Result};

/// Parts with at least this many voxels, including cavities, are not noise, however large the label's largest
/// part is.
const MOST: f64 = 64.0;
/// A label with more parts than this, all as small as specks next to a large part, is noise as a whole.
const MOST_PARTS: usize = 8;
/// Nodes between two looks at whether to go on.
const CHUNK: usize = 1 << 20;

/// A volume whose specks have the label of most nodes next to them, and how many specks there were.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn without_specks<'a>(
    volume: &'a Volume,
    progress: &ProgressToken,
) -> Result<(Cow<'a, Volume>, usize)> {
    let part = parts(volume, progress)?;
    let mut sizes = vec![0_u32; part.len()];
    part.iter().for_each(|root| sizes[*root as usize] += 1);
    // Of each label, the size of the largest part and the number of parts.
    let mut labels: BTreeMap<u32, (u32, usize)> = BTreeMap::new();
    for (root, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0) {
        let (largest, count) = labels.entry(volume.values[root] as u32).or_default();
        *largest = (*largest).max(*size);
        *count += 1;
    }
    let least = |(largest, count): (u32, usize)| {
        let is_noise = count > MOST_PARTS && f64::from(largest) < VOXELS;
        if is_noise { VOXELS } else { least_volume(f64::from(largest)).min(MOST) }
    };
    let least: BTreeMap<u32, f64> = labels.into_iter().map(|(label, parts)| (label, least(parts))).collect();
    let is_speck = |root: u32| {
        let size = f64::from(sizes[root as usize]);
        // Most parts are large enough for any label.
        size < MOST && least.get(&(volume.values[root as usize] as u32)).is_some_and(|least| size < *least)
    };
    let mut open: Vec<u32> = (0..part.len() as u32).filter(|node| is_speck(part[*node as usize])).collect();
    let specks = open.iter().filter(|node| part[**node as usize] == **node).count();
    // Where all is noise, nothing can take its place.
    if specks == 0 || open.len() == volume.values.len() {
        return Ok((Cow::Borrowed(volume), 0));
    }
    let mut own = volume.clone();
    // Labels are at least 0.
    open.iter().for_each(|node| own.values[*node as usize] = -1.0);
    // From outside to inside, each round by the labels of the last, in no order.
    while !open.is_empty() {
        progress.poll()?;
        let found: Vec<Option<f32>> = open.iter().map(|node| most_beside(&own, *node as usize)).collect();
        open.iter().zip(&found).for_each(|(node, label)| own.values[*node as usize] = label.unwrap_or(-1.0));
        let mut label = found.iter();
        open.retain(|_| label.next().is_some_and(Option::is_none));
    }
    Ok((Cow::Owned(own), specks))
}

/// Of each node, the first node of its part: nodes of one label that are joined along the axes.
fn parts(volume: &Volume, progress: &ProgressToken) -> Result<Vec<u32>> {
    let [nx, ny, _] = volume.size;
    let values = &volume.values;
    let mut parts = Partition::new(values.len());
    for i in 0..values.len() {
        if i % CHUNK == 0 {
            progress.poll()?;
        }
        let has_before = [i % nx > 0, i / nx % ny > 0, i >= nx * ny];
        for (stride, has_before) in [1, nx, nx * ny].into_iter().zip(has_before) {
            if has_before && values[i - stride] == values[i] {
                parts.join((i - stride) as u32, i as u32);
            }
        }
    }
    Ok((0..values.len() as u32).map(|i| parts.root(i)).collect())
}

/// The label that most nodes next to a node have, the least one in a tie; `None` if all are open.
fn most_beside(volume: &Volume, node: usize) -> Option<f32> {
    let [nx, ny, nz] = volume.size;
    let at = [node % nx, node / nx % ny, node / nx / ny];
    let mut near: Vec<f32> = Vec::with_capacity(6);
    for (axis, (stride, length)) in [1, nx, nx * ny].into_iter().zip([nx, ny, nz]).enumerate() {
        if at[axis] > 0 {
            near.push(volume.values[node - stride]);
        }
        if at[axis] + 1 < length {
            near.push(volume.values[node + stride]);
        }
    }
    near.retain(|label| *label >= 0.0);
    let count = |label: f32| near.iter().filter(|other| **other == label).count();
    near.iter().copied().max_by(|a, b| count(*a).cmp(&count(*b)).then(b.total_cmp(a)))
}
