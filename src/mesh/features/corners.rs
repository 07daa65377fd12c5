//! Where curves end, branch or turn, and where the surface touches itself.

use super::LONGEST_RIM;
use super::curve::CurveKind;
use super::graph::Graph;
use super::grow::behind;
use super::surface::{FeatureSurface, degrees_between};
use crate::mesh::NONE;
use crate::mesh::half_edges::{next, previous};
use crate::mesh::topology::Partition;

/// Turns sharper than this are corners; degrees.
const TURN: f64 = 60.0;
/// A turn is measured between points this many spacings away on either side, so that noise makes no corners.
const REACH: f64 = 0.5;
/// A loop shorter than [`LONGEST_RIM`] bends everywhere and has corners only where it turns by this fraction
/// of [`TURN`] between points [`NEAR`] spacings away.
const MOST_OF_TURN: f64 = 0.75;
/// The turns of a loop shorter than [`LONGEST_RIM`] are measured between points this many spacings away on
/// either side.
const NEAR: f64 = 0.125;

/// Whether each vertex is a corner.
pub(super) fn find(graph: &Graph, surface: &FeatureSurface, spacing: f64) -> Vec<bool> {
    let mut corners = touching(surface, graph.points.len());
    let mut turns = Vec::new();
    for vertex in 0..graph.points.len() as u32 {
        if graph.all_at(vertex).is_empty() {
            continue;
        }
        let mut edges = graph.curves_at(vertex);
        match (edges.next(), edges.next(), edges.next()) {
            (None, ..) => {}
            (Some(one), Some(two), None) => {
                let kinds = [one, two].map(|edge| graph.edges[edge as usize].kind);
                corners[vertex as usize] |=
                    kinds[0] != kinds[1] && !kinds.iter().all(|kind| kind.has_two_sides());
                let is_corner = |_: &f64| {
                    !is_on_rim(graph, vertex, one, LONGEST_RIM * spacing)
                        || turn(graph, vertex, [one, two], NEAR * spacing) > MOST_OF_TURN * TURN
                };
                turns.extend(bend(graph, vertex, spacing).filter(is_corner).map(|turn| (turn, vertex)));
            }
            _ => corners[vertex as usize] = true,
        }
    }
    // Several vertices may see the same bend; the one with the sharpest turn is the corner.
    turns.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, vertex) in turns {
        if !corner_near(graph, vertex, &corners, REACH * spacing) {
            corners[vertex as usize] = true;
        }
    }
    corners
}

/// The turn in degrees at a vertex between two curve edges, if it is sharp.
pub(super) fn bend(graph: &Graph, vertex: u32, spacing: f64) -> Option<f64> {
    let mut edges = graph.curves_at(vertex);
    let (Some(one), Some(two), None) = (edges.next(), edges.next(), edges.next()) else { return None };
    Some(turn(graph, vertex, [one, two], REACH * spacing)).filter(|turn| *turn > TURN)
}

/// The turn in degrees at a vertex between points on two curve edges or beyond them, `reach` away.
fn turn(graph: &Graph, vertex: u32, edges: [u32; 2], reach: f64) -> f64 {
    let here = graph.points[vertex as usize];
    let [one, two] = edges.map(|edge| graph.points[behind(graph, vertex, edge, reach) as usize]);
    degrees_between(here - one, two - here)
}

/// Whether the sharp edge `first` leads from a vertex back to it, within a length, along sharp edges that no
/// curve meets.
fn is_on_rim(graph: &Graph, vertex: u32, first: u32, longest: f64) -> bool {
    let (mut at, mut by, mut length) = (vertex, first, 0.0);
    loop {
        length += graph.length(by);
        at = graph.edges[by as usize].other(at);
        if length > longest || graph.edges[by as usize].kind != CurveKind::Sharp {
            return false;
        }
        if at == vertex {
            return true;
        }
        let Some(next) = graph.onward(at, by) else { return false };
        by = next;
    }
}

/// Whether the curves at `vertex` have a corner closer than `reach`.
fn corner_near(graph: &Graph, vertex: u32, corners: &[bool], reach: f64) -> bool {
    graph.curves_at(vertex).any(|first| {
        let (mut at, mut by, mut gone) = (vertex, first, 0.0);
        loop {
            at = graph.edges[by as usize].other(at);
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

/// Vertices whose triangles form more than one fan, so that sheets of the surface meet in that point alone.
fn touching(surface: &FeatureSurface, vertices: usize) -> Vec<bool> {
    let corners = surface.triangles().as_flattened();
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
                let across = surface.twins[if forward { previous(half as u32) as usize } else { half }];
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
    // Fans connected through edges without twins count as one.
    let mut fans = Partition::new(vertex_of.len());
    for &[one, other] in &surface.joined {
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
