//! Where curves end, branch or turn, and where the surface touches itself.

use super::graph::Graph;
use super::grow::behind;
use super::surface::{Sides, degrees_between};
use crate::mesh::NONE;
use crate::mesh::half_edges::{next, previous};
use crate::mesh::topology::Partition;

/// Turns of more degrees are corners.
const TURN: f64 = 60.0;
/// The turn is that between two vertices so many spacings away along the curve, so that noise makes no
/// corners.
const REACH: f64 = 0.5;

/// Whether each vertex is a corner.
pub(super) fn find(graph: &Graph, sides: &Sides, spacing: f64) -> Vec<bool> {
    let mut corners = touching(sides, graph.points.len());
    let mut turns = Vec::new();
    for vertex in 0..graph.points.len() as u32 {
        if graph.all_at(vertex).is_empty() {
            continue;
        }
        let mut links = graph.curves_at(vertex);
        match (links.next(), links.next(), links.next()) {
            (None, ..) => {}
            (Some(one), Some(two), None) => {
                let kinds = [one, two].map(|link| graph.links[link as usize].kind);
                corners[vertex as usize] |=
                    kinds[0] != kinds[1] && !kinds.iter().all(|kind| kind.has_two_sides());
                turns.extend(bend(graph, vertex, spacing).map(|turn| (turn, vertex)));
            }
            _ => corners[vertex as usize] = true,
        }
    }
    // The sharpest of those that see one and the same bend.
    turns.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, vertex) in turns {
        if !corner_near(graph, vertex, &corners, REACH * spacing) {
            corners[vertex as usize] = true;
        }
    }
    corners
}

/// The turn in degrees at a vertex between two curve links, if it is sharp.
pub(super) fn bend(graph: &Graph, vertex: u32, spacing: f64) -> Option<f64> {
    let mut links = graph.curves_at(vertex);
    let (Some(one), Some(two), None) = (links.next(), links.next(), links.next()) else { return None };
    let here = graph.points[vertex as usize];
    let [one, two] =
        [one, two].map(|link| graph.points[behind(graph, vertex, link, REACH * spacing) as usize]);
    Some(degrees_between(here - one, two - here)).filter(|turn| *turn > TURN)
}

/// Whether the curves at `vertex` have a corner closer than `reach`.
fn corner_near(graph: &Graph, vertex: u32, corners: &[bool], reach: f64) -> bool {
    graph.curves_at(vertex).any(|first| {
        let (mut at, mut by, mut gone) = (vertex, first, 0.0);
        loop {
            at = graph.links[by as usize].other(at);
            gone += graph.length(by);
            if gone >= reach || at == vertex {
                return false;
            }
            if corners[at as usize] {
                return true;
            }
            let Some(next) = graph.onward(at, by) else { return false };
            by = next;
        }
    })
}

/// Vertices whose triangles form more than one fan, so that parts of the surface meet in that point alone.
fn touching(sides: &Sides, vertices: usize) -> Vec<bool> {
    let corners = sides.triangles().as_flattened();
    // Walks around each vertex from its first corner; a corner that no walk reaches begins another fan.
    let mut fan_of = vec![NONE; corners.len()];
    let mut vertex_of: Vec<u32> = Vec::with_capacity(vertices);
    for first in 0..corners.len() {
        if fan_of[first] != NONE {
            continue;
        }
        let fan = vertex_of.len() as u32;
        vertex_of.push(corners[first]);
        fan_of[first] = fan;
        for forward in [true, false] {
            let mut half = first;
            loop {
                let across = sides.twins[if forward { previous(half as u32) as usize } else { half }];
                if across == NONE {
                    break;
                }
                half = if forward { across } else { next(across) } as usize;
                if fan_of[half] != NONE {
                    break;
                }
                fan_of[half] = fan;
            }
        }
    }
    // Fans that hang together by edges without twins are one.
    let mut fans = Partition::new(vertex_of.len());
    for &[one, other] in &sides.joined {
        let same_way = corners[one as usize] == corners[other as usize];
        let ends = if same_way { [other, next(other)] } else { [next(other), other] };
        for (corner, end) in [one, next(one)].into_iter().zip(ends) {
            fans.join(fan_of[corner as usize], fan_of[end as usize]);
        }
    }
    let mut met = vec![false; vertices];
    let mut touching = vec![false; vertices];
    for (fan, &vertex) in (0..).zip(&vertex_of) {
        if fans.root(fan) == fan {
            touching[vertex as usize] |= met[vertex as usize];
            met[vertex as usize] = true;
        }
    }
    touching
}
