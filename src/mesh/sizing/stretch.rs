//! Edges that are longer one way than the other: long where the surface bends least, short across.
//!
//! At a vertex, edges along `across` are to be `short`, and all edges at right angles to it `long`. A linear
//! map shrinks them to length 1: what is even in its image is stretched on the surface. With lengths
//! inversely proportional to the roots of the principal curvatures, triangles deviate equally far everywhere
//! (d'Azevedo and Simpson 1991).

use super::curvature::Bend;
use super::graded::Edges;
use crate::TriMesh;
use crate::mesh::triangle::doubled_normal;
use glam::{DMat3, DVec3};

/// Curvature below this times the inverse of the longest edge counts as that: an edge bends by less over its
/// length than can be seen.
const FLAT: f64 = 0.01;
/// Relative error of the number of vertices at which the scale is good enough: local operations scale all
/// lengths alike.
const CLOSE: f64 = 0.02;
/// Maximum number of bisection steps to find the scale.
const TRIES: u32 = 40;

/// Limits of the two lengths, in the unit of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StretchBounds {
    /// Shortest length.
    pub least: f64,
    /// Longest length.
    pub largest: f64,
    /// Largest quotient of the two lengths at a vertex, 1 or more.
    pub aspect: f64,
    /// Largest growth of each length per unit of distance along the surface, above 0.
    pub growth: f64,
}

impl StretchBounds {
    /// The curvature, or the least one that can be seen.
    fn visible(&self, curvature: f64) -> f64 {
        curvature.max(FLAT / self.largest)
    }
}

/// The two lengths that edges are to have at each vertex of a surface, and the direction of the short ones.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StretchField {
    /// Of length 1.
    pub across: Vec<DVec3>,
    /// Lengths along `across`.
    pub short: Vec<f64>,
    /// Lengths at right angles to it; at least the short ones.
    pub long: Vec<f64>,
}

impl StretchField {
    /// By curvature, for this number of vertices as far as the bounds allow. Panics if there are fewer
    /// `bends` than vertices.
    pub fn for_vertices(surface: &TriMesh, bends: &[Bend], bounds: &StretchBounds, count: f64) -> Self {
        let edges = Edges::new(surface);
        let (mut low, mut high) = (1e-6 * bounds.least.sqrt(), 1e3 * bounds.largest.sqrt());
        let mut tries = 0;
        loop {
            let scale = (low * high).sqrt();
            let length =
                |bend: &Bend| (scale / bounds.visible(bend.most).sqrt()).clamp(bounds.least, bounds.largest);
            let short = edges.limited(bends.iter().map(length).collect(), bounds.growth);
            let field = Self::stretched(&edges, bends, short, bounds);
            let ratio = field.vertices(surface) / count;
            tries += 1;
            if (ratio - 1.0).abs() < CLOSE || tries == TRIES {
                return field;
            }
            if ratio > 1.0 { low = scale } else { high = scale }
        }
    }

    /// With these short lengths. Panics if a list is too short.
    pub fn with_short(surface: &TriMesh, bends: &[Bend], short: Vec<f64>, bounds: &StretchBounds) -> Self {
        Self::stretched(&Edges::new(surface), bends, short, bounds)
    }

    fn stretched(edges: &Edges, bends: &[Bend], short: Vec<f64>, bounds: &StretchBounds) -> Self {
        let longest = |(bend, short): (&Bend, &f64)| {
            let quotient = (bounds.visible(bend.most) / bounds.visible(bend.least)).sqrt();
            (short * quotient.min(bounds.aspect)).min(bounds.largest)
        };
        let mut long = edges.limited(bends.iter().zip(&short).map(longest).collect(), bounds.growth);
        for (long, short) in long.iter_mut().zip(&short) {
            *long = long.max(*short);
        }
        Self { across: bends.iter().map(|bend| bend.across).collect(), short, long }
    }

    /// For each vertex the map that makes such edges 1 long.
    pub fn maps(&self) -> Vec<DMat3> {
        let all = self.across.iter().zip(&self.short).zip(&self.long);
        all.map(|((across, short), long)| {
            let more = (1.0 / short - 1.0 / long) * *across;
            DMat3::from_diagonal(DVec3::splat(1.0 / long))
                + DMat3::from_cols(*across * more.x, *across * more.y, *across * more.z)
        })
        .collect()
    }

