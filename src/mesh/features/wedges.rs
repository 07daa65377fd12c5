//! Drops edges of wedges, where two chains of sharp edges meet at an acute angle: until they are far enough
//! apart, every triangle between them would be a sliver.

use glam::DVec3;

use super::corners::bend;
use super::curve::CurveKind;
use super::discarded::Discarded;
use super::graph::Graph;
use super::strips::{NARROW, PLATE, length, mean_turn};
use super::surface::FeatureSurface;

/// Two chains are a wedge if it takes them more than this many spacings to get as far apart as the sides of a
/// strip: below 14 degrees, if they are straight.
const LONG: f64 = 1.0;

/// Consecutive sharp edges from a vertex to where curves meet or end, or back to the vertex.
struct Chain {
    edges: Vec<u32>,
    /// The vertex first.
    points: Vec<DVec3>,
}

impl Chain {
    fn new(graph: &Graph, vertex: u32, first: u32) -> Self {
        let point = |v: u32| graph.points[v as usize];
        let mut chain = Self { edges: Vec::new(), points: vec![point(vertex)] };
        let (mut at, mut next) = (vertex, Some(first));
        while let Some(edge) = next.filter(|edge| graph.edges[*edge as usize].kind == CurveKind::Sharp) {
            at = graph.edges[edge as usize].other(at);
            chain.edges.push(edge);
            chain.points.push(point(at));
            next = graph.onward(at, edge).filter(|_| at != vertex);
        }
        chain
    }

    fn halve(&mut self) {
        let edges = self.edges.len() / 2;
        self.edges.truncate(edges);
        self.points.truncate(edges + 1);
    }

    /// The edges from the vertex to the last place where the chain is nearer to the other one than `width`,
    /// there and on average, before it is twice as far from it.
    fn beside(&self, other: &Self, width: f64) -> &[u32] {
        let (mut gone, mut sum) = (0.0, 0.0);
        let mut near = 0;
        for (k, ends) in self.points.windows(2).enumerate() {
            let length = ends[0].distance(ends[1]);
            gone += length;
            // Farther parts of the other chain are farther away, unless it comes back.
            let distance = other.distance(ends[1], 2.0 * gone + width);
            sum += length * distance;
            if distance > 2.0 * width {
                break;
            }
            if distance.max(sum / gone) <= width {
                near = k + 1;
            }
        }
        &self.edges[..near]
    }

    /// The distance of a point from the chain up to arc length `until`.
    fn distance(&self, from: DVec3, until: f64) -> f64 {
        let mut gone = 0.0;
        let mut least = f64::INFINITY;
        for ends in self.points.windows(2) {
            let edge = ends[1] - ends[0];
            let along = (from - ends[0]).dot(edge) / edge.length_squared();
            least = least.min(from.distance(ends[0] + along.clamp(0.0, 1.0) * edge));
            gone += edge.length();
            if gone > until {
                break;
            }
        }
        least
    }
}

/// Switches off the weaker sides of wedges as far as they are narrow; lengths are in the frame of the graph.
pub(super) fn discard_wedges(
    graph: &mut Graph,
    surface: &FeatureSurface,
    spacing: f64,
    discarded: &mut Discarded,
) {
    for vertex in 0..graph.points.len() as u32 {
        if graph.all_at(vertex).len() < 2 {
            continue;
        }
        while let Some(edges) = wedge_at(graph, surface, vertex, spacing) {
            discarded.strips += 1;
            discarded.strip_length += length(graph, &edges);
            edges.iter().for_each(|edge| graph.edges[*edge as usize].on = false);
        }
    }
}

/// The edges to drop of the first wedge at a vertex.
fn wedge_at(graph: &Graph, surface: &FeatureSurface, vertex: u32, spacing: f64) -> Option<Vec<u32>> {
    let is_sharp = |edge: &u32| graph.edges[*edge as usize].kind == CurveKind::Sharp;
    let first: Vec<u32> = graph.curves_at(vertex).filter(is_sharp).collect();
    // Most vertices have a curve that goes straight on.
    if first.len() < 2 || (graph.degree(vertex) == 2 && bend(graph, vertex, spacing).is_none()) {
        return None;
    }
    let mut chains: Vec<Chain> = first.iter().map(|edge| Chain::new(graph, vertex, *edge)).collect();
    // Of a loop, both directions up to its middle.
    chains.iter_mut().filter(|chain| chain.points.last() == chain.points.first()).for_each(Chain::halve);
    let pairs = (0..chains.len()).flat_map(|k| (0..k).map(move |m| [m, k]));
    pairs.map(|pair| pair.map(|k| &chains[k])).find_map(|[one, other]| {
        let parts = [one.beside(other, NARROW * spacing), other.beside(one, NARROW * spacing)];
        if parts.iter().any(|part| length(graph, part) <= LONG * spacing) {
            return None;
        }
        let turns = parts.map(|part| mean_turn(graph, part));
        let down = parts.map(|part| surface.turns_down(graph.points, graph.edges[part[0] as usize].half));
        let is_plate = down[0] == down[1] && turns[0] + turns[1] >= PLATE;
        (!is_plate).then(|| parts[usize::from(turns[1] < turns[0])].to_vec())
    })
}
