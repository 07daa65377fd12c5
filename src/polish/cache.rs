//! What one step of the polish makes of a mesh and the next can use again.

use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;

/// The half-edges of a mesh, and a hierarchy over its triangles, as the last step left them.
///
/// It belongs to one mesh with its patches, on which nothing but [`super::polish`], [`super::fit`] and
/// [`super::reduce_outliers`] may have changed triangles since; its vertices may have moved.
#[derive(Debug, Default)]
pub struct MeshCache {
    /// Without the triangles, which the mesh has.
    half_edges: Option<HalfEdgeMesh>,
    tree: Option<Bvh>,
}

impl MeshCache {
    /// The half-edges of the mesh, which has these triangles over so many vertices; the same as new ones.
    pub(crate) fn take(
        &mut self,
        triangles: Vec<[u32; 3]>,
        vertices: usize,
        patches: &[u32],
    ) -> HalfEdgeMesh {
        match self.half_edges.take() {
            Some(half_edges) => half_edges.with_triangles(triangles),
            None => HalfEdgeMesh::new(triangles, vertices, patches),
        }
    }

    /// Keeps the half-edges of the mesh, and returns its triangles.
    pub(crate) fn keep(&mut self, mut half_edges: HalfEdgeMesh) -> Vec<[u32; 3]> {
        let triangles = std::mem::take(&mut half_edges.triangles);
        self.half_edges = Some(half_edges);
        triangles
    }

    /// Whether there is a hierarchy.
    pub(super) fn has_tree(&self) -> bool {
        self.tree.is_some()
    }

    /// The hierarchy over the triangles where they are now.
    pub(super) fn tree(&mut self, mesh: &TriMesh) -> &Bvh {
        if let Some(tree) = &mut self.tree {
            tree.refit(mesh);
        }
        self.tree.get_or_insert_with(|| Bvh::new(mesh))
    }

    /// The hierarchy, if there is one, as it was when it was last asked for.
    pub(crate) fn into_tree(self) -> Option<Bvh> {
        self.tree
    }
}
