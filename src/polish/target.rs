//! The surface that a mesh is improved against.

use std::sync::Arc;

use glam::DVec3;

use crate::TriMesh;
use crate::mesh::bvh::{Bvh, PatchTrees};
use crate::mesh::correspondence::SurfaceSearch;
use crate::mesh::half_edges::twins;
use crate::mesh::surface_tree::SurfaceTree;
use crate::mesh::triangle::{closest_on_triangle, doubled_normal};

/// The surface that a mesh is to approximate, prepared for closest-point queries.
#[derive(Debug, Clone)]
pub struct Target {
    pub(super) tree: Arc<SurfaceTree>,
    /// Normals of the triangles, with the doubled area as length.
    normals: Arc<Vec<DVec3>>,
    pub(crate) vertices: Arc<Vec<SurfaceVertex>>,
    /// `None` if all triangles are one patch.
    patches: Option<Arc<Patches>>,
}

/// The patches of a surface.
#[derive(Debug)]
struct Patches {
    /// The patch of each triangle.
    of_triangle: Vec<u32>,
    trees: PatchTrees,
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

    /// Like [`Target::new`], with the [`twins`] of the surface.
    pub(crate) fn with_twins(surface: &TriMesh, twins: &[u32]) -> Self {
        let corners = |t| surface.corners(t);
        let normals: Vec<DVec3> = (0..surface.triangles.len()).map(|t| doubled_normal(corners(t))).collect();
        let vertex = |position: &DVec3| SurfaceVertex { position: *position, normal: DVec3::ZERO, area: 0.0 };
        let mut vertices: Vec<SurfaceVertex> = surface.vertices.iter().map(vertex).collect();
        for (triangle, normal) in surface.triangles.iter().zip(&normals) {
            for v in triangle {
                vertices[*v as usize].normal += *normal;
                vertices[*v as usize].area += normal.length() / 6.0;
            }
        }
        Self {
            tree: Arc::new(SurfaceTree::new(surface, twins)),
            normals: Arc::new(normals),
            vertices: Arc::new(vertices),
            patches: None,
        }
    }

    /// With the patch of each triangle, or none if all are one patch: closest points are then searched in one
    /// patch.
    #[must_use]
    pub fn in_patches(self, of_triangle: Vec<u32>) -> Self {
        if of_triangle.is_empty() {
            return self;
        }
        let trees = PatchTrees::new(&self.tree.bvh, &of_triangle, &self.normals);
        Self { patches: Some(Arc::new(Patches { of_triangle, trees })), ..self }
    }

    /// The same triangles for [`crate::mesh::correspondence::find_correspondence`]; `origin` has for each its
    /// index in the repaired mesh.
    pub(crate) fn searched(&self, origin: &[u32]) -> SurfaceSearch {
        SurfaceSearch {
            bvh: Arc::clone(&self.tree.bvh),
            normals: Arc::clone(&self.normals),
            origin: origin.to_vec(),
        }
    }

    /// The hierarchy over the surface's triangles.
    pub(crate) fn bvh(&self) -> &Bvh {
        &self.tree.bvh
    }

    /// The closest point of the whole surface, with its triangle; `None` for a point that is not finite.
    pub fn nearest(&self, p: DVec3) -> Option<(DVec3, u32)> {
        self.tree.bvh.closest(p).map(|closest| (closest.point, closest.triangle))
    }

    /// The corners of the triangle of `surface`, which is that of the target, at its closest point, and the
    /// barycentric coordinates of that; `None` for a point that is not finite.
    pub(crate) fn corners_near(&self, p: DVec3, surface: &TriMesh) -> Option<([u32; 3], [f64; 3])> {
        let (point, t) = self.nearest(p)?;
        let weights = closest_on_triangle(point, surface.corners(t as usize)).barycentric;
        Some((surface.triangles[t as usize], weights))
    }

    /// The closest point on the triangles of a patch that face the same way as `normal`. The search begins at
    /// `rank`, which becomes the rank of the triangle found.
    pub(crate) fn closest(&self, p: DVec3, normal: DVec3, patch: u32, rank: &mut usize) -> Option<DVec3> {
        self.closest_with_normal(p, normal, patch, rank).map(|(point, _)| point)
    }

    /// Like [`Target::closest`], with the unit normal of the triangle that the point lies on.
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
        let is_facing = |t: u32| self.normals[t as usize].dot(normal) > 0.0;
        let found = match self.patches.as_deref() {
            Some(Patches { of_triangle, trees }) => {
                let accept = |t: u32| of_triangle[t as usize] == patch && is_facing(t);
                self.tree.closest_in_patch(trees, (p, normal), patch, rank, accept)
            }
            None => self.tree.closest_accepted(p, rank, is_facing),
        }?;
        Some((found.point, self.normals[found.triangle as usize].normalize_or_zero()))
    }
}
