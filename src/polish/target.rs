//! The surface that a mesh is improved against.

use std::sync::Arc;

use glam::DVec3;

use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::correspondence::Search;
use crate::mesh::triangle::doubled_normal;

/// Height over a triangle below which the closest point is taken to be on it, over the distance to its edges.
const LOW: f64 = 0.1;

/// The surface that a mesh is to approximate, prepared for closest-point queries.
#[derive(Debug, Clone)]
pub struct Target {
    pub(super) bvh: Arc<Bvh>,
    /// Normals of the triangles, with the doubled area as length.
    normals: Arc<Vec<DVec3>>,
    /// Squared shortest height of each triangle.
    heights_sq: Vec<f64>,
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
        Self {
            bvh: Arc::new(Bvh::new(surface)),
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
    /// If `p` is close above the inside of the triangle at `rank`, that is taken for the closest one, which
    /// saves the search; it can only be wrong where two sheets of the surface are closer to each other than
    /// that.
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
        let near = self.bvh.closest_at(*rank, p).filter(|near| {
            let inside = near.barycentric.iter().fold(1.0, |a: f64, b| a.min(*b));
            accept(near.triangle)
                && near.distance_sq <= LOW * LOW * inside * inside * self.heights_sq[near.triangle as usize]
        });
        let found = near.or_else(|| self.bvh.closest_accepted(p, rank, accept))?;
        Some((found.point, self.normals[found.triangle as usize].normalize_or_zero()))
    }
}
