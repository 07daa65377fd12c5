//! What one step of the polish makes of a mesh and the next can use again.

use std::sync::Arc;

use super::Target;
use crate::TriMesh;
use crate::mesh::bvh::Bvh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::twins;
use crate::mesh::surface_tree::SurfaceTree;

/// In place of a rank, where a search may begin anywhere.
pub(super) const UNKNOWN: usize = usize::MAX;

/// The half-edges of a mesh, a hierarchy over its triangles, and where its vertices are on the surface, as
/// the last step left them.
///
/// It belongs to one mesh with its patches and one surface. Nothing but [`super::polish`], [`super::fit`] and
/// [`super::reduce_outliers`] may have changed the mesh's triangles since; its vertices may have moved. After
/// the last of the three it is used up.
#[derive(Debug, Default)]
pub struct MeshCache {
    /// Without the triangles, which the mesh has.
    half_edges: Option<HalfEdgeMesh>,
    tree: Option<SurfaceTree>,
    /// For each vertex the rank of a triangle of the surface that it is near.
    pub(super) ranks: Ranks,
    /// For each vertex of the surface the rank, in [`MeshCache::tree`], of a triangle that it is near.
    pub(super) below: Ranks,
}

/// Ranks at which searches may begin, as the last ones left them.
#[derive(Debug, Default)]
pub(super) struct Ranks(Vec<usize>);

impl Ranks {
    /// This many ranks; [`UNKNOWN`] for those that no search has left.
    pub fn take(&mut self, count: usize) -> Vec<usize> {
        let mut ranks = std::mem::take(&mut self.0);
        ranks.resize(count, UNKNOWN);
        ranks
    }

    /// Keeps them for the next step.
    pub fn keep(&mut self, ranks: Vec<usize>) {
        self.0 = ranks;
    }
}

/// A copy of a mesh starts with an empty one.
impl Clone for MeshCache {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl MeshCache {
    /// Of a mesh with each vertex on one of these triangles of the surface, or near it.
    pub(crate) fn on(target: &Target, under: &[u32]) -> Self {
        let ranks = target.bvh().rank_of_each();
        let ranks = Ranks(under.iter().map(|t| ranks[*t as usize] as usize).collect());
        Self { ranks, ..Self::default() }
    }

    /// The half-edges of the mesh, which has these triangles over this many vertices; the same as new ones.
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

    /// The hierarchy over the triangles where they are now; `half_edges` are the mesh's, if they were taken.
    pub(super) fn tree(&mut self, mesh: &TriMesh, half_edges: Option<&HalfEdgeMesh>) -> &SurfaceTree {
        if let Some(tree) = &mut self.tree {
            tree.refit(mesh);
        }
        let half_edges = half_edges.or(self.half_edges.as_ref());
        self.tree.get_or_insert_with(|| match half_edges {
            Some(half_edges) => SurfaceTree::new(mesh, half_edges.twins()),
            None => SurfaceTree::new(mesh, &twins(&mesh.triangles)),
        })
    }

    /// The hierarchy, if there is one, as it was when it was last asked for.
    pub(crate) fn into_tree(self) -> Option<Bvh> {
        self.tree.map(|tree| Arc::unwrap_or_clone(tree.bvh))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProgressToken;
    use crate::mesh::samples::sample;
    use crate::polish::{
        ConstrainedMesh, FitOptions, OutlierOptions, PolishOptions, fit, polish, reduce_outliers,
    };

    /// The mesh after all steps, with one cache or a new one for each.
    fn made(start: &TriMesh, surface: &TriMesh, threads: usize, shared: bool) -> TriMesh {
        let target = Target::new(surface);
        let mut under = vec![0; start.vertices.len()];
        for (t, triangle) in (0..).zip(&surface.triangles) {
            triangle.iter().for_each(|v| under[*v as usize] = t);
        }
        let cache = if shared { MeshCache::on(&target, &under) } else { MeshCache::default() };
        let mut mesh = ConstrainedMesh { mesh: start.clone(), cache, ..Default::default() };
        let progress = ProgressToken::default();
        let renew = |mesh: &mut ConstrainedMesh| {
            if !shared {
                mesh.cache = MeshCache::default();
            }
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let options = PolishOptions { rounds: 3, ..Default::default() };
            assert!(polish(&mut mesh, &target, &options, &progress).unwrap().flips > 0);
            renew(&mut mesh);
            fit(&mut mesh, &target, &FitOptions::default(), &progress).unwrap();
            renew(&mut mesh);
            let options = OutlierOptions { tolerance: 1e-3, ..Default::default() };
            reduce_outliers(&mut mesh, &target, 0.1, &options, &progress).unwrap();
        });
        mesh.mesh
    }

    #[test]
    fn what_steps_leave_to_each_other_changes_nothing() {
        for name in ["genus3", "open-hemisphere"] {
            let surface = sample(name).unwrap_or_default();
            let alone = made(&surface, &surface, 1, false);
            assert!(alone != surface && made(&surface, &surface, 2, true) == alone, "{name}");
        }
    }

    /// Also of odd meshes, where searches may end elsewhere if they begin elsewhere.
    #[test]
    fn the_number_of_threads_does_not_show() {
        let surface = sample("open-hemisphere").unwrap_or_default();
        let mut start = surface.clone();
        // Two fans that share a vertex, and a triangle less.
        let last = start.vertices.len() as u32 - 1;
        start.triangles.as_flattened_mut().iter_mut().filter(|v| **v == last).for_each(|v| *v = 0);
        start.triangles.swap_remove(start.triangles.len() / 2);
        for shared in [false, true] {
            let alone = made(&start, &surface, 1, shared);
            assert!(alone != start && made(&start, &surface, 3, shared) == alone, "{shared}");
        }
    }
}
