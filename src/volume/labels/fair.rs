//! A label's border without stairs: the field that bends least among all whose sign at each node is the
//! label's. Wherever a stair ends, the field knows where the border is to a fraction of a node, and bends no
//! more than it must between such places (Whitaker 2000 does the same by curvature).

use rayon::prelude::*;

use super::band::Band;
use crate::{ProgressToken, Result};

/// Steps of descent.
const STEPS: usize = 150;
/// Most of a step that the next one goes on with; more makes the fields of small parts swing.
const MOMENTUM: f32 = 0.96;
/// How strongly the field keeps to the distances it began with, relative to bending; that sets its scale.
const KEEPING: f32 = 0.004;
/// Nodes are at least so far from the border, in nodes: nearly as far as those of smooth borders are.
/// Without it, bulges shrink until they touch nodes.
const CLEARANCE: f32 = 0.035;
/// Greatest eigenvalue of the sum of squared second differences: along each axis a second difference is at
/// most 4, and so (4 + 4 + 4)² together.
const STIFFEST: f32 = 144.0;

/// Second differences at a node: xx, yy, zz there, and xy, yz, zx in the squares beginning there; 0 where a
/// node of theirs is not in the band.
type Bending = [f32; 6];

/// The axes of the mixed differences.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The field at the band's nodes, greater than 0 inside, by accelerated projected descent (Beck and Teboulle
/// 2009).
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fair(band: &Band, progress: &ProgressToken) -> Result<Vec<f32>> {
    let count = band.nodes.len();
    // One more that stands for nodes outside the band.
    let mut bending: Vec<Bending> = vec![[0.0; 6]; count + 1];
    let mut now = band.distance.clone();
    let mut ahead = now.clone();
    for step in 0..STEPS {
        bending[..count].par_iter_mut().enumerate().for_each(|(i, own)| *own = bent(band, &ahead, i));
        let moved = |i: usize| {
            let target = band.distance[i];
            let slope = resistance(band, &bending, i) + KEEPING * (ahead[i] - target);
            let to = ahead[i] - slope / (STIFFEST + KEEPING);
            if target > 0.0 { to.max(CLEARANCE) } else { to.min(-CLEARANCE) }
        };
        let next: Vec<f32> = (0..count).into_par_iter().map(moved).collect();
        let share = (step as f32 / (step + 3) as f32).min(MOMENTUM);
        let ahead_of = |i: usize| next[i] + share * (next[i] - now[i]);
        ahead = (0..count).into_par_iter().map(ahead_of).collect();
        now = next;
        if step % 8 == 0 {
            progress.poll()?;
        }
    }
    Ok(now)
}

fn bent(band: &Band, field: &[f32], i: usize) -> Bending {
    let at = |number: u32| field.get(number as usize).copied();
    let near = band.neighbours[i];
    let along = |axis: usize| Some(at(near[2 * axis])? + at(near[2 * axis + 1])? - 2.0 * field[i]);
    let across = |[a, b]: [usize; 2]| {
        let (first, second) = (near[2 * a + 1], near[2 * b + 1]);
        let both = band.neighbours.get(first as usize)?[2 * b + 1];
        Some(field[i] - at(first)? - at(second)? + at(both)?)
    };
    std::array::from_fn(|k| if k < 3 { along(k) } else { across(PAIRS[k - 3]) }.unwrap_or(0.0))
}

/// The slope of half the squared bending by the field at a node.
fn resistance(band: &Band, bending: &[Bending], i: usize) -> f32 {
    let near = band.neighbours[i];
    let of = |number: u32, k: usize| bending[number as usize][k];
    let own = i as u32;
    let along = |axis: usize| of(near[2 * axis], axis) + of(near[2 * axis + 1], axis) - 2.0 * of(own, axis);
    let across = |k: usize| {
        let [a, b] = PAIRS[k - 3];
        let (first, second) = (near[2 * a], near[2 * b]);
        let both = band.neighbours.get(first as usize).map_or(first, |near| near[2 * b]);
        // Mixed differences count twice.
        2.0 * (of(own, k) - of(first, k) - of(second, k) + of(both, k))
    };
    (0..3).map(along).sum::<f32>() + (3..6).map(across).sum::<f32>()
}
