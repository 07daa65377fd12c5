//! The edges of a mesh that lie on curves, each with the part of the curve that it stands for.

use crate::mesh::half_edges::edge_key;
use crate::mesh::polyline::Polyline;
use crate::mesh::quick_hash::QuickMap;

/// A part of a curve from one vertex to another. On a closed curve arc lengths may lie beyond its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CurvePart {
    pub curve: u32,
    pub from: f64,
    pub to: f64,
}

impl CurvePart {
    fn reversed(self) -> Self {
        Self { from: self.to, to: self.from, ..self }
    }

    /// The largest distance of the curve from its chord.
    pub fn deviation(self, polylines: &[Polyline]) -> f64 {
        let line = &polylines[self.curve as usize];
        let (from, to) = (self.from.min(self.to), self.from.max(self.to));
        // Arc lengths beyond the ends may lie one turn away at most.
        let turns = if line.is_closed() { (from / line.length()).floor() * line.length() } else { 0.0 };
        line.deviation(from - turns, to - turns)
    }
}

/// Curve edges by their vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct CurveEdges(QuickMap<(u32, u32), CurvePart>);

impl CurveEdges {
    pub fn contains(&self, a: u32, b: u32) -> bool {
        !self.0.is_empty() && self.0.contains_key(&edge_key(a, b))
    }

    /// All edges by curve, in order along each.
    pub fn by_curve(&self, curves: usize) -> Vec<Vec<(u32, u32, CurvePart)>> {
        let mut list = vec![Vec::new(); curves];
        for ((a, b), part) in &self.0 {
            list[part.curve as usize].push((*a, *b, *part));
        }
        for edges in &mut list {
            let start = |part: &CurvePart| part.from.min(part.to);
            edges.sort_by(|(a, b, p), (c, d, q)| start(p).total_cmp(&start(q)).then((a, b).cmp(&(c, d))));
        }
        list
    }

    /// The part of a curve from `a` to `b`, if their edge is on one.
    pub fn get(&self, a: u32, b: u32) -> Option<CurvePart> {
        let part = *self.0.get(&edge_key(a, b))?;
        Some(if a < b { part } else { part.reversed() })
    }

    /// Makes the edge from `a` to `b` stand for a part of a curve.
    pub fn insert(&mut self, a: u32, b: u32, part: CurvePart) {
        self.0.insert(edge_key(a, b), if a < b { part } else { part.reversed() });
    }

    pub fn remove(&mut self, a: u32, b: u32) -> Option<CurvePart> {
        let part = self.0.remove(&edge_key(a, b))?;
        Some(if a < b { part } else { part.reversed() })
    }
}
