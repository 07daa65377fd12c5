//! Narrow strips that are one patch, such as the chamfers of all edges of a box: which sides of them go.

use std::collections::BTreeMap;

use glam::DVec3;

use super::graph::Graph;
use super::strips::{PLATE, length, mean_turn};
use crate::TriMesh;
use crate::mesh::bvh::Bvh;

/// Sides of a strip are parallel up to this cosine.
const PARALLEL: f64 = 0.8;
/// One side of a strip is at least this share of the other as long.
const ALONGSIDE: f64 = 0.5;
/// Turns that differ by fewer degrees are equal.
const EQUAL: f64 = 5.0;

/// An edge at the boundary of the network.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub edge: u32,
    /// The patch beyond it.
    pub beyond: u32,
    /// Whether the surface turns down there.
    pub down: bool,
    /// The direction from the edge into the patch that it bounds; of length 1.
    pub inwards: DVec3,
}

/// The edges to switch off, so that one side is left of each strip that is narrower than `width` and turns
/// like a chamfer, and none of a step. Of equal sides, those of the patch that comes first stay, so that the
/// others meet.
pub(super) fn weaker_sides(graph: &Graph, sides: &[Side], width: f64) -> Vec<u32> {
    let mut drop = Vec::new();
    for [one, other] in strips(graph, sides, width).into_values() {
        let edges = [&one, &other].map(|sides| sides.iter().map(|side| side.edge).collect::<Vec<u32>>());
        let lengths = [0, 1].map(|k| length(graph, &edges[k]));
        if lengths[0].min(lengths[1]) <= ALONGSIDE * lengths[0].max(lengths[1]) {
            continue;
        }
        let turns = [0, 1].map(|k| mean_turn(graph, &edges[k]));
        let is_down = |sides: &[Side]| 2 * sides.iter().filter(|side| side.down).count() > sides.len();
        if is_down(&one) != is_down(&other) {
            drop.extend(edges.into_iter().flatten());
        } else if turns[0] + turns[1] < PLATE {
            let weaker = usize::from(turns[0] + EQUAL > turns[1]);
            drop.extend(&edges[weaker]);
        }
    }
    drop
}

/// The sides by the two patches that their strip is between, the one that comes first first.
fn strips(graph: &Graph, sides: &[Side], width: f64) -> BTreeMap<[u32; 2], [Vec<Side>; 2]> {
    let ends = |side: &Side| graph.edges[side.edge as usize].ends.map(|v| graph.points[v as usize]);
    let lines: TriMesh = TriMesh {
        vertices: sides.iter().flat_map(&ends).collect(),
        triangles: (0..sides.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect(),
    };
    let direction = |side: &Side| {
        let [a, b] = ends(side);
        (b - a).normalize_or_zero()
    };
    let bvh = Bvh::new(&lines);
    let mut strips: BTreeMap<[u32; 2], [Vec<Side>; 2]> = BTreeMap::new();
    for side in sides {
        let [a, b] = ends(side);
        let (middle, along): (DVec3, DVec3) = (0.5 * (a + b), direction(side));
        let is_across = |k: u32| {
            let other = &sides[k as usize];
            let [from, to] = ends(other);
            let is_inside = (0.5 * (from + to) - middle).dot(side.inwards) > 0.0;
            other.beyond != side.beyond
                && direction(other).dot(along).abs() > PARALLEL
                && is_inside
                && other.inwards.dot(side.inwards) < 0.0
        };
        let Some(across) = bvh.closest_accepted_within(middle, width * width, is_across) else { continue };
        let other = sides[across.triangle as usize].beyond;
        let key = [side.beyond.min(other), side.beyond.max(other)];
        strips.entry(key).or_default()[usize::from(side.beyond > other)].push(*side);
    }
    strips
}
