//! Drops chains of sharp edges that are too short to be a feature.

use super::corners::bend;
use super::curve::CurveKind;
use super::discarded::Discarded;
use super::graph::Graph;
use super::strips::NARROW;

/// Connected sharp edges are discarded below this many spacings of total length, plus [`PER_FLAW`].
const SHORTEST: f64 = 2.0;
/// Spacings that each free end and each sharp bend adds to [`SHORTEST`].
const PER_FLAW: f64 = 4.0;
/// Where the angle hardly changes along the chains, each flaw adds this much: creases of CAD parts bend
/// often, and end where a strip next to them was given up.
const PER_EVEN_FLAW: f64 = 0.5;
/// Where the angle changes from edge to edge, a spacing counts as at least this many edges, times the mean
/// change over the mean angle: 0 to 0.1 on CAD parts, 0.2 to 0.4 on scans. Noise is of the input's size,
/// however fine the output; it also makes chains branch.
const ROUGH_EDGES: f64 = 10.0;
/// Chains are even if their roughness is at most this. The bends of an even loop, a rim, are not flaws.
const EVEN: f64 = 0.1;
/// Flaws of even chains are cheap from this many edges on: fewer may be even by chance.
const LEAST_EDGES_OF_NET: usize = 12;
/// Roughness counts in full where at least this fraction of the vertices inside chains are neither bends nor
/// branches, in proportion where fewer are.
const ENOUGH_STRAIGHT: f64 = 0.25;
/// A rim has at least this many edges: single triangles that are folded over have even angles, too.
const LEAST_EDGES_OF_RIM: usize = 6;
/// A rim is at least this many spacings long, as many as the perimeter of a triangle.
const SHORTEST_RIM: f64 = 3.0;
/// At least this fraction of the length of connected edges with flaws must be sharp by itself.
const STRONG: f64 = 0.5;
/// Chains with a free end are discarded below this many spacings.
const DANGLING: f64 = 3.0;

/// Switches off dangling chains, then components that are too short; lengths are in the frame of the graph.
pub(super) fn discard_short_chains(graph: &mut Graph, spacing: f64, discarded: &mut Discarded) {
    discard_dangling(graph, DANGLING * spacing, discarded);
    discard_short(graph, spacing, discarded);
}

/// Whether a chain that ends at `vertex` ends at another one all the same, except for the width of a narrow
/// strip.
fn ends_at_other(graph: &Graph, vertex: u32, spacing: f64) -> bool {
    let at = graph.points[vertex as usize];
    let is_near = |v: u32| graph.points[v as usize].distance(at) < NARROW * spacing;
    let others = graph.edges.iter().filter(|edge| edge.on && !edge.ends.contains(&vertex));
    others.flat_map(|edge| edge.ends).any(is_near)
}

fn is_sharp(graph: &Graph, edge: u32) -> bool {
    let edge = &graph.edges[edge as usize];
    edge.on && edge.kind == CurveKind::Sharp
}

/// The chain from the free end `vertex` to the next vertex with more or fewer than two curve edges, and its
/// length.
fn dangling_chain(graph: &Graph, vertex: u32) -> (Vec<u32>, u32, f64) {
    let (mut at, mut length, mut chain) = (vertex, 0.0, Vec::new());
    let mut next = graph.curves_at(vertex).next();
    while let Some(edge) = next {
        if !is_sharp(graph, edge) {
            break;
        }
        chain.push(edge);
        length += graph.length(edge);
        at = graph.edges[edge as usize].other(at);
        next = graph.onward(at, edge);
    }
    (chain, at, length)
}

/// Shortest first, because what is left at the junction may then be one chain.
fn discard_dangling(graph: &mut Graph, shortest: f64, discarded: &mut Discarded) {
    loop {
        let mut dangling: Vec<(f64, u32)> = (0..graph.edges.len() as u32)
            .filter(|&edge| is_sharp(graph, edge))
            .flat_map(|edge| graph.edges[edge as usize].ends)
            .filter(|&vertex| graph.degree(vertex) == 1)
            .filter_map(|vertex| {
                let (_, at, length) = dangling_chain(graph, vertex);
                (length < shortest && graph.degree(at) > 2).then_some((length, vertex))
            })
            .collect();
        if dangling.is_empty() {
            return;
        }
        dangling.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, vertex) in dangling {
            let (chain, at, length) = dangling_chain(graph, vertex);
            if length < shortest && graph.degree(at) > 2 {
                chain.iter().for_each(|&edge| graph.edges[edge as usize].on = false);
                discarded.dangling_chains += 1;
                discarded.dangling_length += length;
            }
        }
    }
}