    /// The smallest and the largest length of all.
    pub fn range(&self) -> [f64; 2] {
        let least = self.short.iter().copied().fold(f64::INFINITY, f64::min);
        [least, self.long.iter().copied().fold(0.0, f64::max)]
    }

    /// About how many vertices a mesh of `surface` with such edges has.
    pub fn vertices(&self, surface: &TriMesh) -> f64 {
        mapped_area(surface, &self.maps()) * 2.0 / 3f64.sqrt()
    }
}

/// The area of a surface in the image of `maps` at its vertices: proportional to the number of vertices.
pub fn mapped_area(surface: &TriMesh, maps: &[DMat3]) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = surface.triangles[t].map(|v| maps[v as usize]);
        let map = (a + b + c) * (1.0 / 3.0);
        0.5 * doubled_normal(surface.corners(t).map(|p| map * p)).length()
    };
    (0..surface.triangles.len()).map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use crate::mesh::sizing::bends;

    fn bounds(surface: &TriMesh, count: usize, aspect: f64) -> StretchBounds {
        let spacing = crate::mesh::spacing(surface.area(), count);
        StretchBounds { least: spacing / 8.0, largest: 8.0 * spacing, aspect, growth: 0.25 }
    }

    #[test]
    fn maps_make_such_edges_one_long() {
        let across = DVec3::new(1.0, 2.0, 2.0) / 3.0;
        let field = StretchField { across: vec![across], short: vec![0.5], long: vec![2.0] };
        let [map] = field.maps()[..] else { panic!() };
        assert!(((map * (0.5 * across)).length() - 1.0).abs() < 1e-12);
        let (u, w) = across.any_orthonormal_pair();
        [u, w].iter().for_each(|d| assert!(((map * (2.0 * *d)).length() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_field_has_the_number_of_vertices_and_keeps_to_its_bounds() {
        for (name, aspect) in
            [("torus", 1.0), ("torus", 3.0), ("torus", 8.0), ("box", 8.0), ("open-hemisphere", 5.0)]
        {
            let surface = sample(name).unwrap();
            let bounds = bounds(&surface, 1500, aspect);
            let field = StretchField::for_vertices(&surface, &bends(&surface, &[], 0.1), &bounds, 1500.0);
            let count = field.vertices(&surface);
            assert!((count / 1500.0 - 1.0).abs() < 1.01 * CLOSE, "{name}, {aspect}: {count}");
            for (short, long) in field.short.iter().zip(&field.long) {
                assert!(*short >= bounds.least * 0.999 && *long <= bounds.largest * 1.001);
                assert!(long >= short && *long <= aspect * short * 1.001, "{name}: {short} {long}");
            }
            for [v, w] in surface.triangles.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]) {
                let [v, w] = [*v as usize, *w as usize];
                let most = bounds.growth * surface.vertices[v].distance(surface.vertices[w]) + 1e-12;
                assert!((field.long[v] - field.long[w]).abs() <= most, "{name}, {aspect}");
                assert!((field.short[v] - field.short[w]).abs() <= most, "{name}, {aspect}");
            }
        }
    }

    /// Around the tube of a torus edges are shorter than along it, by the root of the quotient of curvatures.
    #[test]
    fn a_torus_is_stretched_along_its_tube() {
        let surface = sample("torus").unwrap();
        let bounds = bounds(&surface, 1500, 8.0);
        let bends = bends(&surface, &[], 0.01);
        let field = StretchField::for_vertices(&surface, &bends, &bounds, 1500.0);
        let mean = field.long.iter().zip(&field.short).map(|(l, s)| l / s).sum::<f64>()
            / surface.vertices.len() as f64;
        assert!(mean > 1.3, "{mean}");
        let even =
            StretchField::for_vertices(&surface, &bends, &StretchBounds { aspect: 1.0, ..bounds }, 1500.0);
        let least = |field: &StretchField| field.short.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least(&field) < least(&even));
    }
}
