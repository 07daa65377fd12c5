//! A copy of the mesh, on which edits are tried.

use std::sync::Arc;

use glam::DVec3;

use super::context::OutlierContext;
use crate::TriMesh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::polish::is_fixed;
use crate::polish::locked::Locked;

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
    pub fn new(
        half_edges: HalfEdgeMesh,
        points: Vec<DVec3>,
        fixed: &[bool],
        context: OutlierContext<'a>,
    ) -> Self {
        let fixed = (0..points.len()).map(|v| is_fixed(&half_edges, fixed, v)).collect();
        Self { context, half_edges, points, fixed }
    }

    pub fn into_mesh(self, mesh: &mut TriMesh) {
        mesh.vertices = self.points;
        mesh.triangles = self.half_edges.triangles;
    }

    pub fn locked(&self) -> Locked<'_> {
        Locked { fixed: &self.fixed, curve_edges: self.context.curve_edges }
    }

    #[inline]
    pub fn corners(&self, t: u32) -> [DVec3; 3] {
        self.half_edges.triangles[t as usize].map(|v| self.points[v as usize])
    }
}
