//! How long edges should be where: a field over a surface, from its curvature or from numbers at its
//! vertices.
//!
//! Lengths are relative to the edges of a uniform mesh with as many vertices, the *spacing*. A field is
//! scaled so that as many vertices cover the surface as in that mesh: the mean of 1 / length² over the area
//! is 1.

mod curvature;
mod graded;
mod stretch;

pub use curvature::{Bend, along_curve, bends, curvature};
pub use graded::{Bounds, Graded, graded, grown, vertices_with};
pub use stretch::{StretchBounds, StretchField, mapped_area};

use super::triangle::{closest_on_triangle, doubled_normal};
use crate::TriMesh;
use glam::DVec3;

/// Lengths at the ends of an edge count as equal if their relative difference is below this.
pub(crate) const EVEN: f64 = 1e-6;
/// Lengths at the corners of a triangle count as equal if their relative difference is below this.
const ALIKE: f64 = 1e-3;

/// Relative target edge lengths over a surface, linear in its triangles. 1 is the spacing.
#[derive(Debug, Clone, Default)]
pub struct SizeField {
    surface: TriMesh,
    /// One a vertex; empty if edges are equally long everywhere.
    lengths: Vec<f64>,
}

impl SizeField {
    /// Linear in the triangles of `surface` between `lengths` at its vertices, all above 0, then scaled so
    /// that the mean of 1 / length² over the area is 1. Panics if there are fewer lengths than vertices.
    pub fn new(surface: TriMesh, lengths: Vec<f64>) -> Self {
        let mut field = Self { surface, lengths };
        let (mut density, mut area) = (0.0, 0.0);
        for t in 0..field.surface.triangles.len() {
            let of_triangle = field.surface.triangle_area(t);
            area += of_triangle;
            density += of_triangle * field.density(t);
        }
        if area > 0.0 {
            let scale = (density / area).sqrt();
            field.lengths.iter_mut().for_each(|length| *length *= scale);
        }
        field
    }

    /// With lengths no longer than these at some vertices of `surface`, which is that of the field, and than
    /// what grows from them by `growth` per unit of distance; in the unit of the surface, like `spacing`.
    #[must_use]
    pub fn shortened(self, surface: &TriMesh, at: &[(u32, f64)], growth: f64, spacing: f64) -> Self {
        if at.is_empty() {
            return self;
        }
        let mut lengths: Vec<f64> =
            (0..surface.vertices.len() as u32).map(|v| spacing * self.at_vertex(v)).collect();
        for (v, length) in at {
            lengths[*v as usize] = lengths[*v as usize].min(*length);
        }
        Self::new(surface.clone(), grown(surface, lengths, growth))
    }

    /// Whether edges are equally long everywhere.
    pub fn is_uniform(&self) -> bool {
        self.lengths.is_empty()
    }

    /// The length at a point on or near a triangle.
    pub fn at(&self, point: DVec3, triangle: u32) -> f64 {
        if self.is_uniform() {
            return 1.0;
        }
        let closest = closest_on_triangle(point, self.surface.corners(triangle as usize));
        let corners = self.surface.triangles[triangle as usize];
        corners.iter().zip(closest.barycentric).map(|(v, weight)| weight * self.lengths[*v as usize]).sum()
    }

    /// The length at a vertex of the surface.
    pub fn at_vertex(&self, v: u32) -> f64 {
        self.lengths.get(v as usize).copied().unwrap_or(1.0)
    }

    /// The lengths at the corners of a triangle.
    pub fn at_corners(&self, triangle: u32) -> [f64; 3] {
        self.surface.triangles[triangle as usize].map(|v| self.at_vertex(v))
    }

