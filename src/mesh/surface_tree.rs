//! Closest points on triangles that know those beside them: by a short walk, or else by a tree.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::bvh::{Bvh, Closest};
use super::{NONE, TriMesh};

/// Height over a triangle below which the closest point is taken to be on it, over the distance to its edges.
const LOW: f64 = 0.2;
/// Triangles that are looked at on the way to the one below a point.
const WALK: usize = 5;

/// A hierarchy of boxes over the triangles of a mesh, and which of these are beside each other. Triangles are
/// named by their ranks, as [`Bvh::leaf_order`] has them; searches begin at any.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceTree {
    pub bvh: Arc<Bvh>,
    /// For each rank those of the triangles beside it, each across the side opposite a corner, or [`NONE`].
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

    /// As [`Bvh::refit`].
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
    /// returns its closest point. `rank` becomes that of the last triangle on the way in any case.
    pub fn below(&self, p: DVec3, rank: &mut usize) -> Option<Closest> {
        let below = self.walk(p, rank, |near| near.barycentric.iter().all(|weight| *weight > 0.0))?;
        let inside = below.barycentric.iter().fold(1.0, |a: f64, b| a.min(*b));
        let height_sq = self.bvh.height_sq_at(*rank);
        (below.distance_sq <= LOW * LOW * inside * inside * height_sq).then_some(below)
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
        for name in ["bumpy-sphere", "open-hemisphere"] {
            let surface = sample(name).unwrap_or_default();
            let tree = SurfaceTree::new(&surface, &twins(&surface.triangles));
            let order = tree.bvh.leaf_order();
            let (mut found, mut steps) = (0, 0);
            for (rank, t) in order.iter().enumerate() {
                let [a, b, c] = surface.corners(*t as usize);
                let mut offset = || random.random_range(-0.6..0.6);
                let height = 0.02 * shortest_height_sq([a, b, c]).sqrt();
                let p = (a + b + c) / 3.0
                    + (b - a) * offset()
                    + (c - a) * offset()
                    + doubled_normal([a, b, c]).normalize() * (height * offset());
                let mut end = rank;
                let Some(below) = tree.below(p, &mut end) else { continue };
                assert_eq!(below.triangle, order[end]);
                assert_eq!(tree.bvh.closest(p), Some(below), "{name}, triangle {t}");
                found += 1;
                steps += usize::from(end != rank);
            }
            assert!(3 * found > order.len() && 6 * steps > order.len(), "{found}, {steps} of {name}");
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
