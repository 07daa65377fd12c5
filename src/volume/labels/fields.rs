//! A field for each label, greater than 0 where the label is.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::band::{Band, Extent};
use super::fair::fair;
use super::sharp::{self, Cells};
use crate::io::Volume;
use crate::{ProgressToken, Result};

/// The share of progress that fields are of it.
const SHARE: f64 = 0.6;
/// Labels whose box has more than this part of the volume's nodes are made one by one.
const LARGE: usize = 8;

/// The fields near the labels' borders.
pub(super) struct Fields {
    fields: BTreeMap<u32, Field>,
    /// Cells through which sharp edges of any label pass.
    pub sharp: Cells,
}

struct Field {
    /// Ascending indices of nodes.
    nodes: Vec<u32>,
    values: Vec<f32>,
}

impl Fields {
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn new(volume: &Volume, progress: &ProgressToken) -> Result<Self> {
        let extents: Vec<(u32, Extent)> = extents(volume).into_iter().collect();
        let done = AtomicUsize::new(0);
        let make = |(label, extent): &(u32, Extent)| {
            let is_inside = |index: usize| volume.values[index] as u32 == *label;
            let mut band = Band::new(volume.size, extent, is_inside);
            progress.poll()?;
            let sharp = sharp::fix(&mut band, volume.size, is_inside);
            let values = fair(&band, progress)?;
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.done(SHARE * count as f64 / extents.len() as f64)?;
            Ok((*label, Field { nodes: band.nodes, values }, sharp))
        };
        // Large ones take memory, and threads enough.
        let is_large = |(_, extent): &&(u32, Extent)| {
            let nodes: usize = extent.iter().map(ExactSizeIterator::len).product();
            nodes > volume.values.len() / LARGE
        };
        // Of two labels, one is where the other is not.
        let own = if extents.len() == 2 { &extents[1..] } else { &extents[..] };
        let (large, small): (Vec<_>, Vec<_>) = own.iter().partition(is_large);
        let mut found = large.into_iter().map(make).collect::<Result<Vec<_>>>()?;
        found.extend(small.into_par_iter().map(make).collect::<Result<Vec<_>>>()?);
        let (mut fields, mut sharp) = (BTreeMap::new(), Cells::new());
        if let ([(other, _), _], [(_, field, _)]) = (&extents[..], &found[..]) {
            let values = field.values.iter().map(|value| -value).collect();
            fields.insert(*other, Field { nodes: field.nodes.clone(), values });
        }
        for (label, field, cells) in found {
            fields.insert(label, field);
            cells.into_iter().for_each(|(cell, axes)| *sharp.entry(cell).or_default() |= axes);
        }
        Ok(Self { fields, sharp })
    }

    /// All labels, ascending.
    pub fn labels(&self) -> impl Iterator<Item = u32> {
        self.fields.keys().copied()
    }

    /// A label's field at a node next to its border.
    pub fn at(&self, label: u32, node: u32) -> Option<f32> {
        let field = self.fields.get(&label)?;
        field.nodes.binary_search(&node).ok().map(|number| field.values[number])
    }
}

/// Each label with the indices along each axis between which it lies.
fn extents(volume: &Volume) -> BTreeMap<u32, Extent> {
    let [nx, ny, _] = volume.size;
    let of_row = |(row, values): (usize, &[f32])| {
        let (y, z) = (row % ny, row / ny);
        let mut found: BTreeMap<u32, Extent> = BTreeMap::new();
        let mut x = 0;
        for same in values.chunk_by(|a, b| a == b) {
            grow(&mut found, same[0] as u32, [x..x + same.len(), y..y + 1, z..z + 1]);
            x += same.len();
        }
        found
    };
    let join = |mut all: BTreeMap<u32, Extent>, more: BTreeMap<u32, Extent>| {
        more.into_iter().for_each(|(label, extent)| grow(&mut all, label, extent));
        all
    };
    volume.values.par_chunks(nx).enumerate().map(of_row).reduce(BTreeMap::new, join)
}

fn grow(all: &mut BTreeMap<u32, Extent>, label: u32, extent: Extent) {
    let own = all.entry(label).or_insert_with(|| extent.clone());
    for (own, other) in own.iter_mut().zip(extent) {
        *own = own.start.min(other.start)..own.end.max(other.end);
    }
}
