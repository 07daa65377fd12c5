//! The triangles around a vertex, and what their shape would be with the vertex elsewhere.

use glam::DVec3;

/// Angles below this many degrees are small.
const SMALL: f64 = 30.0;
/// Distances from the surface below this many edges are rounding.
const ROUNDING: f64 = 1e-5;

/// The edges opposite a vertex, one of each triangle around it, with the shape of these triangles.
pub(super) struct Star {
    edges: Vec<[DVec3; 2]>,
    start: Shape,
    /// The largest cosine of an angle that a move may bring.
    most_cosine: f64,
}

/// The shape of the triangles around a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shape {
    /// The sum of their qualities; see [`crate::mesh::quality::TriangleQuality::q`].
    quality: f64,
    /// How many have an angle above 90 degrees.
    obtuse: usize,
    /// How many have a small angle.
    narrow: usize,
    /// The cosine of the smallest angle.
    largest_cosine: f64,
}

impl Star {
    /// Of a vertex at `p`; angles with at most this cosine may become smaller.
    pub fn new(edges: impl Iterator<Item = [DVec3; 2]>, p: DVec3, most_cosine: f64) -> Self {
        let edges: Vec<_> = edges.collect();
        let start = Shape::of(&edges, p);
        let most_cosine = start.largest_cosine.max(most_cosine);
        Self { edges, start, most_cosine }
    }

    /// The sum of the qualities before any move.
    pub fn quality(&self) -> f64 {
        self.start.quality
    }

    /// The number of triangles.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Whether a move takes points of the triangles farther from a curved surface: all together, or the
    /// farthest of them. `closest` finds the surface.
    pub fn is_farther(
        &self,
        [from, to]: [DVec3; 2],
        mut closest: impl FnMut(DVec3) -> Option<DVec3>,
    ) -> bool {
        let mut distances = |at: DVec3| {
            let (mut sum, mut largest) = (0.0, 0f64);
            for p in self.samples(at) {
                let square = closest(p).map_or(0.0, |q| q.distance_squared(p));
                (sum, largest) = (sum + square, largest.max(square));
            }
            [sum, largest]
        };
        let rounding = (ROUNDING * self.shortest(from)).powi(2);
        let [before, after] = [from, to].map(&mut distances);
        before.into_iter().zip(after).any(|(before, after)| after > before + rounding)
    }

    /// Points of the triangles of a vertex at `p`: this, their centres, and the middles of its edges.
    fn samples(&self, p: DVec3) -> impl Iterator<Item = DVec3> {
        let is_last = |r: &DVec3| self.edges.iter().all(|[q, _]| q != r);
        let of_triangle = move |[q, r]: &[DVec3; 2]| {
            let last = is_last(r).then_some(p.midpoint(*r));
            [(p + *q + *r) / 3.0, p.midpoint(*q)].into_iter().chain(last)
        };
        std::iter::once(p).chain(self.edges.iter().flat_map(of_triangle))
    }

    /// The length of the shortest edge at a vertex at `p`.
    pub fn shortest(&self, p: DVec3) -> f64 {
        self.edges.iter().flatten().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// The sum of the qualities with the vertex at `p`; `None` if more triangles had an angle above 90 or
    /// below 30 degrees, or if one that may not become smaller were smaller than all are now.
    pub fn quality_at(&self, p: DVec3) -> Option<f64> {
        let shape = Shape::of(&self.edges, p);
        let is_worse = shape.obtuse > self.start.obtuse
            || shape.narrow > self.start.narrow
            || shape.largest_cosine > self.most_cosine;
        (!is_worse).then_some(shape.quality)
    }

    /// Whether a triangle of a vertex that moves between the two places meets the condition.
    pub fn any(&self, [from, to]: [DVec3; 2], is_met: impl Fn([DVec3; 3], [DVec3; 3]) -> bool) -> bool {
        self.edges.iter().any(|[q, r]| is_met([from, *q, *r], [to, *q, *r]))
    }
}

impl Shape {
    fn of(edges: &[[DVec3; 2]], p: DVec3) -> Self {
        let mut shape = Self { quality: 0.0, obtuse: 0, narrow: 0, largest_cosine: -1.0 };
        let cosine_of_small = SMALL.to_radians().cos();
        for [q, r] in edges {
            let (u, v) = (*q - p, *r - p);
            let squares = [u.length_squared(), v.length_squared(), q.distance_squared(*r)];
            let [x, y, z] = squares.map(f64::sqrt);
            let (longest, shortest) = (x.max(y).max(z), x.min(y).min(z));
            let others = x * y * z / (shortest * longest).max(f64::MIN_POSITIVE);
            let sum: f64 = squares.iter().sum();
            let cosine = |opposite: f64, other: f64| {
                (sum - 2.0 * opposite * opposite) / (2.0 * other * others).max(f64::MIN_POSITIVE)
            };
            let half_perimeter = 0.5 * (x + y + z);
            let area = 0.5 * u.cross(v).length();
            shape.quality += 6.0 / 3f64.sqrt() * area / (half_perimeter * longest).max(f64::MIN_POSITIVE);
            shape.obtuse += usize::from(sum < 2.0 * longest * longest);
            let largest_cosine = cosine(shortest, longest);
            shape.narrow += usize::from(largest_cosine > cosine_of_small);
            shape.largest_cosine = shape.largest_cosine.max(largest_cosine);
        }
        shape
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality::TriangleQuality;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn moves_are_judged_by_the_qualities_and_angles_of_the_triangles() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let mut refused = [0, 0, 0];
        for _ in 0..5000 {
            let mut at =
                |size: f64| DVec3::from_array(std::array::from_fn(|_| random.random_range(-size..size)));
            let ring: [DVec3; 6] = std::array::from_fn(|k| {
                let angle = k as f64 * std::f64::consts::TAU / 6.0;
                DVec3::new(angle.cos(), angle.sin(), 0.0) + at(0.3)
            });
            let [from, to] = [at(0.2), at(0.4)];
            let edges = (0..6).map(|k| [ring[k], ring[(k + 1) % 6]]);
            let of = |p: DVec3| -> Vec<TriangleQuality> {
                edges.clone().map(|[q, r]| TriangleQuality::new([p, q, r])).collect()
            };
            let obtuse = |all: &[TriangleQuality]| all.iter().filter(|q| q.max_angle() > 90.0).count();
            let smallest =
                |all: &[TriangleQuality]| all.iter().map(TriangleQuality::min_angle).fold(60.0, f64::min);
            let star = Star::new(edges.clone(), from, 42f64.to_radians().cos());
            let (before, after) = (of(from), of(to));
            let sum = |all: &[TriangleQuality]| all.iter().map(|q| q.q).sum::<f64>();
            assert!((star.quality() - sum(&before)).abs() < 1e-12);
            let is_more_obtuse = obtuse(&after) > obtuse(&before);
            let is_narrower = smallest(&after) < smallest(&before).min(42.0);
            let narrow = |all: &[TriangleQuality]| all.iter().filter(|q| q.min_angle() < 30.0).count();
            let reasons = [is_more_obtuse, is_narrower, narrow(&after) > narrow(&before)];
            let reached = star.quality_at(to);
            assert_eq!(reached.is_none(), reasons.contains(&true), "{before:?} {after:?}");
            assert!(reached.is_none_or(|quality| (quality - sum(&after)).abs() < 1e-12));
            refused.iter_mut().zip(reasons).for_each(|(count, is_one)| *count += usize::from(is_one));
        }
        assert!(refused.iter().all(|count| *count > 500), "{refused:?}");
    }
}
