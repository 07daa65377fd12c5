//! A copy of the mesh, on which edits are tried.

use std::sync::Arc;

use glam::DVec3;

use super::context::OutlierContext;
use crate::TriMesh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::polish::locked::Locked;
use crate::polish::{MeshCache, is_fixed};

/// A copy of the mesh.
#[derive(Clone)]
pub(crate) struct MeshCopy<'a> {
    pub context: OutlierContext<'a>,
    pub half_edges: HalfEdgeMesh,
    pub points: Vec<DVec3>,
    /// Whether each vertex is fixed; the same for all copies.
    pub fixed: Arc<[bool]>,
}

impl<'a> MeshCopy<'a> {
    pub fn new(mesh: &TriMesh, context: &OutlierContext<'a>, cache: &mut MeshCache) -> Self {
        let half_edges = cache.take(mesh.triangles.clone(), mesh.vertices.len(), &context.options.patches);
        let fixed =
            (0..mesh.vertices.len()).map(|v| is_fixed(&half_edges, &context.options.fixed, v)).collect();
        Self { context: *context, half_edges, points: mesh.vertices.clone(), fixed }
    }

    pub fn into_mesh(self, mesh: &mut TriMesh) {
        mesh.vertices = self.points;
        mesh.triangles = self.half_edges.triangles;
    }

    pub fn locked(&self) -> Locked<'_> {
        Locked { fixed: &self.fixed, curve_edges: &self.context.options.curve_edges }
    }

    #[inline]
    pub fn corners(&self, t: u32) -> [DVec3; 3] {
        self.half_edges.triangles[t as usize].map(|v| self.points[v as usize])
    }
}
