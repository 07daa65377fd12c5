//! What is neither ground nor roof, where points have no classes: regions of cells whose heights continue
//! each other, but that are small or rough.

use rayon::prelude::*;

use super::cells::Cells;
use super::heights::{Heights, STEP};
use crate::mesh::topology::Partition;
use crate::{ProgressToken, Result};

/// Regions with fewer cells are trees, cars, poles or noise.
const LEAST_CELLS: u32 = 16;
/// Rounds at most; each takes away the lowest layer of noise.
const ROUNDS: usize = 6;
/// Regions are rough where most cells are so far from the mean of two opposite neighbours, in sides: roofs
/// are not, treetops are.
const ROUGH: f64 = 0.2;
/// Single cells this far above those around them are of treetops that the ground goes on to, in sides.
const SPIKE: f64 = 0.6;

/// Takes the heights away where points are of something that stands on the surface, and skips points below
/// it.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn leave_out_what_stands(
    cells: &Cells,
    heights: &mut Heights,
    progress: &ProgressToken,
) -> Result<()> {
    for _ in 0..ROUNDS {
        progress.poll()?;
        let regions = Regions::new(cells, heights);
        let out: Vec<usize> = (0..cells.count()).filter(|cell| regions.is_out(*cell)).collect();
        if out.is_empty() {
            break;
        }
        for cell in out {
            if regions.is_below(cell) {
                heights.skip_lowest(cells, cell);
            } else {
                heights.hide(cell);
            }
        }
    }
    let regions = Regions::new(cells, heights);
    let spikes: Vec<usize> = (0..cells.count())
        .into_par_iter()
        .filter(|cell| regions.of[*cell] == regions.largest && is_spike(cells, &heights.values, *cell))
        .collect();
    spikes.into_iter().for_each(|cell| heights.hide(cell));
    progress.poll()
}

/// Whether a cell stands out from those around it.
fn is_spike(cells: &Cells, values: &[f64], cell: usize) -> bool {
    let beside = cells.beside(cell);
    let rows = [beside[2], Some(cell), beside[3]].into_iter().flatten();
    let around = rows.flat_map(|row| {
        let [left, right, ..] = cells.beside(row);
        [left, Some(row), right].into_iter().flatten().filter(|other| *other != cell)
    });
    let mut around: Vec<f64> = around.map(|other| values[other]).filter(|height| !height.is_nan()).collect();
    around.sort_unstable_by(f64::total_cmp);
    around.get(around.len() / 2).is_some_and(|middle| values[cell] - middle > SPIKE * cells.side)
}

struct Regions {
    /// The region of each cell.
    of: Vec<u32>,
    /// Cells of each region.
    size: Vec<u32>,
    /// Cells of each that are rough, and all that could be.
    rough: Vec<[u32; 2]>,
    /// Steps up from each region to those around it, less the steps down.
    up: Vec<i32>,
    /// The region with the most cells.
    largest: u32,
}

impl Regions {
    fn new(cells: &Cells, heights: &Heights) -> Self {
        let values = &heights.values;
        let count = cells.count();
        let mut parts = Partition::new(count);
        let goes_on = |a: usize, b: usize| (values[a] - values[b]).abs() <= STEP * cells.side;
        for cell in 0..count {
            let [_, right, _, above] = cells.beside(cell);
            for other in [right, above].into_iter().flatten().filter(|other| goes_on(cell, *other)) {
                parts.join(cell as u32, other as u32);
            }
        }
        let of: Vec<u32> = (0..count as u32).map(|cell| parts.root(cell)).collect();
        let mut all =
            Self { of, size: vec![0; count], rough: vec![[0; 2]; count], up: vec![0; count], largest: 0 };
        for cell in (0..count).filter(|cell| !values[*cell].is_nan()) {
            let own = all.of[cell] as usize;
            all.size[own] += 1;
            let beside = cells.beside(cell);
            for other in beside.into_iter().flatten().filter(|other| all.of[*other] as usize != own) {
                all.up[own] += i32::from(values[other] > values[cell]);
                all.up[own] -= i32::from(values[other] < values[cell]);
            }
            for axis in 0..2 {
                let [Some(a), Some(b)] = [beside[2 * axis], beside[2 * axis + 1]] else { continue };
                if [a, b].iter().all(|other| all.of[*other] as usize == own) {
                    let off = (0.5 * (values[a] + values[b]) - values[cell]).abs();
                    all.rough[own][0] += u32::from(off > ROUGH * cells.side);
                    all.rough[own][1] += 1;
                }
            }
        }
        all.largest = (0..count as u32).max_by_key(|region| all.size[*region as usize]).unwrap_or(0);
        all
    }

    /// Whether the height of a cell belongs to no surface.
    fn is_out(&self, cell: usize) -> bool {
        let own = self.of[cell] as usize;
        let [rough, of] = self.rough[own];
        let is_small = self.size[own] < LEAST_CELLS || 4 * of < self.size[own];
        self.size[own] > 0 && self.of[cell] != self.largest && (is_small || 2 * rough > of)
    }

    /// Whether the cell's region is below those around it.
    fn is_below(&self, cell: usize) -> bool {
        self.up[self.of[cell] as usize] > 0
    }
}
