//! The shape of triangles and the regularity of vertices.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::TriMesh;
use super::chunks::par_map_chunks;
use super::half_edges::{EdgeTable, HalfEdge, par_fold_corners};
use super::triangle::{area, doubled_normal};

/// Keeps quotients of degenerate triangles defined; far below any product of lengths of a scaled mesh.
const TINY: f64 = 1e-300;
/// An angle within this many degrees of a limit is computed, since its cosine may round to the wrong side.
const MARGIN: f64 = 1e-3;

/// The shape of one triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleQuality {
    /// `6 / sqrt(3) * area / (half perimeter * longest edge)`: 1 if equilateral, 0 if without area. Frey and
    /// Borouchaki, "Surface mesh quality evaluation", 1999.
    pub q: f64,
    /// Angles at the three corners in degrees, by the law of cosines. A triangle of three equal points has
    /// three angles of 90 degrees, one with two equal points has 0, 90 and 90.
    pub angles: [f64; 3],
    /// Lengths of the edges opposite the three corners, in the mesh's unit.
    pub lengths: [f64; 3],
}

impl TriangleQuality {
    /// Measures a triangle whose coordinates are neither large nor small enough for their fourth powers to
    /// leave the range of `f64`.
    pub fn new([a, b, c]: [DVec3; 3]) -> Self {
        let [la, lb, lc] = lengths([a, b, c]);
        let q = q([a, b, c], [la, lb, lc]);
        Self { q, angles: [angle(la, lb, lc), angle(lb, la, lc), angle(lc, la, lb)], lengths: [la, lb, lc] }
    }

    /// The smallest angle in degrees, 0..=60 except for a triangle of three equal points.
    pub fn min_angle(&self) -> f64 {
        self.angles[0].min(self.angles[1]).min(self.angles[2])
    }

    /// The largest angle in degrees, 60..=180.
    pub fn max_angle(&self) -> f64 {
        self.angles[0].max(self.angles[1]).max(self.angles[2])
    }
}

/// The lengths of the edges opposite the three corners.
fn lengths([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    [b.distance(c), c.distance(a), a.distance(b)]
}

/// See [`TriangleQuality::q`].
fn q(corners: [DVec3; 3], [la, lb, lc]: [f64; 3]) -> f64 {
    let product = 0.5 * (la + lb + lc) * la.max(lb).max(lc);
    6.0 / 3f64.sqrt() * area(corners) / product.max(TINY)
}

fn cosine(opposite: f64, left: f64, right: f64) -> f64 {
    let cosine = (left * left + right * right - opposite * opposite) / (2.0 * left * right).max(TINY);
    cosine.clamp(-1.0, 1.0)
}

fn angle(opposite: f64, left: f64, right: f64) -> f64 {
    cosine(opposite, left, right).acos().to_degrees()
}

/// The largest and the smallest cosine of [`TriangleQuality::angles`].
pub(crate) fn extreme_cosines_of(corners: [DVec3; 3]) -> [f64; 2] {
    extreme_cosines(lengths(corners))
}

/// Like [`extreme_cosines_of`], from the lengths of the edges.
fn extreme_cosines([la, lb, lc]: [f64; 3]) -> [f64; 2] {
    let cosines = [cosine(la, lb, lc), cosine(lb, la, lc), cosine(lc, la, lb)];
    [f64::max, f64::min].map(|pick| cosines.into_iter().reduce(pick).unwrap_or(0.0))
}

/// The smallest and the largest of [`TriangleQuality::angles`].
pub(crate) fn extreme_angles(corners: [DVec3; 3]) -> [f64; 2] {
    extreme_cosines_of(corners).map(|cosine| cosine.acos().to_degrees())
}

/// The smallest of [`TriangleQuality::angles`].
pub(crate) fn smallest_angle(corners: [DVec3; 3]) -> f64 {
    extreme_cosines_of(corners)[0].acos().to_degrees()
}

/// The [`smallest_angle`] if it is below a limit, also in degrees; nearly all triangles are far from it, as
/// their cosines show.
pub(crate) fn angle_below(corners: [DVec3; 3], limit: f64) -> Option<f64> {
    let least = cosine_clear_of(limit);
    if are_cosines_below(corners, least) {
        return None;
    }
    let [high, _] = extreme_cosines_of(corners);
    if high < least {
        return None;
    }
    Some(high.acos().to_degrees()).filter(|angle| *angle < limit)
}

/// A cosine below which an angle is above a limit in degrees, however it is rounded.
pub(crate) fn cosine_clear_of(limit: f64) -> f64 {
    (limit + MARGIN).min(180.0).to_radians().cos()
}

/// Whether all angles are clearly below 90 degrees, and their cosines below `most`, as [`cosine_clear_of`]
/// gives it. This holds for nearly all triangles of a good mesh, and squares show it, as in [`angle_below`].
pub(crate) fn are_clearly_acute([a, b, c]: [DVec3; 3], most: f64) -> bool {
    let squares = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
    let half_sum = 0.5 * (squares[0] + squares[1] + squares[2]);
    let least = MARGIN.to_radians();
    let is_clear = |k: usize| {
        let sides = squares[(k + 1) % 3] * squares[(k + 2) % 3];
        let product = half_sum - squares[k];
        product > 0.0 && product * product > least * least * sides && product * product < most * most * sides
    };
    most > 0.0 && (0..3).all(is_clear)
}

/// Whether the cosines of all angles are below a positive one, as their squares tell, without a root or a
/// quotient; wrong at most by rounding, of coordinates whose fourth powers are normal numbers.
fn are_cosines_below([a, b, c]: [DVec3; 3], most: f64) -> bool {
    let squares = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
    let half_sum = 0.5 * (squares[0] + squares[1] + squares[2]);
    let is_below = |k: usize| {
        let (left, right) = (squares[(k + 1) % 3], squares[(k + 2) % 3]);
        // The cosine times the lengths of both sides.
        let product = half_sum - squares[k];
        product <= 0.0 || product * product < most * most * left * right
    };
    most > 0.0 && is_below(0) && is_below(1) && is_below(2)
}

/// The triangles of a mesh in summary; independent of the mesh's size and unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Quality {
    /// Smallest [`TriangleQuality::q`], 0..=1.
    pub min_quality: f64,
    /// Mean [`TriangleQuality::q`] over the triangles, 0..=1.
    pub mean_quality: f64,
    /// Smallest angle in degrees.
    pub min_angle: f64,
    /// Mean over the triangles of each one's smallest angle, in degrees.
    pub mean_min_angle: f64,
    /// Share of triangles with an angle below 30 degrees, 0..=1.
    pub fraction_below_30: f64,
    /// Share of triangles with an angle above 90 degrees, 0..=1.
    pub fraction_above_90: f64,
    /// Standard deviation of the edge lengths over their mean, inner edges counted once for each face.
    pub edge_cv: f64,
}