/// Judges each connected component of sharp edges as a whole.
fn discard_short(graph: &mut Graph, spacing: f64, discarded: &mut Discarded) {
    let mut seen = vec![false; graph.edges.len()];
    for first in 0..graph.edges.len() as u32 {
        if seen[first as usize] || !is_sharp(graph, first) {
            continue;
        }
        let component = Component::around(graph, first, &mut seen);
        if component.is_too_short(graph, spacing) {
            component.edges.iter().for_each(|&edge| graph.edges[edge as usize].on = false);
            discarded.short_chains += 1;
            discarded.short_length += component.length;
        }
    }
}

/// The mean of some numbers.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, number: f64) {
        self.sum += number;
        self.count += 1;
    }

    /// 0 of none.
    fn mean(self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

/// Connected sharp edges.
#[derive(Default)]
struct Component {
    edges: Vec<u32>,
    length: f64,
    /// Length of those that are sharp by themselves.
    strong: f64,
    /// Ascending.
    vertices: Vec<u32>,
    /// Vertices where it meets curves of other kinds, ascending.
    anchors: Vec<u32>,
}

impl Component {
    fn around(graph: &Graph, first: u32, seen: &mut [bool]) -> Self {
        let mut component = Self { edges: vec![first], ..Self::default() };
        seen[first as usize] = true;
        let mut next = 0;
        while next < component.edges.len() {
            let edge = component.edges[next];
            next += 1;
            component.length += graph.length(edge);
            if graph.edges[edge as usize].strong {
                component.strong += graph.length(edge);
            }
            for vertex in graph.edges[edge as usize].ends {
                component.vertices.push(vertex);
                for other in graph.curves_at(vertex) {
                    if !is_sharp(graph, other) {
                        component.anchors.push(vertex);
                    } else if !seen[other as usize] {
                        seen[other as usize] = true;
                        component.edges.push(other);
                    }
                }
            }
        }
        for list in [&mut component.vertices, &mut component.anchors] {
            list.sort_unstable();
            list.dedup();
        }
        component
    }

    /// The mean change of the angle from edge to edge along the chains over the mean angle. Bends, where
    /// other faces meet, are left out unless there is nothing else.
    fn roughness(&self, graph: &Graph, spacing: f64) -> f64 {
        let turn = |edge: u32| graph.edges[edge as usize].turn;
        let (mut inside, mut straight, mut bent) = (0, Mean::default(), Mean::default());
        for &vertex in &self.vertices {
            let mut edges = graph.curves_at(vertex);
            let (Some(one), Some(two)) = (edges.next(), edges.next()) else { continue };
            inside += 1;
            if edges.next().is_none() {
                let is_bend = bend(graph, vertex, spacing).is_some();
                let changes = if is_bend { &mut bent } else { &mut straight };
                changes.add((turn(one) - turn(two)).abs());
            }
        }
        let change = match straight.count {
            0 => bent.mean(),
            few => straight.mean() * (few as f64 / (ENOUGH_STRAIGHT * f64::from(inside))).min(1.0),
        };
        change * self.edges.len() as f64 / self.edges.iter().map(|&edge| turn(edge)).sum::<f64>()
    }

    fn is_too_short(&self, graph: &Graph, spacing: f64) -> bool {
        let is_flaw = |vertex: u32| match graph.degree(vertex) {
            1 => !ends_at_other(graph, vertex, spacing),
            _ => bend(graph, vertex, spacing).is_some(),
        };
        let roughness = self.roughness(graph, spacing);
        let is_even = roughness <= EVEN;
        // The rim of a small hole bends everywhere, and is no less a feature.
        let is_rim = is_even
            && self.edges.len() >= LEAST_EDGES_OF_RIM
            && self.length >= SHORTEST_RIM * spacing
            && self.vertices.iter().all(|&vertex| graph.degree(vertex) == 2);
        let flaws = if is_rim { 0 } else { self.vertices.iter().filter(|&&vertex| is_flaw(vertex)).count() };
        let is_branch =
            |vertex: u32| graph.curves_at(vertex).filter(|&edge| is_sharp(graph, edge)).count() > 2;
        let branches = self.vertices.iter().filter(|&&vertex| is_branch(vertex)).count();
        let mean_edge = self.length / self.edges.len() as f64;
        let per_flaw =
            if is_even && self.edges.len() >= LEAST_EDGES_OF_NET { PER_EVEN_FLAW } else { PER_FLAW };
        let least = |flaws: usize| SHORTEST + per_flaw * flaws as f64;
        let by_noise = least(flaws + branches) * ROUGH_EDGES * roughness * mean_edge;
        if flaws == 0 {
            // A closed loop, or a net of creases without a free end, such as that of a box.
            let shortest = least(branches.min(2)) * spacing;
            return (self.anchors.len() < 2 && self.length < shortest) || self.strong < by_noise;
        }
        self.strong < (least(flaws) * spacing).max(by_noise) || self.strong < STRONG * self.length
    }
}
