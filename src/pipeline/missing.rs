//! Parts of the surface that a result leaves out.

use crate::mesh::bvh::Bvh;
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::sizing::SizeField;
use crate::sites::nearby::vertices_without;
use crate::{ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// A vertex of the surface farther from the result than this many edge lengths is missing there.
pub(crate) const MISSING: f64 = 1.5;

/// The vertices of `surface` that are farther than [`MISSING`] edges from `result`, which has edges of about
/// `spacing` times their size, the farthest first. `under` has a triangle of the surface near each vertex of
/// the result, or nothing.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn missing_vertices(
    surface: &TriMesh,
    (result, under): (&TriMesh, &[u32]),
    edges: (f64, &SizeField),
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    far_vertices(surface, (result, under), MISSING, edges, progress)
}

/// Like [`missing_vertices`], for the vertices of `surface` that are farther than `most` edges from `result`.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn far_vertices(
    surface: &TriMesh,
    (result, under): (&TriMesh, &[u32]),
    most: f64,
    (spacing, sizes): (f64, &SizeField),
    progress: &ProgressToken,
) -> Result<Vec<u32>> {
    progress.poll()?;
    let most_at = |v: u32| most * spacing * sizes.at_vertex(v);
    // Nearly always there is a vertex near, and no triangle need be looked for. If the result is finer than
    // the surface, there is one on the triangles around.
    let points = (result.vertices.as_slice(), under);
    let left = vertices_without(&surface.vertices, &surface.triangles, points, most_at);
    if left.is_empty() {
        return Ok(left);
    }
    // Otherwise a grid has it.
    let mut grid = HashGrid::new(most * spacing, result.vertices.len());
    (0..).zip(&result.vertices).for_each(|(v, at): (u32, _)| grid.insert(*at, v));
    let has_none = |v: &u32| {
        let (point, most_sq) = (surface.vertices[*v as usize], most_at(*v).powi(2));
        !grid.any(point, |w: u32| result.vertices[w as usize].distance_squared(point) <= most_sq)
    };
    let left: Vec<u32> = left.into_par_iter().filter(has_none).collect();
    if left.is_empty() {
        return Ok(left);
    }
    progress.poll()?;
    let bvh = Bvh::new(result);
    let far = |v: u32| {
        let distance_sq = bvh.closest(surface.vertices[v as usize])?.distance_sq;
        let most_sq = most_at(v).powi(2);
        (distance_sq > most_sq).then_some((distance_sq / most_sq, v))
    };
    let mut far: Vec<(f64, u32)> = left.into_par_iter().filter_map(far).collect();
    progress.poll()?;
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    Ok(far.into_iter().map(|(_, v)| v).collect())
}

/// Cells of the grid in which [`farthest_vertex`] looks have this many times the distance as their side: a
/// point is in up to eight cells, 3.4 on average.
const SIDE: f64 = 4.0;
/// Fewer vertices of the result than this are looked at by one thread.
const FEW: usize = 1024;

/// Vertices of the surface that [`farthest_vertex`] tries at most.
const TRIED: usize = 5_000;
/// One of this many vertices of the result is looked at first, to rule out points where vertices are dense.
const STRIDE: usize = 64;

/// The distance of the farthest vertex of `surface` from `result`, of those tried that are farther than
/// `most`; `None` if none is.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(crate) fn farthest_vertex(
    surface: &TriMesh,
    result: &TriMesh,
    most: f64,
    progress: &ProgressToken,
) -> Result<Option<f64>> {
    let step = surface.vertices.len().div_ceil(TRIED).max(1);
    let tried: Vec<DVec3> = surface.vertices.iter().copied().step_by(step).collect();
    let left = points_without(tried, &result.vertices, most, progress)?;
    if left.is_empty() {
        return Ok(None);
    }
    let bvh = Bvh::new(result);
    progress.poll()?;
    let distance_sq = |point: DVec3| bvh.closest(point).map(|found| found.distance_sq);
    let far: Vec<f64> = left.into_par_iter().filter_map(distance_sq).collect();
    Ok(far.into_iter().filter(|far| *far > most * most).max_by(f64::total_cmp).map(f64::sqrt))
}

/// Those of `points` that none of `vertices` is within `most` of.
///
/// # Errors
/// [`crate::Error::Cancelled`].
fn points_without(
    mut points: Vec<DVec3>,
    vertices: &[DVec3],
    most: f64,
    progress: &ProgressToken,
) -> Result<Vec<DVec3>> {
    // Each vertex is compared with all points of its cell, which would take long where many vertices and many
    // points share one. There, a few of the vertices rule out most of the points first.
    for stride in [STRIDE, 1] {
        if points.is_empty() {
            break;
        }
        progress.poll()?;
        // The grid has the few points, not the many vertices, of which threads look at parts.
        let mut grid = HashGrid::new(SIDE * most, points.len());
        (0..).zip(&points).for_each(|(p, at): (u32, _)| grid.insert_around(*at, most, p));
        let has_one: Vec<AtomicBool> = points.iter().map(|_| AtomicBool::new(false)).collect();
        vertices.par_iter().step_by(stride).with_min_len(FEW).for_each(|vertex| {
            for &p in grid.in_cell(*vertex) {
                if points[p as usize].distance_squared(*vertex) <= most * most {
                    has_one[p as usize].store(true, Ordering::Relaxed);
                }
            }
        });
        let left = points.into_iter().zip(has_one).filter(|(_, has_one)| !has_one.load(Ordering::Relaxed));
        points = left.map(|(point, _)| point).collect();
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn the_farthest_vertex_is_found_if_it_is_far_enough() {
        let surface = sample("genus3").unwrap();
        let mut result = surface.clone();
        // Without the triangles and vertices of one end.
        let last = surface.vertices.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
        let gone = |p: DVec3| p.x > last - 0.3;
        result.triangles.retain(|t| !t.iter().any(|v| gone(surface.vertices[*v as usize])));
        result.vertices.iter_mut().filter(|p| gone(**p)).for_each(|p| *p = surface.vertices[0]);
        let bvh = Bvh::new(&result);
        let distance = |p: &DVec3| bvh.closest(*p).map_or(0.0, |found| found.distance_sq.sqrt());
        let farthest = surface.vertices.iter().map(distance).fold(0.0, f64::max);
        assert!(farthest > 0.2, "{farthest}");
        let find = |result, most| farthest_vertex(&surface, result, most, &ProgressToken::default()).unwrap();
        assert_eq!(find(&result, 0.1), Some(farthest));
        assert_eq!(find(&result, 1.01 * farthest), None);
        assert_eq!(find(&surface, 1e-9), None);
    }

    #[test]
    fn points_are_ruled_out_by_vertices_within_the_distance_only() {
        let [points, vertices] = ["genus3", "torus"].map(|name| sample(name).unwrap().vertices);
        let found =
            |most| points_without(points.clone(), &vertices, most, &ProgressToken::default()).unwrap();
        for most in [0.02, 0.1, 0.5] {
            let is_far = |p: &DVec3| vertices.iter().all(|v| v.distance_squared(*p) > most * most);
            let wanted: Vec<DVec3> = points.iter().copied().filter(is_far).collect();
            assert!((1..points.len()).contains(&wanted.len()), "{} are far", wanted.len());
            assert_eq!(found(most), wanted, "{most}");
        }
    }
}
