//! Edge splits.

use std::cmp::Reverse;

use super::curve_edges::CurvePart;
use super::star_mesh::{Place, StarMesh};
use crate::mesh::polyline::Polyline;
use crate::polish::ConstrainedMesh;

/// An edge by its relative length. Lengths are not negative, so their bits have their order.
type Entry = (u64, Reverse<(u32, u32)>);

impl ConstrainedMesh {
    /// Puts a vertex into the middle of each of these edges, or of the part of a curve that it stands for.
    /// The new ones come last; vertices without triangles go. Panics if an index is out of range.
    pub fn split_edges(&mut self, edges: &[[u32; 2]]) {
        let polylines: Vec<Polyline> = self.sliding_curves.iter().map(|curve| curve.line.clone()).collect();
        let mut mesh = StarMesh::from_constrained(self);
        for [a, b] in edges {
            mesh.split_edge(*a, *b, &polylines);
        }
        *self = mesh.into_constrained(&polylines);
    }
}

impl StarMesh {
    /// Splits edges longer than `longest`, the longest first, up to `most` vertices.
    pub fn split_long(&mut self, longest: f64, most: usize, polylines: &[Polyline]) {
        self.split(longest, most, polylines);
    }

    /// Splits the longest edges until there are `count` vertices.
    pub fn split_to(&mut self, count: usize, polylines: &[Polyline]) {
        self.split(0.0, count, polylines);
    }

    fn split(&mut self, longest: f64, most: usize, polylines: &[Polyline]) {
        let entry = |mesh: &Self, a: u32, b: u32| -> Option<Entry> {
            let length = mesh.relative_length(a, b);
            (length > longest).then(|| (length.to_bits(), Reverse((a.min(b), a.max(b)))))
        };
        if self.used() >= most {
            return;
        }
        let mut edges = self.queue(entry);
        while self.used() < most {
            let Some((_, Reverse((a, b)))) = edges.pop() else { return };
            if !self.has_edge(a, b) {
                continue;
            }
            let middle = self.split_edge(a, b, polylines);
            for w in self.neighbours(middle) {
                entry(self, middle, w).into_iter().for_each(|entry| edges.push(entry));
            }
        }
    }

    /// Puts a vertex into the middle of an edge, or of the part of a curve that it stands for.
    pub fn split_edge(&mut self, a: u32, b: u32, polylines: &[Polyline]) -> u32 {
        let part = self.curves.remove(a, b);
        let size = self.size(a, b);
        let middle = match part {
            Some(CurvePart { curve, from, to }) => {
                let arc_length = 0.5 * (from + to);
                let at = polylines[curve as usize].at(arc_length).0;
                let middle = self.add_vertex(at, Place::Curve, size);
                self.curves.insert(a, middle, CurvePart { curve, from, to: arc_length });
                self.curves.insert(middle, b, CurvePart { curve, from: arc_length, to });
                middle
            }
            None => {
                let at = 0.5 * (self.points[a as usize] + self.points[b as usize]);
                self.add_vertex(at, Place::Inside, size)
            }
        };
        if let Some(map) = self.map_at([a, b]) {
            self.maps.push(map);
        }
        let triangles: Vec<u32> = self.at_edge(a, b).collect();
        for t in triangles.iter().copied() {
            let old = self.triangles[t as usize];
            let patch = self.patches[t as usize];
            self.replace(t, old.map(|v| if v == b { middle } else { v }));
            self.add_triangle(old.map(|v| if v == a { middle } else { v }), patch);
        }
        if self.samples.is_some() {
            let around = self.star[middle as usize].clone();
            self.pass_samples(&triangles, &around);
        }
        middle
    }
}
