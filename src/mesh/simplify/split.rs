//! Adds vertices by halving the longest edges.

use super::graph::Graph;
use crate::mesh::half_edges::edge_key;
use glam::DVec3;
use smallvec::SmallVec;
use std::collections::BinaryHeap;

pub(super) fn split(graph: &mut Graph, count: usize) {
    let length = |graph: &Graph, a: u32, b: u32| {
        let squared = graph.points[a as usize].distance_squared(graph.points[b as usize]);
        // Lengths are not negative, so their bits have their order.
        (squared.to_bits(), std::cmp::Reverse(edge_key(a, b)))
    };
    let sides = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let mut edges: BinaryHeap<_> =
        graph.triangles.iter().flat_map(|t| sides(*t)).map(|(a, b)| length(graph, a, b)).collect();
    while graph.used < count {
        let Some((_, std::cmp::Reverse((a, b)))) = edges.pop() else { return };
        if graph.at_edge(a, b).next().is_none() {
            continue;
        }
        let middle = split_edge(graph, a, b, 0.5 * (graph.points[a as usize] + graph.points[b as usize]));
        for w in graph.neighbours(middle) {
            edges.push(length(graph, middle, w));
        }
    }
}

/// A new vertex on an edge.
pub(super) fn split_edge(graph: &mut Graph, a: u32, b: u32, at: DVec3) -> u32 {
    let middle = graph.add_vertex(at);
    let triangles: Vec<u32> = graph.at_edge(a, b).collect();
    for t in triangles {
        let old = graph.triangles[t as usize];
        graph.triangles[t as usize] = old.map(|v| if v == b { middle } else { v });
        graph.star[b as usize].retain(|s| *s != t);
        graph.star[middle as usize].push(t);
        graph.add_triangle(old.map(|v| if v == a { middle } else { v }), graph.origin[t as usize]);
    }
    if graph.take_off_curve(a, b) {
        graph.add_to_curve(a, middle);
        graph.add_to_curve(b, middle);
    }
    middle
}

impl Graph {
    pub(super) fn add_vertex(&mut self, at: DVec3) -> u32 {
        self.points.push(at);
        self.star.push(SmallVec::new());
        self.along_curves.push(SmallVec::new());
        self.fixed.push(false);
        self.used += 1;
        self.points.len() as u32 - 1
    }

    pub(super) fn add_triangle(&mut self, triangle: [u32; 3], origin: u32) {
        let new = self.triangles.len() as u32;
        self.triangles.push(triangle);
        self.alive.push(true);
        self.origin.push(origin);
        triangle.iter().for_each(|v| self.star[*v as usize].push(new));
    }
}
