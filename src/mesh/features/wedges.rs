//! Takes back edges beside others from where both meet at an acute angle: until they are far enough apart,
//! every triangle between them would be a sliver.

use glam::DVec3;

use super::corners::bend;
use super::graph::Graph;
use super::strips::{NARROW, PLATE, length, mean_turn};
use super::surface::Sides;
use super::{CurveKind, Dropped};

/// Two sharp edges are a wedge if they need more than so many spacings to get as far apart as the sides of a
/// strip are: below 14 degrees, if they are straight.
const LONG: f64 = 1.0;

/// Sharp links in a row from a vertex to where curves meet or end, or back.
struct Chain {
    links: Vec<u32>,
    /// The vertex first.
    points: Vec<DVec3>,
}

impl Chain {
    fn new(graph: &Graph, vertex: u32, first: u32) -> Self {
        let point = |v: u32| graph.points[v as usize];
        let mut chain = Self { links: Vec::new(), points: vec![point(vertex)] };
        let (mut at, mut next) = (vertex, Some(first));
        while let Some(link) = next.filter(|link| graph.links[*link as usize].kind == CurveKind::Sharp) {
            at = graph.links[link as usize].other(at);
            chain.links.push(link);
            chain.points.push(point(at));
            next = graph.onward(at, link).filter(|_| at != vertex);
        }
        chain
    }

    fn halve(&mut self) {
        let links = self.links.len() / 2;
        self.links.truncate(links);
        self.points.truncate(links + 1);
    }

    /// The links from the vertex on to where it is nearer to the other chain than `width` for the last time
    /// before it is twice as far, and nearer on average.
    fn beside(&self, other: &Self, width: f64) -> &[u32] {
        let (mut gone, mut sum) = (0.0, 0.0);
        let mut near = 0;
        for (k, ends) in self.points.windows(2).enumerate() {
            let length = ends[0].distance(ends[1]);
            gone += length;
            // Farther along the other one is farther away, but for one that comes back.
            let distance = other.distance(ends[1], 2.0 * gone + width);
            sum += length * distance;
            if distance > 2.0 * width {
                break;
            }
            if distance.max(sum / gone) <= width {
                near = k + 1;
            }
        }
        &self.links[..near]
    }

    /// How far a point is from what the chain is up to `until` along it.
    fn distance(&self, from: DVec3, until: f64) -> f64 {
        let mut gone = 0.0;
        let mut least = f64::INFINITY;
        for ends in self.points.windows(2) {
            let way = ends[1] - ends[0];
            let along = (from - ends[0]).dot(way) / way.length_squared();
            least = least.min(from.distance(ends[0] + along.clamp(0.0, 1.0) * way));
            gone += way.length();
            if gone > until {
                break;
            }
        }
        least
    }
}

/// Switches off the weaker sides of wedges as far as they are narrow; lengths are in the frame of the graph.
pub(super) fn drop_wedges(graph: &mut Graph, sides: &Sides, spacing: f64, dropped: &mut Dropped) {
    for vertex in 0..graph.points.len() as u32 {
        if graph.all_at(vertex).len() < 2 {
            continue;
        }
        while let Some(links) = wedge_at(graph, sides, vertex, spacing) {
            dropped.strips += 1;
            dropped.strip_length += length(graph, &links);
            links.iter().for_each(|link| graph.links[*link as usize].on = false);
        }
    }
}

/// What the first wedge at a vertex can do without.
fn wedge_at(graph: &Graph, sides: &Sides, vertex: u32, spacing: f64) -> Option<Vec<u32>> {
    let is_sharp = |link: &u32| graph.links[*link as usize].kind == CurveKind::Sharp;
    let first: Vec<u32> = graph.curves_at(vertex).filter(is_sharp).collect();
    // Most vertices have a curve that goes straight on.
    if first.len() < 2 || (graph.degree(vertex) == 2 && bend(graph, vertex, spacing).is_none()) {
        return None;
    }
    let mut chains: Vec<Chain> = first.iter().map(|link| Chain::new(graph, vertex, *link)).collect();
    // Both ways around a loop, each to the middle.
    chains.iter_mut().filter(|chain| chain.points.last() == chain.points.first()).for_each(Chain::halve);
    let pairs = (0..chains.len()).flat_map(|k| (0..k).map(move |m| [m, k]));
    pairs.map(|pair| pair.map(|k| &chains[k])).find_map(|[one, other]| {
        let parts = [one.beside(other, NARROW * spacing), other.beside(one, NARROW * spacing)];
        if parts.iter().any(|part| length(graph, part) <= LONG * spacing) {
            return None;
        }
        let turns = parts.map(|part| mean_turn(graph, part));
        let down = parts.map(|part| sides.turns_down(graph.points, graph.links[part[0] as usize].half));
        let is_plate = down[0] == down[1] && turns[0] + turns[1] >= PLATE;
        (!is_plate).then(|| parts[usize::from(turns[1] < turns[0])].to_vec())
    })
}
