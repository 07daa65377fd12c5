//! What small and large angles cost.

use glam::DVec3;
use std::cmp::Reverse;
use std::f64::consts::PI;

use crate::local::star_mesh::StarMesh;

/// Angles below this, in degrees, cost something: more than the least angle, so that what is mended does not
/// fall back.
const NARROW: f64 = 40.0;
/// Angles above this, in degrees, cost something.
const WIDE: f64 = 90.0;
/// Cost of an angle of 180 degrees.
const COST_OF_WIDE: f64 = 1.0;
/// Additional cost of an angle below the least one.
const COST_OF_SMALL: f64 = 0.1;

/// Additional cost of an angle above [`WIDE`], if these are mended.
const COST_OF_OBTUSE: f64 = 0.02;

/// What angles cost, and the least one that triangles are to have.
#[derive(Debug, Clone, Copy)]
pub(super) struct AngleCost {
    /// In radians.
    least: f64,
    /// The squared cosine of [`NARROW`].
    narrow_sq: f64,
    /// Of an angle above [`WIDE`], besides; 0 if these are not mended for their own sake.
    obtuse: f64,
}

impl AngleCost {
    /// For a least angle in degrees, at most [`NARROW`]; whether obtuse angles are mended as well.
    pub fn new(least: f64, mends_obtuse: bool) -> Self {
        Self {
            least: least.to_radians(),
            narrow_sq: NARROW.to_radians().cos().powi(2),
            obtuse: if mends_obtuse { COST_OF_OBTUSE } else { 0.0 },
        }
    }

    /// The smallest angle of a triangle if it is below the least one, in radians; 0 if it has no area.
    pub fn small_angle(&self, [a, b, c]: [DVec3; 3]) -> Option<f64> {
        let sides = [b - a, c - b, a - c];
        let squares = sides.map(DVec3::length_squared);
        // Without a length there is no angle.
        let least = squares.into_iter().fold(f64::INFINITY, f64::min);
        if least * least > 0.0 && self.is_good(sides, squares) {
            return None;
        }
        let smallest = cosines(sides, squares)[0].acos();
        (smallest < self.least).then_some(smallest)
    }

    /// Whether no angle is below [`NARROW`] or above [`WIDE`], which takes no roots to see, from the sides in
    /// order and their squared lengths.
    fn is_good(&self, [u, v, w]: [DVec3; 3], [x, y, z]: [f64; 3]) -> bool {
        let is_good = |dot: f64, lengths: f64| dot >= 0.0 && dot * dot <= self.narrow_sq * lengths;
        is_good(-w.dot(u), z * x) && is_good(-u.dot(v), x * y) && is_good(-v.dot(w), y * z)
    }

    /// Where a triangle comes in the order of mending, the least first, from 0 on: small angles before obtuse
    /// ones, which count at curves. `None` if it has neither.
    pub fn rank(&self, corners: [DVec3; 3], is_at_curve: bool) -> Option<f64> {
        let counts = is_at_curve && self.obtuse > 0.0;
        let obtuse = || counts.then(|| largest(corners)).filter(|angle| *angle > WIDE.to_radians());
        self.small_angle(corners).or_else(|| obtuse().map(|angle| self.least + PI - angle))
    }

    /// What a triangle costs: 0 if all its angles are good.
    pub fn of(&self, [a, b, c]: [DVec3; 3]) -> f64 {
        let (u, v, w) = (b - a, c - b, a - c);
        let [x, y, z] = [u, v, w].map(DVec3::length_squared);
        // Most have no bad angle.
        if self.is_good([u, v, w], [x, y, z]) {
            return 0.0;
        }
        let [high, low] = cosines([u, v, w], [x, y, z]);
        let (mut narrow, mut wide, mut small, mut obtuse) = (0.0, 0.0, 0.0, 0.0);
        if high * high > self.narrow_sq {
            let smallest = high.acos();
            narrow = (NARROW.to_radians() - smallest).max(0.0) / NARROW.to_radians();
            small = if smallest < self.least { COST_OF_SMALL } else { 0.0 };
        }
        if low < 0.0 {
            obtuse = self.obtuse;
            wide = (low.acos() - WIDE.to_radians()).max(0.0) / (180.0 - WIDE).to_radians();
        }
        narrow * narrow + COST_OF_WIDE * wide * wide + small + obtuse
    }

    /// What all triangles of a mesh cost.
    pub fn of_all(&self, mesh: &StarMesh) -> f64 {
        mesh.alive().map(|t| self.of(mesh.corners(t))).sum()
    }

    /// What the triangles between a vertex at `to` and these sides around it cost, if it is less than `most`.
    pub fn around_below(&self, sides: &[[DVec3; 2]], to: DVec3, most: f64) -> Option<f64> {
        let mut sum = 0.0;
        for [p, q] in sides {
            sum += self.of([to, *p, *q]);
            // No triangle costs less than nothing.
            if sum >= most {
                return None;
            }
        }
        (sum < most).then_some(sum)
    }

    /// Sorts the sides around a vertex by what the triangles between them and `at` cost, so that
    /// [`AngleCost::around_below`] needs few of them to refuse most other positions.
    pub fn sort_dearest_first(&self, sides: &mut [[DVec3; 2]], at: DVec3) {
        sides.sort_by_cached_key(|[p, q]| Reverse(self.of([at, *p, *q]).to_bits()));
    }

    /// What the triangles between a vertex at `to` and these sides around it cost.
    pub fn around(&self, sides: &[[DVec3; 2]], to: DVec3) -> f64 {
        sides.iter().map(|[p, q]| self.of([to, *p, *q])).sum()
    }
}

/// The sides of the triangles around a vertex that are opposite to it, in the direction of the triangles.
pub(super) fn sides_around(mesh: &StarMesh, v: u32) -> Vec<[DVec3; 2]> {
    let opposite = |t: &u32| {
        let triangle = mesh.triangles[*t as usize];
        let k = triangle.iter().position(|w| *w == v).unwrap_or(0);
        [1, 2].map(|next| mesh.points[triangle[(k + next) % 3] as usize])
    };
    mesh.star[v as usize].iter().map(opposite).collect()
}

/// The largest angle of a triangle in radians; 180 degrees if it has no area.
fn largest([a, b, c]: [DVec3; 3]) -> f64 {
    let sides = [b - a, c - b, a - c];
    cosines(sides, sides.map(DVec3::length_squared))[1].acos()
}

/// The largest and the smallest cosine of a triangle's angles from its sides, in order, and their squared
/// lengths; 1 and -1 if it has no area.
fn cosines([u, v, w]: [DVec3; 3], [x, y, z]: [f64; 3]) -> [f64; 2] {
    // The angle opposite to each side, with the product of the squared lengths of its own sides.
    let opposite = [(x, -v.dot(w), y * z), (y, -w.dot(u), z * x), (z, -u.dot(v), x * y)];
    let [p, q, r] = opposite;
    // The smallest angle is opposite to the shortest side, and the largest one to the longest.
    let shorter = |p: (f64, f64, f64), q: (f64, f64, f64)| if q.0 < p.0 { q } else { p };
    let longer = |p: (f64, f64, f64), q: (f64, f64, f64)| if q.0 > p.0 { q } else { p };
    let cosine = |(_, dot, squares): (f64, f64, f64)| dot / squares.sqrt();
    let [high, low] = [cosine(shorter(shorter(p, q), r)), cosine(longer(longer(p, q), r))];
    // Without a length there is no angle.
    if !(high.is_finite() && low.is_finite()) || x * y * z == 0.0 {
        return [1.0, -1.0];
    }
    [high.min(1.0), low.max(-1.0)]
}
