//! Sharp chains are followed beyond where they fade.

use glam::DVec3;

use super::graph::Graph;
use super::{CurveKind, Scale};

/// Cosine of the largest turn that a chain may make from its direction over the last spacing.
const STRAIGHT: f64 = 0.7;
/// Over so many spacings the direction of a chain is taken.
const BACK: f64 = 1.0;

/// Adds to each free end of a sharp chain the straightest and sharpest of the edges there, as long as there
/// is one, until it meets a curve.
pub(super) fn follow(graph: &mut Graph, scale: Scale) {
    let ends: Vec<(u32, u32)> = (0..graph.links.len() as u32)
        .filter(|&link| graph.links[link as usize].on && graph.links[link as usize].kind == CurveKind::Sharp)
        .flat_map(|link| graph.links[link as usize].ends.map(|vertex| (vertex, link)))
        .filter(|&(vertex, _)| graph.degree(vertex) == 1)
        .collect();
    for (mut vertex, mut link) in ends {
        // Another end may have grown to this one.
        while graph.degree(vertex) == 1 {
            let Some(next) = continuation(graph, vertex, link, scale) else { break };
            graph.links[next as usize].on = true;
            vertex = graph.links[next as usize].other(vertex);
            link = next;
        }
    }
}

fn continuation(graph: &Graph, vertex: u32, link: u32, scale: Scale) -> Option<u32> {
    let here = graph.points[vertex as usize];
    let direction =
        (here - graph.points[behind(graph, vertex, link, BACK * scale.spacing) as usize]).normalize_or_zero();
    let mut best: Option<(f64, u32)> = None;
    for &next in graph.all_at(vertex) {
        let candidate = graph.links[next as usize];
        let step: DVec3 = graph.points[candidate.other(vertex) as usize] - here;
        let straight = step.normalize_or_zero().dot(direction);
        let score = candidate.turn.min(candidate.seen) * straight;
        if !candidate.on && straight >= STRAIGHT && best.is_none_or(|(most, _)| score > most) {
            best = Some((score, next));
        }
    }
    best.map(|(_, next)| next)
}

/// The vertex about `distance` back along the chain that comes to `vertex` by `link`.
pub(super) fn behind(graph: &Graph, vertex: u32, link: u32, distance: f64) -> u32 {
    let (mut at, mut by, mut gone) = (vertex, link, 0.0);
    loop {
        at = graph.links[by as usize].other(at);
        gone += graph.length(by);
        if gone >= distance || at == vertex {
            return at;
        }
        let Some(next) = graph.onward(at, by) else { return at };
        by = next;
    }
}
