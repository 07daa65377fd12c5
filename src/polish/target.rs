//! The surface that a mesh is improved against.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::TriMesh;
use crate::mesh::bvh::{Bvh, Closest};
use crate::mesh::correspondence::Search;
use crate::mesh::half_edges::twins;
use crate::mesh::triangle::doubled_normal;

/// Height over a triangle below which the closest point is taken to be on it, over the distance to its edges.
const LOW: f64 = 0.1;
/// Triangles that are looked at on the way to the one below a point.
const WALK: usize = 5;
/// Stands for no triangle.
const NOWHERE: u32 = u32::MAX;

/// The surface that a mesh is to approximate, prepared for closest-point queries.
#[derive(Debug, Clone)]
pub struct Target {
    pub(super) bvh: Arc<Bvh>,
    /// Normals of the triangles, with the doubled area as length.
    normals: Arc<Vec<DVec3>>,
    /// Squared shortest height of each triangle.
    heights_sq: Vec<f64>,
    /// For each rank of the hierarchy those of the triangles beside it, each across the side opposite a
    /// corner.
    beside: Arc<Vec<[u32; 3]>>,
    pub(crate) vertices: Vec<SurfaceVertex>,
    /// The patch of each triangle; empty if there is but one.
    patches: Vec<u32>,
}

/// A vertex of the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceVertex {
    pub position: DVec3,
    /// Sum of the normals of its triangles, each with the doubled area as length.
    pub normal: DVec3,
    /// A third of the area of its triangles.
    pub area: f64,
}

impl Target {
    /// Prepares a surface, which must be in the same frame as the meshes. Panics if an index is out of range.
    pub fn new(surface: &TriMesh) -> Self {
        Self::with_twins(surface, &twins(&surface.triangles))
    }

    /// As [`Target::new`], with the [`twins`] of the surface.
    pub(crate) fn with_twins(surface: &TriMesh, twins: &[u32]) -> Self {
        let corners = |t| surface.corners(t);
        let normals: Vec<DVec3> = (0..surface.triangles.len()).map(|t| doubled_normal(corners(t))).collect();
        let heights_sq = normals
            .iter()
            .enumerate()
            .map(|(t, n)| {
                let [a, b, c] = corners(t);
                let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
                n.length_squared() / longest.max(f64::MIN_POSITIVE)
            })
            .collect();
        let vertex = |position: &DVec3| SurfaceVertex { position: *position, normal: DVec3::ZERO, area: 0.0 };
        let mut vertices: Vec<SurfaceVertex> = surface.vertices.iter().map(vertex).collect();
        for (triangle, normal) in surface.triangles.iter().zip(&normals) {
            for v in triangle {
                vertices[*v as usize].normal += *normal;
                vertices[*v as usize].area += normal.length() / 6.0;
            }
        }
        let bvh = Bvh::new(surface);
        Self {
            beside: Arc::new(ranks_beside(&bvh, twins)),
            bvh: Arc::new(bvh),
            normals: Arc::new(normals),
            heights_sq,
            vertices,
            patches: Vec::new(),
        }
    }

    /// With the patch of each triangle: closest points are then searched in one patch.
    #[must_use]
    pub fn in_patches(self, patches: Vec<u32>) -> Self {
        Self { patches, ..self }
    }

    /// The same triangles for [`crate::mesh::correspondence::find_correspondence`]; `origin` has for each its
    /// index in the repaired mesh.
    pub(crate) fn searched(&self, origin: &[u32]) -> Search {
        Search { bvh: Arc::clone(&self.bvh), normals: Arc::clone(&self.normals), origin: origin.to_vec() }
    }

    /// The hierarchy over the surface's triangles.
    pub(crate) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The closest point of the whole surface, with its triangle; `None` for a point that is not finite.
    pub fn nearest(&self, p: DVec3) -> Option<(DVec3, u32)> {
        self.bvh.closest(p).map(|closest| (closest.point, closest.triangle))
    }

    /// The closest point on the triangles of a patch that face the same way as `normal`. The search begins at
    /// `rank`, which becomes the rank of the triangle found.
    pub(crate) fn closest(&self, p: DVec3, normal: DVec3, patch: u32, rank: &mut usize) -> Option<DVec3> {
        self.closest_with_normal(p, normal, patch, rank).map(|(point, _)| point)
    }

    /// As [`Target::closest`], with the unit normal of the triangle that the point lies on.
    ///
    /// If `p` is close above the inside of a triangle, and a short walk leads there from the one at `rank`,
    /// that is taken for the closest one, which saves the search; it can only be wrong where two sheets of
    /// the surface that face the same way are closer to each other than that.
    pub(super) fn closest_with_normal(
        &self,
        p: DVec3,
        normal: DVec3,
        patch: u32,
        rank: &mut usize,
    ) -> Option<(DVec3, DVec3)> {
        if normal == DVec3::ZERO {
            return None;
        }
        let accept = |t: u32| {
            self.normals[t as usize].dot(normal) > 0.0
                && self.patches.get(t as usize).is_none_or(|of_triangle| *of_triangle == patch)
        };
        let below = self.below(p, rank).filter(|below| accept(below.triangle));
        let found = below.or_else(|| self.bvh.closest_accepted(p, rank, accept))?;
        Some((found.point, self.normals[found.triangle as usize].normalize_or_zero()))
    }