/// Summarises the triangles' shapes; `None` without triangles. Panics if an index is out of range.
pub fn quality(mesh: &TriMesh) -> Option<Quality> {
    if mesh.triangles.is_empty() {
        return None;
    }
    let scale = scale_of(mesh);
    let corners = |t: usize| mesh.corners(t).map(|corner| corner * scale);
    let n = mesh.triangles.len() as f64;
    let [one_length, ..] = lengths(corners(0));
    let sums = par_map_chunks(mesh.triangles.len(), |range| {
        range.map(|t| Sums::of(corners(t), one_length)).fold(Sums::NONE, Sums::with)
    });
    let sum = sums.into_iter().fold(Sums::NONE, Sums::with);
    let excess = sum.excess / (3.0 * n);
    let mean = one_length + excess;
    let spread = (sum.excess_sq - 3.0 * n * excess * excess).max(0.0);
    Some(Quality {
        min_quality: sum.min_quality,
        mean_quality: sum.q / n,
        min_angle: sum.min_angle,
        mean_min_angle: sum.theta / n,
        fraction_below_30: sum.below_30 as f64 / n,
        fraction_above_90: sum.above_90 as f64 / n,
        edge_cv: (spread / (3.0 * n)).sqrt() / mean.max(TINY),
    })
}

/// Least values and sums over triangles.
#[derive(Clone, Copy)]
struct Sums {
    min_quality: f64,
    q: f64,
    min_angle: f64,
    theta: f64,
    below_30: usize,
    above_90: usize,
    /// Of the edges' lengths less that of one of them, so that the spread is not a difference of large
    /// numbers.
    excess: f64,
    excess_sq: f64,
}

impl Sums {
    /// Of no triangle.
    const NONE: Self = Self {
        min_quality: f64::INFINITY,
        q: 0.0,
        min_angle: f64::INFINITY,
        theta: 0.0,
        below_30: 0,
        above_90: 0,
        excess: 0.0,
        excess_sq: 0.0,
    };

