//! Takes back edges of strips between curves that are much narrower than the output's triangles are long:
//! each triangle there would be a sliver.
//!
//! At a step the surface turns one way at one side and back at the other: nobody sees it at this spacing, and
//! both sides go. At a chamfer it turns the same way at both: the sharper one stays. The side of a plate does
//! so too, but twice as far; there both stay, for the plate would lose its side.

use super::graph::{Graph, Link};
use super::patches::patches;
use super::surface::Sides;
use super::{CurveKind, Dropped};

/// A patch narrower than this many spacings is a strip.
pub(super) const NARROW: f64 = 0.25;
/// It is a step if it turns each way along at least this share of its rim. No more of it may be other than
/// sharp.
const EACH_WAY: f64 = 0.25;
/// The sides of a chamfer turn less than this many degrees together.
pub(super) const PLATE: f64 = 135.0;

/// A patch as it borders on others.
#[derive(Debug, Clone, Default)]
struct Strip {
    area: f64,
    /// Its sharp edges, but for those that have it on both sides, rising.
    rim: Vec<u32>,
    /// Length of these where the surface turns down from it, and where it turns up.
    down: f64,
    up: f64,
    /// And of the rest of its rim, where it is a curve whatever its angle.
    held: f64,
}

impl Strip {
    fn is_narrow(&self, spacing: f64) -> bool {
        // A strip has two long sides.
        let sharp = self.down + self.up;
        self.held < EACH_WAY * sharp && 2.0 * self.area < NARROW * spacing * sharp
    }

    /// What is to be switched off, if this is narrow.
    fn to_drop(&self, graph: &Graph) -> Vec<u32> {
        if self.down.min(self.up) > EACH_WAY * (self.down + self.up) {
            return self.rim.clone();
        }
        let mut sides = self.sides(graph);
        sides.sort_by(|a, b| length(graph, b).total_cmp(&length(graph, a)));
        let [one, other, ends @ ..] = &sides[..] else { return Vec::new() };
        let ends: f64 = ends.iter().map(|end| length(graph, end)).sum();
        let turns = [one, other].map(|side| mean_turn(graph, side));
        if ends > EACH_WAY * (self.down + self.up) || turns[0] + turns[1] >= PLATE {
            return Vec::new();
        }
        if turns[0] < turns[1] { one.clone() } else { other.clone() }
    }

    /// The rim in chains from corner to corner.
    fn sides(&self, graph: &Graph) -> Vec<Vec<u32>> {
        let mut left = self.rim.clone();
        let mut sides = Vec::new();
        while let Some(first) = left.first().copied() {
            let mut side = vec![first];
            for end in graph.links[first as usize].ends {
                let (mut at, mut by) = (end, first);
                while let Some(next) = graph.onward(at, by).filter(|next| *next != first) {
                    side.push(next);
                    at = graph.links[next as usize].other(at);
                    by = next;
                }
            }
            side.sort_unstable();
            side.dedup();
            left.retain(|link| side.binary_search(link).is_err());
            sides.push(side);
        }
        sides
    }
}

/// The mean angle in degrees by which the surface turns at these links.
pub(super) fn mean_turn(graph: &Graph, links: &[u32]) -> f64 {
    let turn = |link: &u32| graph.length(*link) * graph.links[*link as usize].turn;
    links.iter().map(turn).sum::<f64>() / length(graph, links).max(f64::MIN_POSITIVE)
}

pub(super) fn length(graph: &Graph, links: &[u32]) -> f64 {
    links.iter().map(|link| graph.length(*link)).sum()
}

/// Switches off what strips can do without; lengths are in the frame of the graph.
pub(super) fn drop_strips(graph: &mut Graph, sides: &Sides, spacing: f64, dropped: &mut Dropped) {
    let is_sharp = |link: &Link| link.on && link.kind == CurveKind::Sharp;
    // Most surfaces have none, and need no patches here.
    if !graph.links.iter().any(is_sharp) {
        return;
    }
    for strip in strips(graph, sides).iter().filter(|strip| strip.is_narrow(spacing)) {
        let links = strip.to_drop(graph);
        // A strip beside it may have lost that one.
        if links.is_empty() || strip.rim.iter().any(|link| !graph.links[*link as usize].on) {
            continue;
        }
        dropped.strips += 1;
        dropped.strip_length += length(graph, &links);
        links.iter().for_each(|link| graph.links[*link as usize].on = false);
    }
}

/// All patches.
fn strips(graph: &Graph, sides: &Sides) -> Vec<Strip> {
    let (of, count) = patches(graph, sides);
    let of = |half: u32| of[half as usize / 3] as usize;
    let mut strips = vec![Strip::default(); count];
    for (t, area) in (0..).zip(&sides.areas) {
        strips[of(3 * t)].area += area;
    }
    for half in (0..).zip(&sides.is_fixed).filter(|(_, fixed)| **fixed).map(|(half, _)| half) {
        let [a, b] = sides.ends(half).map(|v| graph.points[v as usize]);
        strips[of(half)].held += a.distance(b);
    }
    for (number, link) in (0..).zip(&graph.links) {
        if !link.on || link.kind != CurveKind::Sharp {
            continue;
        }
        let both = [link.half, sides.twins[link.half as usize]].map(of);
        if both[0] == both[1] {
            continue;
        }
        let (length, down) = (graph.length(number), sides.turns_down(graph.points, link.half));
        for strip in both {
            let strip = &mut strips[strip];
            strip.rim.push(number);
            *if down { &mut strip.down } else { &mut strip.up } += length;
        }
    }
    strips
}
