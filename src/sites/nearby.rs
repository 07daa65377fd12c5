//! For each vertex of the surface a site near it.

use crate::mesh::NONE;
use crate::mesh::half_edges::par_fold_corners;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Fewer points than this are looked at by one thread.
const FEW: usize = 1024;

/// For each of `vertices` vertices of a surface one of the sites, which stand on the triangles `under`: one
/// that is on a triangle there, or else one that fewest triangles separate from it. [`NONE`] where nothing
/// connects the vertex with a site. Panics if an index is out of range.
pub(crate) fn sites_near_vertices(triangles: &[[u32; 3]], vertices: usize, under: &[u32]) -> Vec<u32> {
    let mut near = vec![NONE; vertices];
    let corners: Vec<[u32; 3]> = under.par_iter().with_min_len(FEW).map(|t| triangles[*t as usize]).collect();
    par_fold_corners(corners.as_flattened(), &mut near, |near, corner| {
        if *near == NONE {
            *near = corner / 3;
        }
    });
    let mut open: Vec<[u32; 3]> = triangles
        .iter()
        .filter(|triangle| triangle.iter().any(|v| near[*v as usize] == NONE))
        .copied()
        .collect();
    loop {
        let mut given = Vec::new();
        open.retain(|triangle| {
            let known = triangle.iter().map(|v| near[*v as usize]).find(|site| *site != NONE);
            given.extend(known.map(|site| (*triangle, site)));
            known.is_none()
        });
        if given.is_empty() {
            return near;
        }
        // Not before, or a site would spread as far as the order of triangles has it.
        given.into_iter().for_each(|(triangle, site)| give(&mut near, triangle, site));
    }
}

/// The vertices of a surface, in ascending order, without a point nearby: none of the points on the triangles
/// at a vertex is within its `distance`. Points on other triangles may be. `under` has the triangle of each
/// point; of those beyond its end nothing is known. Panics if an index is out of range.
pub(crate) fn vertices_without(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    (points, under): (&[DVec3], &[u32]),
    distance: impl Fn(u32) -> f64 + Sync,
) -> Vec<u32> {
    let has_one: Vec<AtomicBool> = vertices.iter().map(|_| AtomicBool::new(false)).collect();
    points.par_iter().zip(under).with_min_len(FEW).for_each(|(point, t)| {
        for v in triangles[*t as usize] {
            if point.distance_squared(vertices[v as usize]) <= distance(v).powi(2) {
                has_one[v as usize].store(true, Ordering::Relaxed);
            }
        }
    });
    (0..).zip(has_one).filter(|(_, has_one)| !has_one.load(Ordering::Relaxed)).map(|(v, _)| v).collect()
}

/// Gives the corners of a triangle that have no site this one.
fn give(near: &mut [u32], triangle: [u32; 3], site: u32) {
    for v in triangle.map(|v| v as usize) {
        if near[v] == NONE {
            near[v] = site;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn vertices_with_a_point_near_on_their_triangles_are_left_out() {
        // Two triangles with an edge in common, and vertices of which none is theirs.
        let vertices = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.1, 0.0)];
        let vertices = vertices.map(|(x, y)| DVec3::new(x, y, 0.0));
        let triangles = [[0, 1, 2], [0, 2, 3]];
        let points = [DVec3::new(1.0, 0.5, 0.0), DVec3::new(3.0, 3.5, 0.0)];
        let without = |under: &[u32], most: f64| {
            vertices_without(&vertices, &triangles, (&points, under), |v| if v == 3 { 9.0 } else { most })
        };
        assert_eq!(without(&[0, 1], 2.0), [1, 4]);
        assert_eq!(without(&[0, 1], 1.0), [0, 1, 2, 4]);
        assert_eq!(without(&[0, 0], 2.0), [1, 3, 4]);
        assert_eq!(without(&[], 2.0), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn all_vertices_of_a_component_have_a_site_that_is_near() {
        let mesh = sample("torus").unwrap_or_default();
        let under: Vec<u32> = (0..40).map(|site| site * 80).collect();
        let near = sites_near_vertices(&mesh.triangles, mesh.vertices.len() + 1, &under);
        let far = |(v, site): (usize, &u32)| {
            mesh.vertices[v].distance(mesh.corners(under[*site as usize] as usize)[0])
        };
        let farthest = near[..mesh.vertices.len()].iter().enumerate().map(far).fold(0.0, f64::max);
        assert!(farthest < 1.0 && near[mesh.vertices.len()] == NONE, "{farthest}");
        for (site, t) in (0..).zip(&under) {
            assert!(mesh.triangles[*t as usize].iter().any(|v| near[*v as usize] == site));
        }
    }
}