    fn of(corners: [DVec3; 3], one_length: f64) -> Self {
        let lengths = lengths(corners);
        let q = q(corners, lengths);
        // Of the angles, the smallest and the largest alone.
        let [high, low] = extreme_cosines(lengths);
        let theta = high.acos().to_degrees();
        Self {
            min_quality: q,
            q,
            min_angle: theta,
            theta,
            below_30: usize::from(theta < 30.0),
            above_90: usize::from(low < 0.0 && low.acos().to_degrees() > 90.0),
            excess: lengths.iter().map(|length| length - one_length).sum(),
            excess_sq: lengths.iter().map(|length| (length - one_length).powi(2)).sum(),
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            min_quality: self.min_quality.min(other.min_quality),
            q: self.q + other.q,
            min_angle: self.min_angle.min(other.min_angle),
            theta: self.theta + other.theta,
            below_30: self.below_30 + other.below_30,
            above_90: self.above_90 + other.above_90,
            excess: self.excess + other.excess,
            excess_sq: self.excess_sq + other.excess_sq,
        }
    }
}

/// How many edges meet at the vertices away from the boundary.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Valence {
    /// Vertices that some triangle uses and no boundary edge touches.
    pub interior_vertices: usize,
    /// Number of those vertices for each number of edges that occurs.
    pub histogram: BTreeMap<u32, usize>,
    /// Share of those vertices with six edges, 0..=1; `None` if there are none at all.
    pub fraction_6: Option<f64>,
    /// Share of those vertices with fewer than five or more than seven edges, 0..=1; `None` as above.
    pub fraction_outside_5_to_7: Option<f64>,
}

/// Counts the edges at each vertex. Panics if a triangle's index is out of range.
pub fn valence(mesh: &TriMesh) -> Valence {
    valence_of(mesh, &EdgeTable::new(&mesh.triangles))
}

/// [`valence`] with the edge table already at hand.
pub(crate) fn valence_of(mesh: &TriMesh, table: &EdgeTable) -> Valence {
    let mut degree = vec![0u32; mesh.vertices.len()];
    let mut on_boundary = vec![false; mesh.vertices.len()];
    for edge in table.edges() {
        let (a, b) = edge[0].ends();
        for v in [a as usize, b as usize] {
            degree[v] += 1;
            on_boundary[v] |= edge.len() == 1;
        }
    }
    Valence::of(&degree, &on_boundary)
}

/// [`valence`] of a mesh that is known to be closed and to have two faces at each edge.
pub(crate) fn closed_valence(mesh: &TriMesh) -> Valence {
    let mut degree = vec![0u32; mesh.vertices.len()];
    par_fold_corners(mesh.triangles.as_flattened(), &mut degree, |degree, _| *degree += 1);
    Valence::of(&degree, &vec![false; mesh.vertices.len()])
}

impl Valence {
    /// Of vertices with these numbers of edges, which are on the boundary or not.
    fn of(degree: &[u32], on_boundary: &[bool]) -> Self {
        // Every vertex in use has an edge, so that a degree of zero marks the unused ones.
        let is_counted = |v: &usize| degree[*v] > 0 && !on_boundary[*v];
        let parts = par_map_chunks(degree.len(), |range| {
            let mut histogram: BTreeMap<u32, usize> = BTreeMap::new();
            range.filter(is_counted).for_each(|v| *histogram.entry(degree[v]).or_default() += 1);
            histogram
        });
        let mut histogram: BTreeMap<u32, usize> = BTreeMap::new();
        for (degree, count) in parts.into_iter().flatten() {
            *histogram.entry(degree).or_default() += count;
        }
        let interior_vertices: usize = histogram.values().sum();
        let share = |wanted: &dyn Fn(u32) -> bool| {
            let count: usize = histogram.iter().filter(|(k, _)| wanted(**k)).map(|(_, n)| n).sum();
            (interior_vertices > 0).then(|| count as f64 / interior_vertices as f64)
        };
        let fraction_6 = share(&|k| k == 6);
        let fraction_outside_5_to_7 = share(&|k| !(5..=7).contains(&k));
        Self { interior_vertices, histogram, fraction_6, fraction_outside_5_to_7 }
    }
}

