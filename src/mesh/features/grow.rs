//! Sharp chains are extended to where their angle fades.

use glam::DVec3;

use super::curve::CurveKind;
use super::graph::Graph;
use super::scale::Scale;

/// Cosine of the largest turn that a chain may make from its direction over the last spacing.
const STRAIGHT: f64 = 0.7;
/// The direction of a chain is taken over this many spacings.
const BACK: f64 = 1.0;

/// Adds to each free end of a sharp chain the straightest and sharpest of the edges there, as long as there
/// is one, until it meets a curve.
pub(super) fn follow(graph: &mut Graph, scale: Scale) {
    let ends: Vec<(u32, u32)> = (0..graph.edges.len() as u32)
        .filter(|&edge| graph.edges[edge as usize].on && graph.edges[edge as usize].kind == CurveKind::Sharp)
        .flat_map(|edge| graph.edges[edge as usize].ends.map(|vertex| (vertex, edge)))
        .filter(|&(vertex, _)| graph.degree(vertex) == 1)
        .collect();
    for (mut vertex, mut edge) in ends {
        // Another end may have been extended to this one.
        while graph.degree(vertex) == 1 {
            let Some(next) = continuation(graph, vertex, edge, scale) else { break };
            graph.edges[next as usize].on = true;
            vertex = graph.edges[next as usize].other(vertex);
            edge = next;
        }
    }
}

fn continuation(graph: &Graph, vertex: u32, edge: u32, scale: Scale) -> Option<u32> {
    let here = graph.points[vertex as usize];
    let direction =
        (here - graph.points[behind(graph, vertex, edge, BACK * scale.spacing) as usize]).normalize_or_zero();
    let mut best: Option<(f64, u32)> = None;
    for &next in graph.all_at(vertex) {
        let candidate = graph.edges[next as usize];
        let step: DVec3 = graph.points[candidate.other(vertex) as usize] - here;
        let straight = step.normalize_or_zero().dot(direction);
        let score = candidate.turn.min(candidate.seen) * straight;
        if !candidate.on && straight >= STRAIGHT && best.is_none_or(|(most, _)| score > most) {
            best = Some((score, next));
        }
    }
    best.map(|(_, next)| next)
}

/// The vertex about `distance` back along the chain that comes to `vertex` by `edge`.
pub(super) fn behind(graph: &Graph, vertex: u32, edge: u32, distance: f64) -> u32 {
    let (mut at, mut by, mut gone) = (vertex, edge, 0.0);
    loop {
        at = graph.edges[by as usize].other(at);
        gone += graph.length(by);
        if gone >= distance || at == vertex {
            return at;
        }
        let Some(next) = graph.onward(at, by) else { return at };
        by = next;
    }
}
