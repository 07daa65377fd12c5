//! A field for each label, greater than 0 where the label is.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::band::{Band, Extent};
use super::fair::fair;
use crate::io::Volume;
use crate::{ProgressToken, Result};

/// The fields near the labels' borders.
pub(super) struct Fields(BTreeMap<u32, Field>);

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
        let share = 0.6 / extents.len() as f64;
        let mut fields = BTreeMap::new();
        for (k, (label, extent)) in extents.iter().enumerate() {
            let band = Band::new(volume.size, extent, |index| volume.values[index] as u32 == *label);
            progress.poll()?;
            let values = fair(&band, progress)?;
            fields.insert(*label, Field { nodes: band.nodes, values });
            progress.done(share * (k + 1) as f64)?;
        }
        Ok(Self(fields))
    }

    /// All labels, ascending.
    pub fn labels(&self) -> impl Iterator<Item = u32> {
        self.0.keys().copied()
    }

    /// A label's field at a node next to its border.
    pub fn at(&self, label: u32, node: u32) -> Option<f32> {
        let field = self.0.get(&label)?;
        field.nodes.binary_search(&node).ok().map(|number| field.values[number])
    }
}

/// Each label with the indices along each axis between which it lies.
fn extents(volume: &Volume) -> BTreeMap<u32, Extent> {
    let [nx, ny, _] = volume.size;
    let of_row = |(row, values): (usize, &[f32])| {
        let (y, z) = (row % ny, row / ny);
        let mut found: BTreeMap<u32, Extent> = BTreeMap::new();
        for (x, value) in values.iter().enumerate() {
            grow(&mut found, *value as u32, [x..x + 1, y..y + 1, z..z + 1]);
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
