//! Curve edges joined into curves.

use super::curve::Curve;
use super::graph::Graph;

/// All curve edges as curves: open ones in the order of the corners they start from, then loops by their
/// first vertex. Lengths are in the frame of the graph.
pub(super) fn curves(graph: &Graph, corners: &[bool]) -> Vec<Curve> {
    let mut used = vec![false; graph.edges.len()];
    let mut curves = Vec::new();
    for at_corners in [true, false] {
        for vertex in 0..graph.points.len() as u32 {
            if graph.all_at(vertex).is_empty() || corners[vertex as usize] != at_corners {
                continue;
            }
            for edge in graph.curves_at(vertex) {
                if !used[edge as usize] {
                    curves.push(trace(graph, corners, &mut used, vertex, edge));
                }
            }
        }
    }
    curves
}

fn trace(graph: &Graph, corners: &[bool], used: &mut [bool], from: u32, first: u32) -> Curve {
    let mut curve =
        Curve { kind: graph.edges[first as usize].kind, vertices: vec![from], closed: false, length: 0.0 };
    let (mut at, mut by) = (from, first);
    loop {
        used[by as usize] = true;
        curve.length += graph.length(by);
        curve.kind = curve.kind.min(graph.edges[by as usize].kind);
        at = graph.edges[by as usize].other(at);
        if at == from && !corners[at as usize] {
            curve.closed = true;
            return curve;
        }
        curve.vertices.push(at);
        if corners[at as usize] {
            return curve;
        }
        let Some(next) = graph.onward(at, by) else { return curve };
        by = next;
    }
}
