//! Edge lengths for a largest deviation: from the curvature at first, then from what was measured.

use std::collections::HashSet;

use super::measured::Measured;
use crate::TriMesh;
use crate::mesh::features::{FeatureOptions, find_features};
use crate::mesh::half_edges::{EdgeSet, EdgeTable, edge_key};
use crate::mesh::sizing::{Bend, StretchBounds, StretchField, bends, curvature, grown, vertices_with};
use crate::options::Options;

/// Share of the largest deviation that is aimed at, since chance exceeds it here and there.
const AIM: f64 = 0.85;
/// Smallest factor by which a length changes from one run to the next.
const LEAST_CHANGE: f64 = 0.6;
/// Largest factor by which a length changes from one of the first [`EARLY`] runs to the next.
const MOST_CHANGE: f64 = 1.35;
/// Largest factor by which a length changes after the first [`EARLY`] runs: with a larger one, lengths would
/// go up and down.
const LATER_CHANGE: f64 = 1.1;
/// Number of runs after which [`LATER_CHANGE`] limits the growth of lengths.
const EARLY: u32 = 3;
/// Minimum change where a number of vertices is estimated.
const LEAST_ESTIMATED: f64 = 0.02;
/// Shortest edges, in deviations: shorter ones follow noise alone.
const SHORTEST: f64 = 1.0;
/// Longest edges, in diagonals.
pub(crate) const LONGEST: f64 = 0.1;
/// Bisection steps to find lengths for a number of vertices.
const TRIES: u32 = 20;

/// The edge lengths at the vertices of a surface in the unit-diagonal frame.
pub(super) struct Lengths<'a> {
    surface: &'a TriMesh,
    growth: f64,
    /// Of the lengths.
    range: [f64; 2],
    /// The largest deviation.
    most: f64,
    pub values: Vec<f64>,
    /// How the surface bends, and the largest quotient of two lengths at a place, if they depend on the
    /// direction: then `values` are the short ones.
    stretch: Option<(Vec<Bend>, f64)>,
}

impl<'a> Lengths<'a> {
    /// Lengths for the sagitta of the surface's [`curvature`]. `most` is the largest deviation, in diagonals;
    /// so are the least and the largest length, as far as they are given.
    pub fn new(surface: &'a TriMesh, most: f64, given: [Option<f64>; 2], options: &Options) -> Self {
        let least = given[0].unwrap_or((SHORTEST * most).min(given[1].unwrap_or(LONGEST)));
        let range = [least, given[1].unwrap_or(LONGEST).max(least)];
        // Curvature counts over the edges of a ball that has them as long as its radius.
        let scale = (8.0 * most).clamp(range[0], range[1]);
        let on_curve = on_curve(surface, scale, options.coarse_to_fine.feature_angle);
        let length = |curvature: f64| (8.0 * AIM * most / curvature.max(f64::MIN_POSITIVE)).sqrt();
        let aspect = options.coarse_to_fine.sizing.aspect();
        let stretch = aspect.map(|aspect| (bends(surface, &on_curve, scale), aspect));
        let values = match &stretch {
            Some((bends, _)) => bends.iter().map(|bend| length(bend.most)).collect(),
            None => curvature(surface, &on_curve, scale).into_iter().map(length).collect(),
        };
        let growth = options.coarse_to_fine.growth;
        let mut lengths = Self { surface, growth, range, most, values: Vec::new(), stretch };
        lengths.values = lengths.clamp(values);
        lengths
    }

    /// As many vertices as these lengths take.
    pub fn vertices(&self) -> f64 {
        self.count(&self.values)
    }

    /// As many vertices as such lengths take.
    fn count(&self, values: &[f64]) -> f64 {
        let Some((bends, aspect)) = &self.stretch else { return vertices_with(self.surface, values) };
        let [least, largest] = self.range;
        let bounds = StretchBounds { least, largest, aspect: *aspect, growth: self.growth };
        StretchField::with_short(self.surface, bends, values.to_vec(), &bounds).vertices(self.surface)
    }

    /// The least length.
    pub fn least(&self) -> f64 {
        self.range[0]
    }

    /// Shortens edges where the mesh that they led to is too far away, and lengthens them where it is closer
    /// than need be: as much as it takes, or as a number of `vertices` other than 0 allows.
    pub fn follow(&mut self, mesh: &TriMesh, measured: &Measured, round: u32, vertices: usize) {
        let most_change = if round < EARLY { MOST_CHANGE } else { LATER_CHANGE };
        let near = measured.near_vertices(mesh);
        let at = |aim: f64| self.changed(&near, aim * self.most, [LEAST_CHANGE, most_change]);
        self.values = if vertices == 0 { at(AIM) } else { self.bisect(vertices, at) };
    }

    /// Lengths in the same proportions, as far as the range and the growth allow, for a number of vertices.
    pub fn scale_to(&mut self, vertices: usize) {
        let at = |scale: f64| self.clamp(self.values.iter().map(|length| scale * length).collect());
        self.values = self.bisect(vertices, at);
    }

