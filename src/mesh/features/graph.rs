//! The edges that are or may become curves, as a graph over the surface's vertices.

use glam::DVec3;

use super::curve::CurveKind;
use crate::mesh::csr::Csr;

/// An edge of the surface that is a curve or may become one.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurveEdge {
    /// Its vertices.
    pub(super) ends: [u32; 2],
    /// Its first half-edge.
    pub(super) half: u32,
    pub(super) kind: CurveKind,
    /// Degrees by which the surface turns at the edge itself.
    pub(super) turn: f64,
    /// Degrees between the normals averaged over half a spacing on either side.
    pub(super) seen: f64,
    /// Whether it is on a curve.
    pub(super) on: bool,
    /// Whether it is sharp by itself, not as the continuation of a chain.
    pub(super) strong: bool,
}

impl CurveEdge {
    pub(super) fn fixed(ends: [u32; 2], half: u32, kind: CurveKind) -> Self {
        Self { ends, half, kind, turn: 180.0, seen: 180.0, on: true, strong: true }
    }

    /// The end that is not `vertex`.
    pub(super) fn other(&self, vertex: u32) -> u32 {
        if self.ends[0] == vertex { self.ends[1] } else { self.ends[0] }
    }
}

/// Curve edges and the vertices they join.
pub(super) struct Graph<'a> {
    pub(super) points: &'a [DVec3],
    pub(super) edges: Vec<CurveEdge>,
    /// The edges at each vertex, ascending.
    at: Csr,
}

impl<'a> Graph<'a> {
    pub(super) fn new(points: &'a [DVec3], edges: Vec<CurveEdge>) -> Self {
        let ends = (0..).zip(&edges).flat_map(|(number, edge)| edge.ends.map(|end| (end, number)));
        let at = Csr::group(points.len(), ends);
        Self { points, edges, at }
    }

    /// The edges at a vertex, curves or not.
    pub(super) fn all_at(&self, vertex: u32) -> &[u32] {
        self.at.of(vertex)
    }

    /// The curve edges at a vertex.
    pub(super) fn curves_at(&self, vertex: u32) -> impl Iterator<Item = u32> {
        self.all_at(vertex).iter().copied().filter(|&edge| self.edges[edge as usize].on)
    }

    /// How many curve edges end at a vertex.
    pub(super) fn degree(&self, vertex: u32) -> usize {
        self.curves_at(vertex).count()
    }

    pub(super) fn length(&self, edge: u32) -> f64 {
        let [a, b] = self.edges[edge as usize].ends.map(|v| self.points[v as usize]);
        a.distance(b)
    }

    /// The curve edge that continues from `edge` beyond `vertex`, if exactly one other is there.
    pub(super) fn onward(&self, vertex: u32, edge: u32) -> Option<u32> {
        let mut others = self.curves_at(vertex).filter(|&other| other != edge);
        others.next().filter(|_| others.next().is_none())
    }
}
