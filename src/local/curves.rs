//! As many vertices on each curve as its length asks for.

use std::collections::HashSet;

use super::collapse::Limits;
use super::curve_edges::CurvePart;
use super::star_mesh::StarMesh;
use crate::mesh::polyline::Polyline;

/// Passes over the edges of a curve; in one, no vertex takes part in two collapses.
const PASSES: u32 = 3;

impl StarMesh {
    /// Splits the longest and collapses the shortest edges of each curve until they are `length` long on
    /// average, as nearly as whole numbers can be. Splits end at `most` vertices in all: where curves make up
    /// more than the surface, as around needles, there is no such length.
    pub fn space_curves(&mut self, length: f64, most: usize, polylines: &[Polyline]) {
        for _ in 0..PASSES {
            let mut changes = 0;
            for edges in self.curves.by_curve(polylines.len()) {
                changes += self.space_curve(edges, length, most, polylines);
            }
            if changes == 0 {
                return;
            }
        }
    }

    fn space_curve(
        &mut self,
        edges: Vec<(u32, u32, CurvePart)>,
        length: f64,
        most: usize,
        polylines: &[Polyline],
    ) -> usize {
        let mut edges: Vec<(f64, u32, u32)> = edges
            .into_iter()
            .map(|(a, b, part)| ((part.to - part.from).abs() / self.size_along(a, b), a, b))
            .collect();
        let total: f64 = edges.iter().map(|edge| edge.0).sum();
        let wanted = ((total / length).round() as usize).max(1);
        edges.sort_by(|p, q| p.0.total_cmp(&q.0).then((p.1, p.2).cmp(&(q.1, q.2))));
        if edges.len() < wanted {
            let more = (wanted - edges.len()).min(most.saturating_sub(self.used()));
            let more = edges.iter().rev().take(more);
            return more.map(|(_, a, b)| self.split_edge(*a, *b, polylines)).count();
        }
        let limits = Limits::on_curves(length);
        let mut touched = HashSet::new();
        let mut left = edges.len() - wanted;
        let mut changes = 0;
        for (_, a, b) in edges {
            if left == 0 {
                break;
            }
            if touched.contains(&a) || touched.contains(&b) {
                continue;
            }
            if let Some(kept) = self.collapse_edge(a, b, &limits, polylines) {
                touched.extend([a, b]);
                touched.extend(self.neighbours(kept));
                left -= 1;
                changes += 1;
            }
        }
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local::polylines;
    use crate::mesh::features::{FeatureOptions, find_features};
    use crate::mesh::samples::sample;

    #[test]
    fn splits_end_at_the_largest_number_of_vertices() {
        let surface = sample("box").unwrap();
        let features = find_features(&surface, &FeatureOptions::new(0.3)).unwrap();
        let lines = polylines(&surface, &features);
        let made = |length: f64, most: usize| {
            let mut mesh = StarMesh::new(&surface, &features, &lines, &[]);
            mesh.space_curves(length, most, &lines);
            mesh.used()
        };
        let before = surface.vertices.len();
        assert_eq!([made(1e-6, before), made(1e-6, before + 50)], [before, before + 50]);
        assert!((before + 50..1000).contains(&made(0.05, 1000)), "{}", made(0.05, 1000));
    }
}
