//! Finds the places where mesh and surface are far apart.

use glam::DVec3;
use rayon::prelude::*;

use super::context::{FAR, OutlierContext};
use crate::mesh::NONE;
use crate::mesh::bvh::Bvh;
use crate::mesh::chunks::{par_concat, par_map_chunks_of};
use crate::polish::MeshCache;
use crate::polish::cache::UNKNOWN;
use crate::polish::relax::CHUNK;
use crate::polish::target::SurfaceVertex;
use crate::{Result, TriMesh};

/// Maximum number of outliers of a mesh, apart from those for each [`VERTICES_PER_OUTLIER`] vertices.
const MOST_OUTLIERS: usize = 100;
/// A small mesh, which is far off nearly everywhere, has at most one outlier for this many vertices instead
/// of [`MOST_OUTLIERS`].
const MOST_OF_SMALL: usize = 8;
/// Vertices for each further outlier.
const VERTICES_PER_OUTLIER: usize = 100;
/// Vertices for each further outlier if a tolerance is given, which more places may exceed.
const VERTICES_PER_OUTLIER_OF_TOLERANCE: usize = 10;

/// Triangles for each search from which on a tree by their order is enough.
const SEARCHES: usize = 8;

/// A point of the mesh and one of the surface that are too far apart.
pub(crate) struct FarPlace {
    distance: f64,
    pub triangle: u32,
    /// From the mesh to the surface.
    pub offset: DVec3,
    /// On the surface.
    pub at: DVec3,
}

/// What is found of a mesh.
pub(crate) struct Found {
    /// Places that are too far apart, the farthest first.
    pub places: Vec<FarPlace>,
    /// For each of the surface's vertices the triangle that is the closest, [`NONE`] if there is none.
    pub closest: Vec<u32>,
    /// For each triangle the rank of one of the surface's that is near its centroid.
    pub ranks: Vec<u32>,
}

/// Finds the places where mesh and surface are too far apart.
pub(crate) fn find(mesh: &TriMesh, context: &OutlierContext, cache: &mut MeshCache) -> Result<Found> {
    let OutlierContext { target, options, lengths, edge, progress, .. } = *context;
    // A good tree pays for many searches only, and triangles are about in order.
    let few = SEARCHES * target.vertices.len() < mesh.triangles.len();
    let known = cache.ranks.take(mesh.vertices.len());
    let below = cache.below.take(target.vertices.len());
    let in_order = (few && !cache.has_tree()).then(|| Bvh::in_order(mesh));
    let bvh = in_order.as_ref().unwrap_or_else(|| &cache.tree(mesh, None).bvh);
    progress.poll()?;
    let shortest = lengths.iter().copied().reduce(f64::min).unwrap_or(1.0);
    let least = (FAR * edge * shortest).min(options.tolerance).powi(2);
    // Which triangle is near enough depends on where a search begins, so the chunks are fixed.
    let near = |(vertices, below): (&[SurfaceVertex], &[usize])| {
        let mut rank = 0;
        let near = |(vertex, below): (&SurfaceVertex, &usize)| {
            rank = if *below == UNKNOWN { rank } else { *below };
            bvh.closest_or_near(vertex.position, &mut rank, least)
        };
        vertices.iter().zip(below).map(near).collect::<Vec<_>>()
    };
    let chunks = target.vertices.par_chunks(CHUNK).zip(below.par_chunks(CHUNK));
    let inward: Vec<_> = chunks.flat_map_iter(near).collect();
    let mut outliers = Vec::new();
    for (p, found) in inward.iter().enumerate() {
        let Some(found) = found else { continue };
        if found.distance_sq > context.tolerance_sq(mesh.triangles[found.triangle as usize]) {
            let at = target.vertices[p].position;
            let offset = at - found.point;
            outliers.push(FarPlace { distance: offset.length(), triangle: found.triangle, offset, at });
        }
    }
    progress.poll()?;
    // Of a vertex that is near enough for any triangle, none of its triangles need look. Where a search ends
    // depends on where it begins, too.
    let near = par_map_chunks_of(CHUNK, mesh.vertices.len(), |range| {
        let mut rank = 0;
        let mut near = |v: usize| {
            rank = if known[v] == UNKNOWN { rank } else { known[v] };
            let near = target.tree.closest_or_near(mesh.vertices[v], &mut rank, least);
            near.filter(|near| near.distance_sq <= least).map_or(NONE, |_| rank as u32)
        };
        range.map(&mut near).collect::<Vec<u32>>()
    });
    let near = NearVertices { ranks: par_concat(&near), least };
    let outward = par_map_chunks_of(CHUNK, mesh.triangles.len(), |range| {
        let (mut rank, mut places) = (0, Vec::new());
        let outward = |t: usize| {
            places.extend(outward(mesh, &near, context, t as u32, &mut rank));
            rank as u32
        };
        let ranks: Vec<u32> = range.map(outward).collect();
        (places, ranks)
    });
    let (places, ranks): (Vec<Vec<FarPlace>>, Vec<Vec<u32>>) = outward.into_iter().unzip();
    outliers.extend(places.into_iter().flatten());
    let ranks = par_concat(&ranks);
    outliers.sort_by(|a, b| b.distance.total_cmp(&a.distance).then(a.triangle.cmp(&b.triangle)));
    let is_asked_for = options.tolerance.is_finite();
    let per_outlier = if is_asked_for { VERTICES_PER_OUTLIER_OF_TOLERANCE } else { VERTICES_PER_OUTLIER };
    let vertices = mesh.vertices.len();
    outliers.truncate(MOST_OUTLIERS.min(vertices / MOST_OF_SMALL) + vertices / per_outlier);
    let closest = inward.into_iter().map(|found| found.map_or(NONE, |found| found.triangle)).collect();
    Ok(Found { places: outliers, closest, ranks })
}