    /// The closest point, or any whose squared distance is at most `enough`. The search begins at `rank`,
    /// which becomes the rank of the triangle found; `None` for a point that is not finite.
    pub(super) fn closest_or_near(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<Closest> {
        self.walk(p, rank, |near| near.distance_sq <= enough).or_else(|| self.bvh.closest_from(p, rank))
    }

    /// The squared distance of `p` if it is more than `enough`. The search begins at `rank`, and ends at any
    /// triangle that is near enough.
    pub(super) fn distance_sq_beyond(&self, p: DVec3, rank: &mut usize, enough: f64) -> Option<f64> {
        match self.walk(p, rank, |near| near.distance_sq <= enough) {
            Some(_) => None,
            None => self.bvh.distance_sq_beyond(p, rank, enough),
        }
    }

    /// Walks from the triangle at `rank` to the one that `p` is close above or below the inside of.
    fn below(&self, p: DVec3, rank: &mut usize) -> Option<Closest> {
        self.walk(p, rank, |near| {
            let inside = near.barycentric.iter().fold(1.0, |a: f64, b| a.min(*b));
            let low_sq = LOW * LOW * inside * inside * self.heights_sq[near.triangle as usize];
            inside > 0.0 && near.distance_sq <= low_sq
        })
    }

    /// Walks from the triangle at `rank` towards `p`, up to a triangle whose closest point is the one wanted;
    /// `None` if the walk ends before. `rank` becomes that of the last triangle on the way.
    fn walk(&self, p: DVec3, rank: &mut usize, is_wanted: impl Fn(&Closest) -> bool) -> Option<Closest> {
        let mut from = NOWHERE;
        for _ in 0..WALK {
            let near = self.bvh.closest_at(*rank, p)?;
            if is_wanted(&near) {
                return Some(near);
            }
            // Inside there is no side to leave by, at a corner there are two, and not the one by which the
            // walk came.
            let beside = self.beside[*rank];
            let side = (0..3).find(|k| near.barycentric[*k] <= 0.0 && beside[*k] != from)?;
            if beside[side] == NOWHERE {
                return None;
            }
            from = *rank as u32;
            *rank = beside[side] as usize;
        }
        None
    }
}

/// For each rank of a hierarchy those of the triangles beside it, given the [`twins`] of the surface.
fn ranks_beside(bvh: &Bvh, twins: &[u32]) -> Vec<[u32; 3]> {
    let ranks = bvh.rank_of_each();
    let beside = |t: &u32| {
        // The side opposite a corner begins at the next.
        [1, 2, 0].map(|k| ranks.get(twins[3 * *t as usize + k] as usize / 3).copied().unwrap_or(NOWHERE))
    };
    bvh.leaf_order().par_iter().map(beside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;
    use rand::{RngExt, SeedableRng};

    /// Walks end at the closest point, wherever they begin, if they do not end without one.
    #[test]
    fn short_walks_find_the_closest_point() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        for name in ["bumpy-sphere", "open-hemisphere"] {
            let surface = sample(name).unwrap_or_default();
            let target = Target::new(&surface);
            let order = target.bvh.leaf_order();
            let (mut found, mut steps) = (0, 0);
            for (rank, t) in order.iter().enumerate() {
                let [a, b, c] = surface.corners(*t as usize);
                let size = target.heights_sq[*t as usize].sqrt();
                let mut offset = || random.random_range(-0.6..0.6);
                let p = (a + b + c) / 3.0
                    + (b - a) * offset()
                    + (c - a) * offset()
                    + target.normals[*t as usize].normalize() * (0.02 * offset() * size);
                let mut end = rank;
                let Some(below) = target.below(p, &mut end) else { continue };
                assert_eq!(below.triangle, order[end]);
                assert_eq!(target.bvh.closest(p), Some(below), "{name}, triangle {t}");
                found += 1;
                steps += usize::from(end != rank);
            }
            assert!(3 * found > order.len() && 6 * steps > order.len(), "{found}, {steps} of {name}");
        }
    }

    #[test]
    fn triangles_beside_share_the_side() {
        let surface = sample("open-hemisphere").unwrap_or_default();
        let target = Target::new(&surface);
        let order = target.bvh.leaf_order();
        let corners = |rank: usize| surface.triangles[order[rank] as usize];
        let mut at_boundary = 0;
        for (rank, beside) in target.beside.iter().enumerate() {
            for (k, other) in beside.iter().enumerate() {
                let [p, q] = [1, 2].map(|j| corners(rank)[(k + j) % 3]);
                if *other == NOWHERE {
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