    /// The smallest length in a triangle.
    pub fn least_in(&self, triangle: u32) -> f64 {
        self.at_corners(triangle).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The lengths at points on triangles; empty if they are equal everywhere.
    pub fn at_all(&self, points: &[DVec3], triangles: &[u32]) -> Vec<f64> {
        if self.is_uniform() {
            return Vec::new();
        }
        points.iter().zip(triangles).map(|(point, t)| self.at(*point, *t)).collect()
    }

    /// The smallest and the largest length.
    pub fn range(&self) -> [f64; 2] {
        let Some(first) = self.lengths.first() else { return [1.0; 2] };
        self.lengths.iter().fold([*first; 2], |[low, high], length| [low.min(*length), high.max(*length)])
    }

    /// The mean of 1 / length² over a triangle: the density of vertices relative to a
    /// uniform mesh.
    pub fn density(&self, triangle: usize) -> f64 {
        if self.is_uniform() {
            return 1.0;
        }
        let corners = self.surface.triangles[triangle].map(|v| self.lengths[v as usize]);
        mean_density(corners)
    }

    /// `[x, y, z, w]` for each triangle, such that the length at a point `p` of it is `xyz · p + w`; empty if
    /// lengths are equal everywhere.
    pub fn slopes(&self) -> Vec<[f64; 4]> {
        if self.is_uniform() {
            return Vec::new();
        }
        let of = |t: usize| {
            let [a, b, c] = self.surface.corners(t);
            let [at_a, at_b, at_c] = self.surface.triangles[t].map(|v| self.lengths[v as usize]);
            let normal = doubled_normal([a, b, c]);
            let doubled_area_sq = normal.length_squared();
            let turned = normal.cross(c - b) * at_a + normal.cross(a - c) * at_b + normal.cross(b - a) * at_c;
            let slope = turned / doubled_area_sq;
            // A triangle without area has no slope; the mean will do.
            if !slope.is_finite() {
                return [0.0, 0.0, 0.0, (at_a + at_b + at_c) / 3.0];
            }
            [slope.x, slope.y, slope.z, at_a - slope.dot(a)]
        };
        (0..self.surface.triangles.len()).map(of).collect()
    }
}

/// The mean of 1 / length along a path over which the length changes linearly from `a` to `b`: edges per unit
/// of path.
pub(crate) fn mean_inverse(a: f64, b: f64) -> f64 {
    if (b - a).abs() < EVEN * a { 2.0 / (a + b) } else { (b / a).ln() / (b - a) }
}

/// The mean of 1 / length² over a triangle in which the length is linear between its corners: twice the
/// divided difference of -ln, by the formula of Hermite and Genocchi.
pub(crate) fn mean_density(mut corners: [f64; 3]) -> f64 {
    corners.sort_by(f64::total_cmp);
    let [a, b, c] = corners;
    if c - a < ALIKE * a {
        // The divided difference would lose its digits here.
        return ((a + b + c) / 3.0).powi(-2);
    }
    2.0 * (mean_inverse(a, b) - mean_inverse(b, c)) / (c - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(lengths: [f64; 4]) -> SizeField {
        let vertices = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 1.0));
        let surface = TriMesh { vertices: vertices.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
        SizeField::new(surface, lengths.to_vec())
    }

    #[test]
    fn the_mean_density_is_one() {
        assert_eq!(square([3.0; 4]).range(), [1.0, 1.0]);
        let field = square([1.0, 4.0, 4.0, 1.0]);
        let [low, high] = field.range();
        assert!((high / low - 4.0).abs() < 1e-12);
        // Over x from 0 to 1, lengths from a to 4 a: the mean of 1 / length² is 1 / (4 a²).
        assert!((low - 0.5).abs() < 1e-9, "{low}");
        let densities = 0.5 * (field.density(0) + field.density(1));
        assert!((densities - 1.0).abs() < 1e-12, "{densities}");
    }

    #[test]
    fn lengths_are_linear_and_the_slopes_say_the_same() {
        let field = square([1.0, 4.0, 4.0, 1.0]);
        let low = field.range()[0];
        for (x, y, t) in [(1.0, 0.25, 0), (0.5, 1.5, 1), (0.25, 0.25, 0), (2.0, 2.0, 1)] {
            let p = DVec3::new(x, y, 1.0);
            let expected = low * (1.0 + 1.5 * x);
            assert!((field.at(p, t) - expected).abs() < 1e-12);
            let [gx, gy, gz, w] = field.slopes()[t as usize];
            assert!((DVec3::new(gx, gy, gz).dot(p) + w - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn a_uniform_one_is_one_everywhere() {
        let field = SizeField::default();
        assert!(field.is_uniform() && field.slopes().is_empty());
        assert_eq!((field.at(DVec3::ONE, 7), field.at_vertex(3), field.density(9)), (1.0, 1.0, 1.0));
        assert!(field.at_all(&[DVec3::ONE], &[7]).is_empty());
    }
}
