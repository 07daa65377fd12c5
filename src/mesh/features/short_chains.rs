//! Takes back what is too short to be a feature.

use super::corners::bend;
use super::graph::Graph;
use super::{CurveKind, Dropped};

/// Connected sharp edges are a crumb below so many spacings in all,
const SHORTEST: f64 = 2.0;
/// and as many more for each free end and each sharp bend: creases of parts end and bend where they meet
/// other creases, those of scans anywhere.
const PER_FLAW: f64 = 4.0;
/// Where the angle changes from edge to edge, a spacing counts as at least so many edges, times the mean
/// change's share of the mean angle: 0 to 0.1 on parts, 0.2 to 0.4 on scans. Noise is of the input's size,
/// however fine the output; it also makes chains branch.
const ROUGH_EDGES: f64 = 10.0;
/// At least this share of their length must be sharp by itself, if they have such flaws.
const STRONG: f64 = 0.5;
/// Chains of less than so many spacings with a free end are a twig.
const TWIG: f64 = 3.0;

/// Switches off twigs, then crumbs; lengths are in the frame of the graph.
pub(super) fn drop_short_chains(graph: &mut Graph, spacing: f64, dropped: &mut Dropped) {
    drop_twigs(graph, TWIG * spacing, dropped);
    drop_short(graph, spacing, dropped);
}

fn is_sharp(graph: &Graph, link: u32) -> bool {
    let link = &graph.links[link as usize];
    link.on && link.kind == CurveKind::Sharp
}

/// The chain from the free end `vertex` to the next vertex with more or fewer than two curve links, and its
/// length.
fn twig_at(graph: &Graph, vertex: u32) -> (Vec<u32>, u32, f64) {
    let (mut at, mut length, mut chain) = (vertex, 0.0, Vec::new());
    let mut next = graph.curves_at(vertex).next();
    while let Some(link) = next {
        if !is_sharp(graph, link) {
            break;
        }
        chain.push(link);
        length += graph.length(link);
        at = graph.links[link as usize].other(at);
        next = graph.onward(at, link);
    }
    (chain, at, length)
}

/// Shortest first, because what is left at the junction may then be one chain.
fn drop_twigs(graph: &mut Graph, shortest: f64, dropped: &mut Dropped) {
    loop {
        let mut twigs: Vec<(f64, u32)> = (0..graph.links.len() as u32)
            .filter(|&link| is_sharp(graph, link))
            .flat_map(|link| graph.links[link as usize].ends)
            .filter(|&vertex| graph.degree(vertex) == 1)
            .filter_map(|vertex| {
                let (_, at, length) = twig_at(graph, vertex);
                (length < shortest && graph.degree(at) > 2).then_some((length, vertex))
            })
            .collect();
        if twigs.is_empty() {
            return;
        }
        twigs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, vertex) in twigs {
            let (chain, at, length) = twig_at(graph, vertex);
            if length < shortest && graph.degree(at) > 2 {
                chain.iter().for_each(|&link| graph.links[link as usize].on = false);
                dropped.twigs += 1;
                dropped.twig_length += length;
            }
        }
    }
}

/// Judges connected sharp edges as a whole.
fn drop_short(graph: &mut Graph, spacing: f64, dropped: &mut Dropped) {
    let mut seen = vec![false; graph.links.len()];
    for first in 0..graph.links.len() as u32 {
        if seen[first as usize] || !is_sharp(graph, first) {
            continue;
        }
        let part = Part::around(graph, first, &mut seen);
        if part.is_crumb(graph, spacing) {
            part.links.iter().for_each(|&link| graph.links[link as usize].on = false);
            dropped.short_chains += 1;
            dropped.short_length += part.length;
        }
    }
}

/// Connected sharp edges.
#[derive(Default)]
struct Part {
    links: Vec<u32>,
    length: f64,
    /// Length of those that are sharp by themselves.
    strong: f64,
    /// Rising.
    vertices: Vec<u32>,
    /// Vertices where it meets curves of other kinds, rising.
    anchors: Vec<u32>,
}

impl Part {
    fn around(graph: &Graph, first: u32, seen: &mut [bool]) -> Self {
        let mut part = Self { links: vec![first], ..Self::default() };
        seen[first as usize] = true;
        let mut next = 0;
        while next < part.links.len() {
            let link = part.links[next];
            next += 1;
            part.length += graph.length(link);
            if graph.links[link as usize].strong {
                part.strong += graph.length(link);
            }
            for vertex in graph.links[link as usize].ends {
                part.vertices.push(vertex);
                for other in graph.curves_at(vertex) {
                    if !is_sharp(graph, other) {
                        part.anchors.push(vertex);
                    } else if !seen[other as usize] {
                        seen[other as usize] = true;
                        part.links.push(other);
                    }
                }
            }
        }
        for list in [&mut part.vertices, &mut part.anchors] {
            list.sort_unstable();
            list.dedup();
        }
        part
    }

    /// The mean change of the angle from edge to edge along the chains over the mean angle.
    fn roughness(&self, graph: &Graph) -> f64 {
        let turn = |link: u32| graph.links[link as usize].turn;
        let (mut changes, mut count) = (0.0, 0);
        for &vertex in &self.vertices {
            let mut links = graph.curves_at(vertex);
            if let (Some(one), Some(two), None) = (links.next(), links.next(), links.next()) {
                changes += (turn(one) - turn(two)).abs();
                count += 1;
            }
        }
        let mean = self.links.iter().map(|&link| turn(link)).sum::<f64>() / self.links.len() as f64;
        if count == 0 { 0.0 } else { changes / f64::from(count) / mean }
    }

    fn is_crumb(&self, graph: &Graph, spacing: f64) -> bool {
        let is_flaw = |vertex: u32| graph.degree(vertex) == 1 || bend(graph, vertex, spacing).is_some();
        let flaws = self.vertices.iter().filter(|&&vertex| is_flaw(vertex)).count();
        let is_branch =
            |vertex: u32| graph.curves_at(vertex).filter(|&link| is_sharp(graph, link)).count() > 2;
        let branches = self.vertices.iter().filter(|&&vertex| is_branch(vertex)).count();
        let edge = self.length / self.links.len() as f64;
        let least = |flaws: usize| SHORTEST + PER_FLAW * flaws as f64;
        let by_noise = least(flaws + branches) * ROUGH_EDGES * self.roughness(graph) * edge;
        if flaws == 0 {
            // A rim, or a net of creases without a loose end, such as a box.
            let shortest = least(branches.min(2)) * spacing;
            return (self.anchors.len() < 2 && self.length < shortest) || self.strong < by_noise;
        }
        self.strong < (least(flaws) * spacing).max(by_noise) || self.strong < STRONG * self.length
    }
}
