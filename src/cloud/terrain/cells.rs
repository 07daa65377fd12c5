//! Points in square cells, as seen from above.

use glam::DVec3;
use rayon::prelude::*;

use crate::{ProgressToken, Result};

/// Cells have this many points on average.
const POINTS: f64 = 4.0;
/// Cells with points at most; a surface has two triangles for each.
const MOST_CELLS: f64 = 2.5e5;
/// Cells at most with the empty ones, which cost memory alone.
const MOST_WITH_EMPTY: f64 = 4e6;
/// The extent of the points is that without this fraction of them at either end, which may be stray.
const TAIL: f64 = 0.002;
/// Points may lie beyond the extent by this fraction of it; those farther away do not count.
const BEYOND: f64 = 0.5;
/// Points of one cell have several heights if they are this many sides apart.
const SEVERAL: f64 = 2.0;

/// A point in a cell, relative to the cells' origin.
#[derive(Clone, Copy)]
pub(super) struct Inside {
    pub cell: u32,
    /// Of the cloud.
    pub point: u32,
    pub at: DVec3,
}

pub(super) struct Cells {
    pub origin: DVec3,
    pub side: f64,
    /// Cells along x and y; cell `x, y` has the number `x + size[0] * y`.
    pub size: [usize; 2],
    /// The distance between points, seen from above.
    pub spacing: f64,
    /// Ascending by cell, then by height.
    points: Vec<Inside>,
    /// Where the points of each cell begin, and the number of all.
    begin: Vec<u32>,
}

impl Cells {
    /// Points that are far from most others are left out; `None` if there is no area.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn new(all: &[DVec3], chosen: &[u32], progress: &ProgressToken) -> Result<Option<Self>> {
        if chosen.is_empty() {
            return Ok(None);
        }
        let [x, y, z] = [0, 1, 2].map(|axis| most(all, chosen, axis));
        let (low, high) = (DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1]));
        let room = BEYOND * (high - low);
        let is_near = |p: DVec3| {
            (0..2).all(|axis| p[axis] >= low[axis] - room[axis] && p[axis] <= high[axis] + room[axis])
        };
        let near: Vec<u32> = chosen.iter().copied().filter(|i| is_near(all[*i as usize])).collect();
        let places = || near.par_iter().map(|i| all[*i as usize]);
        let origin = places().reduce(|| DVec3::INFINITY, DVec3::min).with_z(low.z);
        let extent = places().reduce(|| DVec3::NEG_INFINITY, DVec3::max) - origin;
        let box_area = extent.x * extent.y;
        if !(box_area > 0.0 && box_area.is_finite()) {
            return Ok(None);
        }
        progress.poll()?;
        let count = near.len() as f64;
        let least = (box_area / MOST_WITH_EMPTY).sqrt();
        let mut area = box_area;
        let mut side = (POINTS * area / count).sqrt();
        // Points cover a part of their box. Narrow boxes have a row of cells at least.
        for _ in 0..3 {
            side = (POINTS * area / count).max(area / MOST_CELLS).sqrt().max(least);
            let mut taken: Vec<[u32; 2]> = places().map(|p| index(p - origin, side)).collect();
            taken.par_sort_unstable();
            taken.dedup();
            area = (taken.len() as f64 * side * side).min(area);
            progress.poll()?;
        }
        let size = [extent.x, extent.y].map(|length| (length / side) as usize + 1);
        let inside = |i: &u32| {
            let at = all[*i as usize] - origin;
            let [x, y] = index(at, side);
            Inside { cell: x + size[0] as u32 * y, point: *i, at }
        };
        let mut points: Vec<Inside> = near.par_iter().map(inside).collect();
        points.par_sort_unstable_by(|a, b| {
            a.cell.cmp(&b.cell).then(a.at.z.total_cmp(&b.at.z)).then(a.point.cmp(&b.point))
        });
        progress.poll()?;
        let mut begin = vec![0_u32; size[0] * size[1] + 1];
        points.iter().for_each(|p| begin[p.cell as usize + 1] += 1);
        for cell in 1..begin.len() {
            begin[cell] += begin[cell - 1];
        }
        let spacing = (area / count).sqrt();
        Ok(Some(Self { origin, side, size, spacing, points, begin }))
    }

    pub fn count(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The points of a cell, lowest first.
    pub fn of(&self, cell: usize) -> &[Inside] {
        &self.points[self.begin[cell] as usize..self.begin[cell + 1] as usize]
    }

    /// The middle of a cell, at height 0.
    pub fn middle(&self, cell: usize) -> DVec3 {
        let [x, y] = [cell % self.size[0], cell / self.size[0]].map(|c| (c as f64 + 0.5) * self.side);
        DVec3::new(x, y, 0.0)
    }

    /// The cells before and after one along x and along y.
    pub fn beside(&self, cell: usize) -> [Option<usize>; 4] {
        beside(self.size, cell)
    }

    /// The share of points in cells that have points far above others.
    pub fn share_with_several_heights(&self) -> f64 {
        let has_several = |points: &[Inside]| match points {
            [first, .., last] => last.at.z - first.at.z > SEVERAL * self.side,
            _ => false,
        };
        let points = (0..self.count()).map(|cell| self.of(cell)).filter(|points| has_several(points));
        points.map(<[Inside]>::len).sum::<usize>() as f64 / self.points.len() as f64
    }
}

/// The cells before and after one along x and along y.
pub(super) fn beside([nx, ny]: [usize; 2], cell: usize) -> [Option<usize>; 4] {
    let (x, y) = (cell % nx, cell / nx);
    [
        (x > 0).then(|| cell - 1),
        (x + 1 < nx).then(|| cell + 1),
        (y > 0).then(|| cell - nx),
        (y + 1 < ny).then(|| cell + nx),
    ]
}

fn index(p: DVec3, side: f64) -> [u32; 2] {
    [p.x, p.y].map(|c| (c / side) as u32)
}

/// The height of most points as a share of their width along x or y; NaN without both.
pub(super) fn flatness(all: &[DVec3], chosen: &[u32]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| most(all, chosen, axis)).map(|[low, high]| high - low);
    z / x.min(y)
}

/// Between which coordinates most of some points lie.
fn most(all: &[DVec3], chosen: &[u32], axis: usize) -> [f64; 2] {
    let mut values: Vec<f64> = chosen.iter().map(|i| all[*i as usize][axis]).collect();
    let last = values.len() - 1;
    let tail = (TAIL * last as f64) as usize;
    [tail, last - tail].map(|rank| *values.select_nth_unstable_by(rank, f64::total_cmp).1)
}
