//! More vertices: the longest edges are halved.

use super::{Graph, ordered};
use std::collections::BinaryHeap;

pub(super) fn split(graph: &mut Graph, count: usize) {
    let length = |graph: &Graph, a: u32, b: u32| {
        let squared = graph.points[a as usize].distance_squared(graph.points[b as usize]);
        // Lengths are not negative, so their bits have their order.
        (squared.to_bits(), std::cmp::Reverse(ordered(a, b)))
    };
    let sides = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let mut edges: BinaryHeap<_> =
        graph.triangles.iter().flat_map(|t| sides(*t)).map(|(a, b)| length(graph, a, b)).collect();
    while graph.used < count {
        let Some((_, std::cmp::Reverse((a, b)))) = edges.pop() else { return };
        let at: Vec<u32> = graph.at_edge(a, b).collect();
        if at.is_empty() {
            continue;
        }
        let middle = graph.points.len() as u32;
        graph.points.push(0.5 * (graph.points[a as usize] + graph.points[b as usize]));
        graph.star.push(Vec::new());
        graph.fixed.push(false);
        graph.used += 1;
        for t in at {
            let old = graph.triangles[t as usize];
            let new = graph.triangles.len() as u32;
            graph.triangles[t as usize] = old.map(|v| if v == b { middle } else { v });
            graph.triangles.push(old.map(|v| if v == a { middle } else { v }));
            graph.alive.push(true);
            graph.origin.push(graph.origin[t as usize]);
            graph.star[b as usize].retain(|s| *s != t);
            for v in old.into_iter().filter(|v| *v != a) {
                graph.star[v as usize].push(new);
            }
            graph.star[middle as usize].extend([t, new]);
        }
        if graph.curves.remove(&ordered(a, b)) {
            graph.curves.extend([ordered(a, middle), ordered(b, middle)]);
        }
        for w in graph.neighbours(middle) {
            edges.push(length(graph, middle, w));
        }
    }
}
