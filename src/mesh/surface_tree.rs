//! Closest points on triangles that know those beside them: by a short walk, or else by a tree.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::bvh::{Bvh, Closest, PatchTrees};
use super::{NONE, TriMesh};

/// Height over a triangle below which the closest point is taken to be on it, over the distance to its edges.
/// A triangle beyond one of them can only be closer if it turns back by more than 125 degrees.
const LOW: f64 = 0.5;
/// Triangles that are looked at on the way to the one below a point.
const WALK: usize = 5;

/// A hierarchy of boxes over the triangles of a mesh, with the neighbours of each triangle. Triangles are
/// named by their ranks in [`Bvh::leaf_order`]; searches may begin at any.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceTree {
    pub bvh: Arc<Bvh>,
    /// For each rank, those of the neighbouring triangles, each across the side opposite a corner, or
    /// [`NONE`].
    beside: Vec<[u32; 3]>,
}

impl SurfaceTree {
    /// Of a mesh with these [`crate::mesh::half_edges::twins`].
    pub fn new(mesh: &TriMesh, twins: &[u32]) -> Self {
        let bvh = Bvh::new(mesh);
        let ranks = bvh.rank_of_each();
        let beside = |t: &u32| {
            // The side opposite a corner begins at the next.
            [1, 2, 0].map(|k| ranks.get(twins[3 * *t as usize + k] as usize / 3).copied().unwrap_or(NONE))
        };
        let beside = bvh.leaf_order().par_iter().map(beside).collect();
        Self { bvh: Arc::new(bvh), beside }
    }

    /// Same as [`Bvh::refit`].
    pub fn refit(&mut self, mesh: &TriMesh) {
        Arc::make_mut(&mut self.bvh).refit(mesh);
    }

    /// The closest point on the triangles that `accept` holds for. The search begins at `rank`, which becomes
    /// the rank of the triangle found.
    ///
    /// If `p` is close above or below the inside of such a triangle, and a short walk leads there, that is
    /// taken for the closest one, which saves the search; it can only be wrong where two sheets of the
    /// surface are closer to each other than that, and both are accepted.
    pub fn closest_accepted(
        &self,
        p: DVec3,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        let below = self.below(p, rank).filter(|below| accept(below.triangle));
        below.or_else(|| self.bvh.closest_accepted(p, rank, accept))
    }

    /// Like [`SurfaceTree::closest_accepted`], among the triangles of one of these patches: as
    /// [`PatchTrees::closest`].
    pub fn closest_in_patch(
        &self,
        patches: &PatchTrees,
        (p, direction): (DVec3, DVec3),
        patch: u32,
        rank: &mut usize,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        let below = self.below(p, rank).filter(|below| accept(below.triangle));
        below.or_else(|| patches.closest(&self.bvh, (p, direction), patch, rank, accept))
    }

