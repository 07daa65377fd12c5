//! Drops edges of strips between curves that are much narrower than the output's edges are long: each
//! triangle there would be a sliver.
//!
//! At a step the surface turns one way at one side and back at the other: it is invisible at this spacing,
//! and both sides are discarded. At a chamfer it turns the same way at both sides: the sharper one stays. So
//! it does at the side of a plate, but twice as far; there both stay, or the plate would lose its side.
//! Strips that branch are taken apart first (`network.rs`), and narrow arms of wide patches are strips, too.

use super::curve::CurveKind;
use super::discarded::Discarded;
use super::graph::{CurveEdge, Graph};
use super::network::{Side, weaker_sides};
use super::patches::patches;
use super::surface::FeatureSurface;

/// A patch narrower than this many spacings is a strip.
pub(super) const NARROW: f64 = 0.25;
/// A strip is a step if it turns each way along at least this fraction of its boundary. At most this fraction
/// may be other than sharp.
const EACH_WAY: f64 = 0.25;
/// Narrow arms of patches count if the edges that go are longer than this many spacings together.
const LONG_ARM: f64 = 0.5;
/// The sides of a chamfer turn less than this many degrees together.
pub(super) const PLATE: f64 = 135.0;

/// The boundary of a patch.
#[derive(Debug, Clone, Default)]
struct Strip {
    area: f64,
    /// Its sharp edges, except for those that have the patch on both sides; ascending.
    boundary: Vec<Side>,
    /// Length of these where the surface turns down from it, and where it turns up.
    down: f64,
    up: f64,
    /// Length of the rest: curves whatever their angle.
    fixed_length: f64,
}

impl Strip {
    fn is_narrow(&self, spacing: f64) -> bool {
        // A strip has two long sides.
        let sharp = self.down + self.up;
        self.fixed_length < EACH_WAY * sharp && 2.0 * self.area < NARROW * spacing * sharp
    }

    /// The edges to switch off if the strip is narrow.
    fn to_drop(&self, graph: &Graph, spacing: f64) -> Vec<u32> {
        if self.down.min(self.up) > EACH_WAY * (self.down + self.up) {
            return self.edges().collect();
        }
        let mut chains = self.chains(graph);
        chains.sort_by(|a, b| length(graph, b).total_cmp(&length(graph, a)));
        let [one, other, ends @ ..] = &chains[..] else { return Vec::new() };
        let ends: f64 = ends.iter().map(|end| length(graph, end)).sum();
        let turns = [one, other].map(|chain| mean_turn(graph, chain));
        if ends > EACH_WAY * (self.down + self.up) {
            return weaker_sides(graph, &self.boundary, 2.0 * NARROW * spacing);
        }
        if turns[0] + turns[1] >= PLATE {
            return Vec::new();
        }
        if turns[0] < turns[1] { one.clone() } else { other.clone() }
    }

    /// The edges to switch off at narrow arms of a patch that is not narrow as a whole, such as a ledge along
    /// a wall that ends in a wide one.
    fn arms(&self, graph: &Graph, spacing: f64) -> Vec<u32> {
        let edges = weaker_sides(graph, &self.boundary, NARROW * spacing);
        if length(graph, &edges) > LONG_ARM * spacing { edges } else { Vec::new() }
    }

    fn edges(&self) -> impl Iterator<Item = u32> {
        self.boundary.iter().map(|side| side.edge)
    }

    /// The boundary in chains from corner to corner.
    fn chains(&self, graph: &Graph) -> Vec<Vec<u32>> {
        let mut left: Vec<u32> = self.edges().collect();
        let mut chains = Vec::new();
        while let Some(first) = left.first().copied() {
            let mut chain = vec![first];
            for end in graph.edges[first as usize].ends {
                let (mut at, mut by) = (end, first);
                while let Some(next) = graph.onward(at, by).filter(|next| *next != first) {
                    chain.push(next);
                    at = graph.edges[next as usize].other(at);
                    by = next;
                }
            }
            chain.sort_unstable();
            chain.dedup();
            left.retain(|edge| chain.binary_search(edge).is_err());
            chains.push(chain);
        }
        chains
    }
}

/// The mean angle in degrees by which the surface turns at these edges.
pub(super) fn mean_turn(graph: &Graph, edges: &[u32]) -> f64 {
    let turn = |edge: &u32| graph.length(*edge) * graph.edges[*edge as usize].turn;
    edges.iter().map(turn).sum::<f64>() / length(graph, edges).max(f64::MIN_POSITIVE)
}

pub(super) fn length(graph: &Graph, edges: &[u32]) -> f64 {
    edges.iter().map(|edge| graph.length(*edge)).sum()
}

/// Switches off edges of narrow strips; lengths are in the frame of the graph.
pub(super) fn discard_strips(
    graph: &mut Graph,
    surface: &FeatureSurface,
    spacing: f64,
    discarded: &mut Discarded,
) {
    let is_sharp = |edge: &CurveEdge| edge.on && edge.kind == CurveKind::Sharp;
    // Most surfaces have no sharp edge, and need no patches here.
    if !graph.edges.iter().any(is_sharp) {
        return;
    }
    for strip in &strips(graph, surface) {
        let is_narrow = strip.is_narrow(spacing);
        let edges = if is_narrow { strip.to_drop(graph, spacing) } else { strip.arms(graph, spacing) };
        // A neighbouring strip may have lost one of them.
        if edges.is_empty() || strip.edges().any(|edge| !graph.edges[edge as usize].on) {
            continue;
        }
        discarded.strips += 1;
        discarded.strip_length += length(graph, &edges);
        edges.iter().for_each(|edge| graph.edges[*edge as usize].on = false);
    }
}

/// All patches.
fn strips(graph: &Graph, surface: &FeatureSurface) -> Vec<Strip> {
    let (of, count) = patches(graph, surface);
    let of = |half: u32| of[half as usize / 3] as usize;
    let mut strips = vec![Strip::default(); count];
    for (t, area) in (0..).zip(&surface.areas) {
        strips[of(3 * t)].area += area;
    }
    for half in (0..).zip(&surface.is_fixed).filter(|(_, fixed)| **fixed).map(|(half, _)| half) {
        let [a, b] = surface.ends(half).map(|v| graph.points[v as usize]);
        strips[of(half)].fixed_length += a.distance(b);
    }
    for (number, edge) in (0..).zip(&graph.edges) {
        if !edge.on || edge.kind != CurveKind::Sharp {
            continue;
        }
        let both = [edge.half, surface.twins[edge.half as usize]].map(of);
        if both[0] == both[1] {
            continue;
        }
        let (length, down) = (graph.length(number), surface.turns_down(graph.points, edge.half));
        let halves = [edge.half, surface.twins[edge.half as usize]];
        for (half, strip, beyond) in [(halves[0], both[0], both[1]), (halves[1], both[1], both[0])] {
            let [a, b] = surface.ends(half).map(|v| graph.points[v as usize]);
            let inwards = surface.normals[half as usize / 3].cross(b - a).normalize_or_zero();
            let strip = &mut strips[strip];
            strip.boundary.push(Side { edge: number, beyond: beyond as u32, down, inwards });
            *if down { &mut strip.down } else { &mut strip.up } += length;
        }
    }
    strips
}
