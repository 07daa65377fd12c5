//! What one step of the polish makes of a mesh and the next can use again.

use super::Target;
use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;

/// In place of a rank, where a search may begin anywhere.
pub(super) const UNKNOWN: usize = usize::MAX;

/// The half-edges of a mesh, a hierarchy over its triangles, and where its vertices are on the surface, as
/// the last step left them.
///
/// It belongs to one mesh with its patches, on which nothing but [`super::polish`], [`super::fit`] and
/// [`super::reduce_outliers`] may have changed triangles since; its vertices may have moved.
#[derive(Debug, Default)]
pub struct MeshCache {
    /// Without the triangles, which the mesh has.
    half_edges: Option<HalfEdgeMesh>,
    tree: Option<Bvh>,
    /// For each vertex the rank of a triangle of the surface that it is near; empty if that is not known.
    ranks: Vec<usize>,
}

impl MeshCache {
    /// Of a mesh with each vertex on one of these triangles of the surface, or near it.
    pub(crate) fn on(target: &Target, under: &[u32]) -> Self {
        let ranks = target.bvh().rank_of_each();
        let ranks = under.iter().map(|t| ranks[*t as usize] as usize).collect();
        Self { ranks, ..Self::default() }
    }

    /// For each of so many vertices the rank of a triangle near it, or [`UNKNOWN`]. [`MeshCache::keep_ranks`]
    /// gives them back.
    pub(super) fn take_ranks(&mut self, vertices: usize) -> Vec<usize> {
        let mut ranks = std::mem::take(&mut self.ranks);
        ranks.resize(vertices, UNKNOWN);
        ranks
    }

    /// Keeps what [`MeshCache::take_ranks`] returned, as searches left it.
    pub(super) fn keep_ranks(&mut self, ranks: Vec<usize>) {
        self.ranks = ranks;
    }

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
