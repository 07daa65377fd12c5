//! A height for each cell: that of its lowest points.

use glam::{DVec2, DVec3, Vec3Swizzles};
use rayon::prelude::*;

use super::cells::{Cells, Inside};
use crate::{ProgressToken, Result};

/// The lowest points of a cell are those at most this many sides above the very lowest.
const LAYER: f64 = 0.25;
/// Heights further apart than this, in sides, are not of one slope.
pub(super) const STEP: f64 = 1.2;

/// Heights of cells.
pub(super) struct Heights {
    /// Relative to the cells' origin; NaN where there is none.
    pub values: Vec<f64>,
    /// Of each cell, the lowest points that do not count, since they are below the surface.
    pub skipped: Vec<u32>,
    /// Cells whose points are all of something that stands on the surface.
    pub hidden: Vec<bool>,
}

/// Heights in the middle of cells, with the slope taken into account.
pub(super) struct Tilted {
    pub values: Vec<f64>,
    /// The points they are of, ascending.
    pub used: Vec<u32>,
    /// Of those, root mean square.
    pub noise: f64,
}

impl Heights {
    /// Of the lowest points in each cell.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn lowest(cells: &Cells, progress: &ProgressToken) -> Result<Self> {
        let values = (0..cells.count()).into_par_iter().map(|cell| lowest(cells, cell, 0)).collect();
        progress.poll()?;
        Ok(Self { values, skipped: vec![0; cells.count()], hidden: vec![false; cells.count()] })
    }

    /// Takes the next higher points of a cell; or none, if there are no more.
    pub fn skip_lowest(&mut self, cells: &Cells, cell: usize) {
        let points = &cells.of(cell)[self.skipped[cell] as usize..];
        let gap = points.windows(2).take_while(|pair| pair[1].at.z - pair[0].at.z < STEP * cells.side);
        self.skipped[cell] += 1 + gap.count() as u32;
        self.values[cell] = lowest(cells, cell, self.skipped[cell] as usize);
    }

    /// Takes a cell's height away.
    pub fn hide(&mut self, cell: usize) {
        self.values[cell] = f64::NAN;
        self.hidden[cell] = true;
    }

    /// The heights in the middle of cells, of points that are lowest with regard to the slope there.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn along_slopes(cells: &Cells, heights: &Self, progress: &ProgressToken) -> Result<Tilted> {
        let of_cell = |cell: usize| {
            if heights.values[cell].is_nan() {
                return (f64::NAN, Vec::new(), 0.0);
            }
            let slope = heights.slope(cells, cell);
            let middle = cells.middle(cell);
            let level = |p: &Inside| p.at.z - slope.dot((p.at - middle).xy());
            let points = &cells.of(cell)[heights.skipped[cell] as usize..];
            let least = points.iter().map(level).fold(f64::INFINITY, f64::min);
            let lowest = points.iter().filter(|p| level(p) <= least + LAYER * cells.side);
            let count = lowest.clone().count() as f64;
            let mean = lowest.clone().map(level).sum::<f64>() / count;
            let square = lowest.clone().map(|p| (level(p) - mean).powi(2)).sum::<f64>();
            (mean, lowest.map(|p| p.point).collect(), square)
        };
        let all: Vec<(f64, Vec<u32>, f64)> = (0..cells.count()).into_par_iter().map(of_cell).collect();
        progress.poll()?;
        let mut used: Vec<u32> = all.iter().flat_map(|(_, points, _)| points).copied().collect();
        used.par_sort_unstable();
        let square: f64 = all.iter().map(|(_, _, square)| square).sum();
        let noise = (square / used.len().max(1) as f64).sqrt();
        Ok(Tilted { values: all.into_iter().map(|(value, _, _)| value).collect(), used, noise })
    }

    /// The slope at a cell, from the neighbouring cells that continue it.
    fn slope(&self, cells: &Cells, cell: usize) -> DVec2 {
        let own = self.values[cell];
        let beside = cells.beside(cell);
        let along = |axis: usize| {
            let rise = |k: usize| {
                let other = self.values[beside[2 * axis + k]?];
                let rise = (other - own) * if k == 0 { -1.0 } else { 1.0 };
                (rise.abs() < STEP * cells.side).then_some(rise)
            };
            match [rise(0), rise(1)] {
                [Some(a), Some(b)] => 0.5 * (a + b) / cells.side,
                [Some(a), None] | [None, Some(a)] => a / cells.side,
                [None, None] => 0.0,
            }
        };
        DVec2::new(along(0), along(1))
    }
}

/// The mean height of a cell's lowest points but for some.
fn lowest(cells: &Cells, cell: usize, skipped: usize) -> f64 {
    let points = cells.of(cell).get(skipped..).unwrap_or_default();
    let Some(first) = points.first() else { return f64::NAN };
    let most = first.at.z + LAYER * cells.side;
    let lowest = points.iter().take_while(|p| p.at.z <= most);
    let sum: DVec3 = lowest.clone().map(|p| p.at).sum();
    sum.z / lowest.count() as f64
}