    /// The shortest of the lengths `at` a number, with which they grow, that take at most `vertices`.
    fn bisect(&self, vertices: usize, at: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
        let (mut low, mut high) = (1e-3f64, 1e3f64);
        for _ in 0..TRIES {
            let middle = (low * high).sqrt();
            if self.count(&at(middle)) > vertices as f64 {
                low = middle;
            } else {
                high = middle;
            }
        }
        at(high)
    }

    /// About how many vertices would be enough, after a mesh with these lengths was measured.
    pub fn enough(&self, mesh: &TriMesh, measured: &Measured) -> f64 {
        let near = measured.near_vertices(mesh);
        self.count(&self.changed(&near, AIM * self.most, [LEAST_ESTIMATED, MOST_CHANGE]))
    }

    fn changed(&self, near: &[f64], aim: f64, [least, most]: [f64; 2]) -> Vec<f64> {
        let change = |(length, distance): (&f64, &f64)| {
            length * (aim / distance.max(f64::MIN_POSITIVE)).sqrt().clamp(least, most)
        };
        self.clamp(self.values.iter().zip(near).map(change).collect())
    }

    fn clamp(&self, mut values: Vec<f64>) -> Vec<f64> {
        let [least, largest] = self.range;
        values.iter_mut().for_each(|length| *length = length.clamp(least, largest));
        grown(self.surface, values, self.growth)
    }
}

/// For each half-edge of a surface whether it is on a curve, where no bend counts.
fn on_curve(surface: &TriMesh, spacing: f64, feature_angle: f64) -> Vec<bool> {
    let options = FeatureOptions { feature_angle, ..FeatureOptions::new(spacing) };
    let Ok(features) = find_features(surface, &options) else { return Vec::new() };
    let ends = features.curves.iter().flat_map(|curve| curve.edge_ends());
    let curves: EdgeSet = ends.map(|[a, b]| edge_key(a, b)).collect::<HashSet<_>>();
    let mut on_curve = vec![false; 3 * surface.triangles.len()];
    for side in EdgeTable::new(&surface.triangles).edges().flatten() {
        on_curve[side.corners().0] = curves.contains(&side.ends());
    }
    on_curve
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::pipeline::deviation::measured::Farthest;

    /// The largest deviation, and the radius of the sphere.
    const MOST: f64 = 0.001;
    const RADIUS: f64 = 0.3;

    fn sphere() -> TriMesh {
        let mut mesh = sample("sphere").unwrap();
        mesh.vertices.iter_mut().for_each(|p| *p *= RADIUS / p.length());
        mesh
    }

    fn lengths(surface: &TriMesh) -> Lengths<'_> {
        Lengths::new(surface, MOST, [None; 2], &Options::new(0))
    }

    /// The lengths after a mesh was measured with every face this far away.
    fn followed(surface: &TriMesh, distance: f64, round: u32, vertices: usize) -> Vec<f64> {
        let farthest = Farthest { distance, ..Farthest::default() };
        let of_face = vec![farthest; surface.triangles.len()];
        let measured = Measured { of_face, nearest_face: vec![0; surface.vertices.len()] };
        let mut lengths = lengths(surface);
        lengths.follow(surface, &measured, round, vertices);
        lengths.values
    }

    fn are_near(values: &[f64], expected: f64, share: f64) {
        assert!(!values.is_empty());
        for value in values {
            assert!((value / expected - 1.0).abs() < share, "{value} instead of {expected}");
        }
    }

    #[test]
    fn the_first_lengths_are_those_of_the_sagitta() {
        let surface = sphere();
        // A sphere bends both ways.
        let curvature = 2f64.sqrt() / RADIUS;
        let expected = (8.0 * AIM * MOST / curvature).sqrt();
        are_near(&lengths(&surface).values, expected, 0.1);
    }

    #[test]
    fn they_follow_the_root_of_what_was_measured_within_limits() {
        let surface = sphere();
        let before = lengths(&surface).values;
        let cases = [
            (AIM * MOST, 0, 1.0),
            (1.44 * AIM * MOST, 0, 1.0 / 1.2),
            (4.0 * MOST, 0, LEAST_CHANGE),
            (0.01 * MOST, 0, MOST_CHANGE),
            (0.01 * MOST, EARLY, LATER_CHANGE),
        ];
        for (distance, round, change) in cases {
            let after = followed(&surface, distance, round, 0);
            let changes: Vec<f64> = after.iter().zip(&before).map(|(new, old)| new / old).collect();
            are_near(&changes, change, 1e-9);
        }
    }

    #[test]
    fn a_number_of_vertices_is_kept() {
        let surface = sphere();
        for vertices in [500, 3000] {
            let mut scaled = lengths(&surface);
            scaled.scale_to(vertices);
            assert!((scaled.vertices() / vertices as f64 - 1.0).abs() < 0.01);
        }
        let before = lengths(&surface).vertices();
        let after = followed(&surface, 4.0 * MOST, 0, before as usize);
        assert!((vertices_with(&surface, &after) / before - 1.0).abs() < 0.01);
    }
}
