//! Tells edges of a curved surface that is sampled coarsely from creases.
//!
//! The facets of a cylinder with eight sides turn by 45 degrees at each edge, as creases do. Where they are
//! wide compared with the output's edges, both readings give good triangles, and creases are kept: an
//! icosahedron is one. Where they are narrower, no good triangles fit between the creases, and what tells is
//! the row: beyond a facet on either side, the surface goes on turning the same way. At the edge of a chamfer
//! or a stair it does not.
//!
//! Long triangles side by side that turn to and fro are a ruled surface whose quads were cut along the wrong
//! diagonals. The flanks of a stair or a thread, which do so too, have two triangles each.

use glam::DVec3;

use super::discarded::Discarded;
use super::scale::Scale;
use super::surface::FeatureSurface;
use crate::mesh::NONE;
use rayon::prelude::*;

/// Edges that turn by more degrees than this are creases: the six of a hexagon turn by 60.
const MOST: f64 = 59.0;
/// Edges that turn to and fro by more degrees than this are creases.
const MOST_TO_AND_FRO: f64 = 90.0;
/// Facets narrower than this many spacings are narrow.
const NARROW: f64 = 1.0;
/// A walk from an edge passes edges that turn by less than this fraction of its turn, such as those across
/// facets.
const FLAT: f64 = 0.25;
/// The next edge belongs to the same row if its turn is within this range, as a fraction of the edge's turn.
const ALIKE: [f64; 2] = [0.5, 2.0];
/// Triangles are long if the edge is this many times as long as the distance to the next one.
const LONG: f64 = 4.0;
/// Triangles that a walk crosses at most.
const STEPS: usize = 64;

/// What the surface does beyond the facet on one side of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Beyond {
    /// It turns the same way as at the edge.
    same_way: bool,
    /// The facet is a single, long triangle.
    is_long_triangle: bool,
}

/// Drops the edges of rows between narrow facets, of those that turn by the feature angle at least.
pub(super) fn discard_round(
    points: &[DVec3],
    surface: &FeatureSurface,
    turns: &mut Vec<(u32, f64)>,
    scale: Scale,
    discarded: &mut Discarded,
) {
    let is_round =
        |edge: &(u32, f64)| edge.1 >= scale.feature && is_round(points, surface, *edge, scale.spacing);
    let round: Vec<bool> = turns.par_iter().map(is_round).collect();
    for (half, _) in turns.iter().zip(&round).filter(|(_, round)| **round).map(|(edge, _)| edge) {
        let [a, b] = surface.ends(*half).map(|v| points[v as usize]);
        discarded.facet_length += a.distance(b);
        discarded.facet_edges += 1;
    }
    let mut is_kept = round.into_iter().map(|round| !round);
    turns.retain(|_| is_kept.next().unwrap_or(true));
}

/// Whether an edge that turns by `turn` degrees is one of a row between narrow facets. It has a twin.
fn is_round(points: &[DVec3], surface: &FeatureSurface, (half, turn): (u32, f64), spacing: f64) -> bool {
    let down = surface.turns_down(points, half);
    if turn > MOST_TO_AND_FRO {
        return false;
    }
    let is_in_row = |beyond: Option<Beyond>, same_way: bool| match beyond {
        Some(beyond) if same_way => beyond.same_way && turn < MOST,
        Some(beyond) => !beyond.same_way && beyond.is_long_triangle,
        None => false,
    };
    let sides = [half, surface.twins[half as usize]];
    let sides = sides.map(|side| beyond(points, surface, side, (turn, down), spacing));
    [true, false].into_iter().any(|same_way| sides.iter().all(|side| is_in_row(*side, same_way)))
}

/// What the surface does on the side of a half-edge, within the width of a narrow facet, along the
/// straightest way from its middle; `None` if it does not turn about as much as at the half-edge.
fn beyond(
    points: &[DVec3],
    surface: &FeatureSurface,
    first: u32,
    (turn, down): (f64, bool),
    spacing: f64,
) -> Option<Beyond> {
    let at = |half: u32| surface.ends(half).map(|v| points[v as usize]);
    let inwards = |half: u32| {
        let [a, b] = at(half);
        surface.normals[half as usize / 3].cross(b - a).normalize_or_zero()
    };
    let [a, b] = at(first);
    let (mut from, mut point, mut direction) = (first, a.midpoint(b), inwards(first));
    let (edge_length, mut gone) = (a.distance(b), 0.0);
    for step in 0..STEPS {
        let t = from / 3;
        let exit = (3 * t..3 * t + 3).filter(|half| *half != from).filter_map(|half| {
            let outwards = -inwards(half);
            let along = direction.dot(outwards);
            (along > 0.0).then(|| ((at(half)[0] - point).dot(outwards) / along, half))
        });
        let (length, half) = exit.min_by(|a, b| a.0.total_cmp(&b.0))?;
        gone += length.max(0.0);
        let twin = surface.twins[half as usize];
        if gone.is_nan() || gone > NARROW * spacing || twin == NONE || surface.is_fixed[half as usize] {
            return None;
        }
        let next = surface.turn(half);
        if next >= FLAT * turn {
            let [least, most] = ALIKE.map(|share| share * turn);
            let same_way = surface.turns_down(points, half) == down;
            let is_long_triangle = step == 0 && edge_length >= LONG * gone;
            return (least..=most).contains(&next).then_some(Beyond { same_way, is_long_triangle });
        }
        let [a, b] = at(half);
        let along = (b - a).normalize_or_zero();
        let cosine = direction.dot(along);
        point += length.max(0.0) * direction;
        direction = cosine * along + (1.0 - cosine * cosine).max(0.0).sqrt() * inwards(twin);
        from = twin;
    }
    None
}