/// Vertices of the mesh that are near enough to the surface for any triangle.
struct NearVertices {
    /// For each vertex the rank of a triangle of the surface that it is near, [`NONE`] if it is near none.
    ranks: Vec<u32>,
    /// The squared distance within which that is.
    least: f64,
}

impl NearVertices {
    fn is_near(&self, v: u32) -> bool {
        self.ranks[v as usize] != NONE
    }

    /// The rank of a triangle of the surface that all of `t` is near. The distance from a triangle is a
    /// convex function, so nothing in between is farther than the corners are.
    fn near_all_of(&self, t: [u32; 3], corners: [DVec3; 3], bvh: &Bvh) -> Option<usize> {
        let ranks = t.map(|v| self.ranks[v as usize]);
        let rank = ranks[0] as usize;
        let is_near = |k: usize| {
            ranks[k] == ranks[0]
                || bvh.closest_at(rank, corners[k]).is_some_and(|near| near.distance_sq <= self.least)
        };
        (ranks[0] != NONE && is_near(1) && is_near(2)).then_some(rank)
    }
}

/// The farthest of a triangle's samples, if it is beyond the tolerance; corners that are near are not.
fn outward(
    mesh: &TriMesh,
    near: &NearVertices,
    context: &OutlierContext,
    t: u32,
    rank: &mut usize,
) -> Option<FarPlace> {
    let corners = mesh.triangles[t as usize];
    if let Some(of_all) = near.near_all_of(corners, mesh.corners(t as usize), context.target.bvh()) {
        *rank = of_all;
        return None;
    }
    // Closer than where the search for the triangle before ended.
    if near.is_near(corners[0]) {
        *rank = near.ranks[corners[0] as usize] as usize;
    }
    let least = context.tolerance_sq(corners);
    let is_near = |k: usize| corners.get(k).is_some_and(|v| near.is_near(*v));
    let left = samples(mesh.corners(t as usize)).into_iter().enumerate().filter(|(k, _)| !is_near(*k));
    let outliers = left.filter_map(|(_, p)| {
        let found = context.target.tree.closest_or_near(p, rank, least)?;
        let (distance, offset) = (found.distance_sq.sqrt(), found.point - p);
        (found.distance_sq > least).then_some(FarPlace { distance, triangle: t, offset, at: found.point })
    });
    outliers.max_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// The sample points of a triangle.
fn samples([a, b, c]: [DVec3; 3]) -> [DVec3; 7] {
    [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) / 3.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::half_edges::EdgeSet;
    use crate::mesh::samples::sample;
    use crate::polish::Target;
    use crate::polish::outliers::context::OutlierOptions;
    use crate::{ProgressToken, mesh};

    #[test]
    fn the_number_of_threads_does_not_show() {
        // Vertices in order along the surface, so that each search begins near its end.
        let surface = sample("genus3").unwrap();
        let coarse = mesh::simplify::with_vertices(
            &surface,
            mesh::simplify::Preserved::default(),
            300,
            &ProgressToken::default(),
        );
        let coarse = coarse.unwrap().mesh;
        let (target, options) = (Target::new(&surface), OutlierOptions::default());
        let progress = ProgressToken::default();
        let (target, options, curve_edges, progress) = (&target, &options, &EdgeSet::new(), &progress);
        let context = OutlierContext { target, options, curve_edges, lengths: &[], edge: 1.0, progress };
        let found = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let Found { closest, ranks, .. } =
                pool.install(|| find(&coarse, &context, &mut MeshCache::default())).unwrap();
            (closest, ranks)
        };
        let alone = found(1);
        for threads in [2, 3, 8] {
            assert_eq!(found(threads), alone, "{threads} threads");
        }
    }
}