/// Share of the inner edges (0..=1) whose faces turn against each other by more than 120 degrees; 0 without
/// inner edges. An edge with more than two faces counts each pair that follow one another, ordered by the
/// edge's place in the face (first, second, third side), then by face.
pub(crate) fn folded_share(mesh: &TriMesh, table: &EdgeTable) -> f64 {
    let scale = scale_of(mesh);
    let normal = |side: &HalfEdge| doubled_normal(mesh.corners(side.triangle()).map(|p| p * scale));
    let is_folded = |[one, other]: [&HalfEdge; 2]| {
        let (m, n) = (normal(one), normal(other));
        let unit = |normal: DVec3| normal / normal.length().max(TINY);
        m.dot(n) < 0.0 && unit(m).dot(unit(n)) < -0.5
    };
    let count = |edge: &[HalfEdge]| match edge {
        [_] => [0, 0],
        [one, other] => [1, usize::from(is_folded([one, other]))],
        _ => {
            let mut edge = edge.to_vec();
            edge.sort_unstable_by_key(|side| (side.corners().0 % 3, side.triangle()));
            [edge.len() - 1, edge.windows(2).filter(|pair| is_folded([&pair[0], &pair[1]])).count()]
        }
    };
    let [pairs, folded] = table.par_edges().map(count).reduce(|| [0, 0], |[a, b], [c, d]| [a + c, b + d]);
    folded as f64 / pairs.max(1) as f64
}

/// The corners of all triangles: vertices that no triangle uses say nothing about the scale of the surface.
pub(crate) fn corner_points(mesh: &TriMesh) -> impl Iterator<Item = DVec3> {
    mesh.triangles.as_flattened().iter().map(|&v| mesh.vertices[v as usize])
}

/// [`power_of_two_scale`] for the triangles of a mesh.
pub(crate) fn scale_of(mesh: &TriMesh) -> f64 {
    let largest = par_map_chunks(mesh.triangles.len(), |range| {
        let corners = mesh.triangles[range].as_flattened().iter();
        corners.fold(0.0, |m: f64, v| m.max(mesh.vertices[*v as usize].abs().max_element()))
    });
    power_of_two_scale(largest.into_iter().map(DVec3::splat))
}

/// A power of two that brings the largest coordinate to between 1/2 and 2. Powers of two leave every bit of a
/// coordinate's fraction alone, so the measures do not change with the scale.
pub(crate) fn power_of_two_scale(points: impl Iterator<Item = DVec3>) -> f64 {
    let largest = points.fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    if largest > 0.0 && largest.is_finite() {
        // The exponent stays where both the factor and its inverse are normal numbers.
        f64::exp2(-largest.log2().round().clamp(-1000.0, 1000.0))
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn angles_that_squares_decide_are_those_of_the_cosines() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(9);
        let (mut small, mut acute, mut tested) = (0, 0, 0);
        for round in 0..20_000 {
            let mut point = || DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
            let [mut a, mut b, mut c] = [point(), point(), point()];
            match round % 8 {
                // Needles, flat ones, equal corners, corners in a row.
                0 => b = a + 1e-9 * (b - a),
                1 => c = 0.5 * (a + b) + 1e-7 * (c - a),
                2 => b = a,
                3 => (b, c) = (a, a),
                4 => c = a + 2.0 * (b - a),
                _ => {}
            }
            let factor = f64::exp2(f64::from(round % 5 - 2) * 150.0);
            (a, b, c) = (factor * a, factor * b, factor * c);
            let scale = power_of_two_scale([a, b, c].into_iter());
            let corners = [a, b, c].map(|p| p * scale);
            let quality = TriangleQuality::new(corners);
            let exact = quality.min_angle();
            for limit in [1.0, 30.0, 59.0, 89.9995, 120.0] {
                let below = angle_below(corners, limit);
                assert_eq!(below, Some(exact).filter(|angle| *angle < limit), "{a} {b} {c}");
                small += usize::from(below.is_some());
                let by = |margin: f64| exact > limit + margin && quality.max_angle() < 90.0 - margin;
                let is_acute = are_clearly_acute(corners, cosine_clear_of(limit));
                assert!(is_acute <= by(0.0) && is_acute >= by(0.01), "{a} {b} {c}");
                acute += usize::from(is_acute);
                tested += 1;
            }
        }
        assert!(8 * small > tested && 8 * small < 7 * tested, "{small} of {tested}");
        assert!(40 * acute > tested, "{acute} of {tested}");
    }

    #[test]
    fn closed_meshes_have_as_many_edges_at_a_vertex_as_corners() {
        for name in ["sphere", "genus3", "two-components"] {
            let mut mesh = sample(name).unwrap_or_default();
            // One vertex that two fans share, and one that no triangle uses.
            let last = mesh.vertices.len() as u32 - 1;
            mesh.triangles.as_flattened_mut().iter_mut().filter(|v| **v == last).for_each(|v| *v = 0);
            let table = EdgeTable::new(&mesh.triangles);
            assert_eq!(closed_valence(&mesh), valence_of(&mesh, &table), "{name}");
        }
    }
}
