//! Pieces of a surface, the bounds of their distances, and their cuts.

use std::cmp::Ordering;

use glam::DVec3;

use super::polygon::{Corner, Polygon};
use super::{Found, Target};
use crate::mesh::triangle::doubled_normal;

/// Steps that lead to a piece, at most; it stays as it is then.
pub(super) const MAX_DEPTH: u32 = 200;
/// What lies beyond a cut by less than this share of the reach stays.
const THIN: f64 = 0.2;
/// Differences of distances that count, where a cut separates what is closer to one triangle or another, as a
/// share of those that matter.
const ALIKE: f64 = 0.2;
/// Pieces that are larger than the triangle below them by this factor are halved.
const LARGE: f64 = 4.0;
/// Minimum square of the reach, relative to the bounds that are small enough.
const LEAST_REACH_SQ: f64 = 1e-6;

/// A part of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    corners: [Corner; 3],
    depth: u32,
    /// No point of it is farther away.
    pub upper: f64,
}

/// By bound.
impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        self.upper.total_cmp(&other.upper)
    }
}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Piece {}

impl Piece {
    /// A whole triangle, with the ranks of the triangles closest to its corners.
    pub fn new(corners: [DVec3; 3], near: [u32; 3]) -> Self {
        let corner = |k: usize| Corner { at: corners[k], near: near[k] };
        Self { corners: [corner(0), corner(1), corner(2)], depth: 0, upper: f64::INFINITY }
    }

    /// An upper bound from the triangles near the corners.
    pub fn bound(&self, target: &Target) -> f64 {
        let by = |corner: &Corner| max_of(self.each_to(target, corner.near));
        self.corners.iter().map(by).fold(self.upper, f64::min)
    }

    /// Bounds the piece more closely, and hands parts of it to `rest` unless that suffices.
    pub fn step(mut self, target: &Target, found: &mut Found, rest: &mut impl FnMut(Piece)) {
        if found.settles(self.upper) || self.is_near(target, found) {
            return;
        }
        if self.depth >= MAX_DEPTH {
            found.upper = found.upper.max(self.bound(target));
            return;
        }
        self.depth += 1;
        let middle = self.corners.iter().map(|corner| corner.at / 3.0).sum();
        let (rank, distance) = target.measure(middle, self.corners[0].near, found);
        let far = self.each_to(target, rank);
        let radius = max_of(self.corners.map(|corner| corner.at.distance(middle)));
        self.upper = self.upper.min(max_of(far)).min(distance + radius);
        if found.settles(self.upper) || self.clip(rank, target, found, rest) {
            return;
        }
        // What is left lies above the one triangle. The farthest corner is as far away as it seems, or near
        // another triangle, and then the piece is cut where both are equally far away.
        let worst = (0..3).fold(0, |worst, k| if far[k] > far[worst] { k } else { worst });
        let corner = &mut self.corners[worst];
        corner.near = target.measure(corner.at, corner.near, found).0;
        let other = corner.near;
        let by_other = self.each_to(target, other);
        self.upper = self.upper.min(max_of(by_other));
        if found.settles(self.upper) {
            return;
        }
        let tiny = ALIKE * target.effort.relative * found.enough;
        match Polygon::new(self.corners).cut(|k| far[k] - by_other[k], tiny, rank) {
            Some(parts) => parts.iter().for_each(|part| self.hand_out(part, rest)),
            None => self.halve(rank, rest),
        }
    }

    /// Whether a triangle near a corner shows that the bound is small enough.
    fn is_near(&self, target: &Target, found: &mut Found) -> bool {
        (0..3).any(|k| {
            let rank = self.corners[k].near;
            if k > 0 && self.corners[k - 1].near == rank {
                return false;
            }
            let mut upper = 0.0;
            // The corner itself comes last: it is the least likely to be far away.
            let small = (1..4).all(|j| {
                upper = target.to_triangle(rank, self.corners[(k + j) % 3].at).max(upper);
                upper <= found.enough
            });
            small && found.settles(upper)
        })
    }

    /// How far each corner is from the triangle at `rank`.
    fn each_to(&self, target: &Target, rank: u32) -> [f64; 3] {
        self.corners.map(|corner| target.to_triangle(rank, corner.at))
    }

    /// Cuts off what lies beyond the sides of the triangle at `rank`, which the middle is closest to, and too
    /// far for a bound that is small enough; false if there is nothing.
    fn clip(&self, rank: u32, target: &Target, found: &mut Found, rest: &mut impl FnMut(Piece)) -> bool {
        let Some(below) = target.bvh.corners_at(rank as usize) else { return false };
        let longest = |at: [DVec3; 3]| max_of([0, 1, 2].map(|k| at[k].distance(at[(k + 1) % 3])));
        if longest(self.corners.map(|corner| corner.at)) > LARGE * (longest(below) + 2.0 * found.enough) {
            self.halve(rank, rest);
            return true;
        }
        let normal = doubled_normal(below).normalize_or_zero();
        let height = max_of(self.corners.map(|corner| (corner.at - below[0]).dot(normal).abs()));
        let height = height / found.enough;
        // How far from the triangle a point at that height may be across.
        let reach = (1.0 - height * height).max(LEAST_REACH_SQ).sqrt() * found.enough;
        let edges = [0, 1, 2].map(|k| (below[(k + 1) % 3] - below[k]).normalize_or_zero());
        // Where two sides are moved outwards by this share of the reach at most, the reach of their corner is
        // not exceeded: the sine of half the angle there.
        let share = [0, 1, 2].map(|k| (0.5 + 0.5 * edges[k].dot(edges[(k + 2) % 3])).max(0.0).sqrt());
        let mut above = Polygon::new(self.corners);
        let mut is_cut = false;
        for k in 0..3 {
            let outward = edges[k].cross(normal);
            let reach = reach * share[k].min(share[(k + 1) % 3]);
            let side = below[k].dot(outward) + (1.0 - THIN) * reach;
            let corners = above;
            let beyond = |c: usize| corners.corners()[c].at.dot(outward) - side;
            if let Some([inside, outside]) = above.cut(beyond, THIN * reach, rank) {
                self.hand_out(&outside, rest);
                above = inside;
                is_cut = true;
            }
        }
        if is_cut {
            let far = above.corners().iter().map(|corner| target.to_triangle(rank, corner.at));
            if !found.settles(far.fold(0.0, f64::max)) {
                self.hand_out(&above, rest);
            }
        }
        is_cut
    }

    /// Halves the longest edge.
    fn halve(&self, rank: u32, rest: &mut impl FnMut(Piece)) {
        let length = |k: usize| self.corners[(k + 1) % 3].at.distance_squared(self.corners[(k + 2) % 3].at);
        let k = (1..3).fold(0, |longest, k| if length(k) > length(longest) { k } else { longest });
        let [tip, a, b] = [0, 1, 2].map(|step| self.corners[(k + step) % 3]);
        let middle = Corner { at: a.at + (b.at - a.at) * 0.5, near: rank };
        rest(Piece { corners: [tip, a, middle], ..*self });
        rest(Piece { corners: [tip, middle, b], ..*self });
    }

    fn hand_out(&self, part: &Polygon, rest: &mut impl FnMut(Piece)) {
        part.triangles().for_each(|corners| rest(Piece { corners, ..*self }));
    }
}

fn max_of(values: [f64; 3]) -> f64 {
    values[0].max(values[1]).max(values[2])
}
