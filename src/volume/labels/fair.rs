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
/// Minimum distance of nodes from the border, in nodes: nearly that of the nodes at smooth borders. Without
/// it, bulges shrink until they touch nodes.
const CLEARANCE: f32 = 0.035;
/// Greatest eigenvalue of the sum of squared second differences: along each axis a second difference is at
/// most 4, and so (4 + 4 + 4)² together.
const STIFFEST: f32 = 144.0;

/// Second differences at a node: xx, yy, zz there, and xy, yz, zx in the squares beginning there; 0 where a
/// node of theirs is not in the band.
type Bending = [f32; 6];

/// The axes of the mixed differences.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
/// Nodes that one thread works on at a time.
const CHUNK: usize = 1 << 12;

/// The numbers in the band of the nodes around one; the band's length stands for none.
struct Around {
    /// Before and after it along each axis.
    near: [u32; 6],
    /// After it along both axes of a pair, and before it.
    after: [u32; 3],
    before: [u32; 3],
    /// The second differences whose nodes are all in the band, as bits.
    whole: u8,
}

/// The field at the band's nodes, greater than 0 inside, by accelerated projected descent (Beck and Teboulle
/// 2009).
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn fair(band: &Band, progress: &ProgressToken) -> Result<Vec<f32>> {
    let count = band.nodes.len();
    let around: Vec<Around> = (0..count).into_par_iter().map(|i| Around::new(band, i)).collect();
    // One more that stands for nodes outside the band.
    let mut bending: Vec<Bending> = vec![[0.0; 6]; count + 1];
    let mut now = band.distance.clone();
    now.push(0.0);
    let (mut ahead, mut further) = (now.clone(), now.clone());
    for step in 0..STEPS {
        let bend = |(i, own): (usize, &mut Bending)| *own = bending_at(&around[i], &ahead, i);
        bending[..count].par_iter_mut().enumerate().with_min_len(CHUNK).for_each(bend);
        let share = (step as f32 / (step + 3) as f32).min(MOMENTUM);
        let advance = |(i, (now, further)): (usize, (&mut f32, &mut f32))| {
            let target = band.distance[i];
            let slope = bending_slope(&around[i], &bending, i) + KEEPING * (ahead[i] - target);
            let to = ahead[i] - slope / (STIFFEST + KEEPING);
            let next = match target {
                _ if band.is_fixed[i] => target,
                _ if target > 0.0 => to.max(CLEARANCE),
                _ => to.min(-CLEARANCE),
            };
            *further = next + share * (next - *now);
            *now = next;
        };
        let values = now[..count].par_iter_mut().zip(&mut further[..count]);
        values.enumerate().with_min_len(CHUNK).for_each(advance);
        std::mem::swap(&mut ahead, &mut further);
        if step % 8 == 0 {
            progress.poll()?;
        }
    }
    now.truncate(count);
    Ok(now)
}

impl Around {
    fn new(band: &Band, i: usize) -> Self {
        let none = band.nodes.len() as u32;
        let near = band.neighbours[i];
        let from = |number: u32, way: usize| band.neighbours.get(number as usize).map_or(none, |n| n[way]);
        let after = PAIRS.map(|[a, b]| from(near[2 * a + 1], 2 * b + 1));
        let before = PAIRS.map(|[a, b]| {
            let first = near[2 * a];
            if first == none { none } else { from(first, 2 * b) }
        });
        let is_whole = |k: usize| match k {
            0..3 => near[2 * k] != none && near[2 * k + 1] != none,
            _ => {
                let [a, b] = PAIRS[k - 3];
                near[2 * a + 1] != none && near[2 * b + 1] != none && after[k - 3] != none
            }
        };
        let whole = (0..6).filter(|k| is_whole(*k)).fold(0, |bits, k| bits | 1 << k);
        Self { near, after, before, whole }
    }
}

#[inline]
fn bending_at(around: &Around, field: &[f32], i: usize) -> Bending {
    let at = |number: u32| field[number as usize];
    let ([left, right, front, back, low, high], own) = (around.near, field[i]);
    let [right, back, high] = [at(right), at(back), at(high)];
    let only = |k: u8, difference: f32| if around.whole >> k & 1 == 1 { difference } else { 0.0 };
    let [xy, yz, zx] = around.after;
    [
        only(0, at(left) + right - 2.0 * own),
        only(1, at(front) + back - 2.0 * own),
        only(2, at(low) + high - 2.0 * own),
        only(3, own - right - back + at(xy)),
        only(4, own - back - high + at(yz)),
        only(5, own - high - right + at(zx)),
    ]
}

/// The slope of half the squared bending by the field at a node.
#[inline]
fn bending_slope(around: &Around, bending: &[Bending], i: usize) -> f32 {
    let of = |number: u32| &bending[number as usize];
    let ([left, right, front, back, low, high], own) = (around.near, &bending[i]);
    let [left, front, low] = [of(left), of(front), of(low)];
    let [xy, yz, zx] = around.before;
    let along =
        left[0] + of(right)[0] - 2.0 * own[0] + front[1] + of(back)[1] - 2.0 * own[1] + low[2] + of(high)[2]
            - 2.0 * own[2];
    let across = own[3] - left[3] - front[3] + of(xy)[3] + own[4] - front[4] - low[4] + of(yz)[4] + own[5]
        - low[5]
        - left[5]
        + of(zx)[5];
    // Mixed differences count twice.
    along + 2.0 * across
}
