//! Heights where there are none: under trees, and in small gaps.

use std::collections::VecDeque;

use super::cells::beside;
use crate::mesh::topology::Partition;
use crate::{ProgressToken, Result};

/// Gaps up to this many cells across are filled in any case.
const GAP: u32 = 6;
/// Steps of smoothing of what is filled.
const STEPS: usize = 60;

/// The heights, also in hidden cells, in narrow gaps, and in holes up to `across` cells wide.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn filled(
    size: [usize; 2],
    mut heights: Vec<f64>,
    hidden: &[bool],
    across: f64,
    progress: &ProgressToken,
) -> Result<Vec<f64>> {
    let mut wanted: Vec<bool> =
        heights.iter().zip(hidden).map(|(height, hidden)| !height.is_nan() || *hidden).collect();
    close_gaps(size, &mut wanted, GAP / 2);
    close_holes(size, &mut wanted, across);
    progress.poll()?;
    let gaps: Vec<usize> = (0..heights.len()).filter(|c| wanted[*c] && heights[*c].is_nan()).collect();
    spread(size, &mut heights, &gaps);
    for _ in 0..STEPS {
        progress.poll()?;
        for cell in &gaps {
            let around = beside(size, *cell).into_iter().flatten().map(|c| heights[c]);
            let (sum, count) = around.filter(|h| !h.is_nan()).fold((0.0, 0.0), |(s, n), h| (s + h, n + 1.0));
            if count > 0.0 {
                heights[*cell] = sum / count;
            }
        }
    }
    Ok(heights)
}

/// Adds the cells that no path as wide as twice the reach comes to.
fn close_gaps(size: [usize; 2], known: &mut [bool], reach: u32) {
    let far: Vec<bool> = distances(size, known).iter().map(|distance| *distance > reach).collect();
    let from_far = distances(size, &far);
    known.iter_mut().zip(from_far).for_each(|(known, distance)| *known |= distance > reach);
}

/// Adds the holes that are at most this many cells wide and long.
fn close_holes(size: [usize; 2], known: &mut [bool], across: f64) {
    let mut holes = Partition::new(known.len());
    for cell in (0..known.len()).filter(|cell| !known[*cell]) {
        for other in beside(size, cell).into_iter().flatten().filter(|other| !known[*other]) {
            holes.join(cell as u32, other as u32);
        }
    }
    // Of each hole, the least and the greatest coordinates.
    let mut boxes = vec![[[usize::MAX, 0]; 2]; known.len()];
    let roots: Vec<usize> = (0..known.len()).map(|cell| holes.root(cell as u32) as usize).collect();
    let place = |cell: usize| [cell % size[0], cell / size[0]];
    for cell in 0..known.len() {
        for (own, c) in boxes[roots[cell]].iter_mut().zip(place(cell)) {
            *own = [own[0].min(c), own[1].max(c)];
        }
    }
    let is_hole = |[low, high]: [usize; 2], axis: usize| {
        low > 0 && high + 1 < size[axis] && (high - low + 1) as f64 <= across
    };
    for cell in 0..known.len() {
        known[cell] |= (0..2).all(|axis| is_hole(boxes[roots[cell]][axis], axis));
    }
}

/// The steps from each cell to the nearest of some.
fn distances(size: [usize; 2], from: &[bool]) -> Vec<u32> {
    let mut steps = vec![u32::MAX; from.len()];
    let mut next: VecDeque<usize> = (0..from.len()).filter(|cell| from[*cell]).collect();
    next.iter().for_each(|cell| steps[*cell] = 0);
    while let Some(cell) = next.pop_front() {
        for other in beside(size, cell).into_iter().flatten() {
            if steps[other] == u32::MAX {
                steps[other] = steps[cell] + 1;
                next.push_back(other);
            }
        }
    }
    steps
}

/// Gives each gap the height of a cell next to it, from its edge inward.
fn spread(size: [usize; 2], heights: &mut [f64], gaps: &[usize]) {
    let mut is_gap = vec![false; heights.len()];
    gaps.iter().for_each(|cell| is_gap[*cell] = true);
    let mut next: VecDeque<usize> = (0..heights.len()).filter(|cell| !heights[*cell].is_nan()).collect();
    while let Some(cell) = next.pop_front() {
        for other in beside(size, cell).into_iter().flatten() {
            if is_gap[other] && heights[other].is_nan() {
                heights[other] = heights[cell];
                next.push_back(other);
            }
        }
    }
}