    /// The closest point, or any whose squared distance is at most `enough`. The search begins at `rank`,
    /// which becomes the rank of the triangle found; `None` for a point that is not finite.
    pub fn closest_or_near(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<Closest> {
        self.walk(p, rank, |near| near.distance_sq <= enough).or_else(|| self.bvh.closest_from(p, rank))
    }

    /// The squared distance of `p` if it is more than `enough`. The search begins at `rank`, and ends at any
    /// triangle that is near enough.
    pub fn distance_sq_beyond(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<f64> {
        match self.walk(p, rank, |near| near.distance_sq <= enough) {
            Some(_) => None,
            None => self.bvh.distance_sq_beyond(p, rank, enough),
        }
    }

    /// Walks from the triangle at `rank` to the one that `p` is close above or below the inside of, and
    /// returns the closest point on it or on the triangle across its nearest side. `rank` becomes that of the
    /// triangle found, or of the last one on the way.
    pub fn below(&self, p: DVec3, rank: &mut usize) -> Option<Closest> {
        let below = self.walk(p, rank, |near| near.barycentric.iter().all(|weight| *weight > 0.0))?;
        let [nearest, second, _] = sides_by_distance(&below);
        if self.is_low(&below, *rank, nearest) {
            return Some(below);
        }
        // Near one side, what is beyond it is looked at, too.
        let beyond = self.beside[*rank][nearest];
        if beyond == NONE || !self.is_low(&below, *rank, second) {
            return None;
        }
        let across = self.bvh.closest_at(beyond as usize, p)?;
        let back = self.beside[beyond as usize].iter().position(|beside| *beside == *rank as u32)?;
        let is_low = [1, 2].iter().all(|k| self.is_low(&across, beyond as usize, (back + k) % 3));
        // As the tree's search decides.
        let is_closer = (across.distance_sq, across.triangle) < (below.distance_sq, below.triangle);
        if is_closer {
            *rank = beyond as usize;
        }
        is_low.then_some(if is_closer { across } else { below })
    }

    /// Whether a point is low over its closest one on the triangle at `rank`, for the distance of that from
    /// the side opposite a corner.
    fn is_low(&self, found: &Closest, rank: usize, corner: usize) -> bool {
        // No height of the triangle is below the shortest.
        let inside = found.barycentric[corner];
        found.distance_sq <= LOW * LOW * inside * inside * self.bvh.height_sq_at(rank)
    }

    /// Walks from the triangle at `rank` towards `p`, up to a triangle whose closest point is the one wanted;
    /// `None` if the walk ends before. `rank` becomes that of the last triangle on the way.
    fn walk(&self, p: DVec3, rank: &mut usize, is_wanted: impl Fn(&Closest) -> bool) -> Option<Closest> {
        let mut from = NONE;
        for _ in 0..WALK {
            let near = self.bvh.closest_at(*rank, p)?;
            if is_wanted(&near) {
                return Some(near);
            }
            // Inside there is no side to leave by, at a corner there are two, and not the one by which the
            // walk came.
            let beside = self.beside[*rank];
            let side = (0..3).find(|k| near.barycentric[*k] <= 0.0 && beside[*k] != from)?;
            if beside[side] == NONE {
                return None;
            }
            from = *rank as u32;
            *rank = beside[side] as usize;
        }
        None
    }
}

/// The sides of a triangle, by the corners opposite, as they get farther from a point of it.
fn sides_by_distance(found: &Closest) -> [usize; 3] {
    let weights = found.barycentric;
    let mut corners = [0, 1, 2];
    corners.sort_unstable_by(|a, b| weights[*a].total_cmp(&weights[*b]));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::half_edges::twins;
    use crate::mesh::samples::sample;
    use crate::mesh::triangle::{doubled_normal, shortest_height_sq};
    use rand::{RngExt, SeedableRng};

    /// Walks from triangles nearby end at the closest point, if they do not end without one.
    #[test]
    fn short_walks_find_the_closest_point() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        for (name, height) in
            [("bumpy-sphere", 0.3), ("genus3", 0.3), ("open-hemisphere", 0.3), ("genus3", 0.0)]
        {
            let surface = sample(name).unwrap_or_default();
            let tree = SurfaceTree::new(&surface, &twins(&surface.triangles));
            let order = tree.bvh.leaf_order();
            let (mut found, mut steps, mut across) = (0, 0, 0);
            for (rank, t) in order.iter().enumerate().cycle().take(4 * order.len()) {
                let corners = surface.corners(*t as usize);
                let [a, b, c] = corners;
                let mut offset = || random.random_range(-0.6..0.6);
                let normal = doubled_normal(corners);
                let height = height * shortest_height_sq(corners).sqrt() * offset();
                let p =
                    (a + b + c) / 3.0 + (b - a) * offset() + (c - a) * offset() + normal.normalize() * height;
                let is_facing = |t: u32| doubled_normal(surface.corners(t as usize)).dot(normal) > 0.0;
                let mut end = rank;
                let Some(below) = tree.below(p, &mut end).filter(|below| is_facing(below.triangle)) else {
                    continue;
                };
                assert_eq!(below.triangle, order[end]);
                let closest = tree.bvh.closest_accepted(p, &mut 0, is_facing);
                assert_eq!(closest, Some(below), "{name}, triangle {t}");
                found += 1;
                steps += usize::from(end != rank);
                let [nearest, ..] = sides_by_distance(&below);
                across += usize::from(!tree.is_low(&below, end, nearest));
            }
            let count = order.len();
            assert!(found > count && steps > count / 2, "{found}, {steps} of {name}");
            assert!(height == 0.0 || across > count / 50, "{across} of {name} near a side");
        }
    }

    #[test]
    fn triangles_beside_share_the_side() {
        let surface = sample("open-hemisphere").unwrap_or_default();
        let tree = SurfaceTree::new(&surface, &twins(&surface.triangles));
        let corners = |rank: usize| surface.triangles[tree.bvh.leaf_order()[rank] as usize];
        let mut at_boundary = 0;
        for (rank, beside) in tree.beside.iter().enumerate() {
            for (k, other) in beside.iter().enumerate() {
                let [p, q] = [1, 2].map(|j| corners(rank)[(k + j) % 3]);
                if *other == NONE {
                    at_boundary += 1;
                    continue;
                }
                let other = corners(*other as usize);
                assert!((0..3).any(|j| [other[j], other[(j + 1) % 3]] == [q, p]));
            }
        }
        assert!(at_boundary > 3);
    }
}
