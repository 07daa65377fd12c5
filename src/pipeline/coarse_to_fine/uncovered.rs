//! Uncovered parts of the surface: points without a site nearby, such as the bottoms of folds that edges of
//! the coarser level passed over.

use crate::mesh::kd_tree::KdTree;
use crate::mesh::sizing::SizeField;
use crate::sites::nearby::vertices_without;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::surface::Surface;
use glam::DVec3;
use rayon::prelude::*;

/// A point farther than this many spacings from the nearest site is uncovered; the centre of an even triangle
/// is at 0.58.
const NEAR: f64 = 1.0;
/// At most one new site is added for this many sites.
const RARE: usize = 200;
/// Minimum number of vertices for a thread.
const CHUNK: usize = 512;

/// New sites where `seeds` leave the surface uncovered: vertices of the surface, all farther than a spacing,
/// times the size there, from the seeds and from each other, the farthest first, and at most one for 200
/// seeds.
pub(crate) fn sites_for_uncovered(
    seeds: &SitesOnSurface,
    surface: &Surface,
    sizes: &SizeField,
    spacing: f64,
) -> SitesOnSurface {
    uncovered(seeds, &surface.vertices, &surface.triangles, &|v| NEAR * spacing * sizes.at_vertex(v))
}

fn uncovered(
    seeds: &SitesOnSurface,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    near: &(dyn Fn(u32) -> f64 + Sync),
) -> SitesOnSurface {
    let mut new = SitesOnSurface::default();
    let left = vertices_without(vertices, triangles, (&seeds.positions, &seeds.triangles), near);
    if left.is_empty() {
        return new;
    }
    let tree = KdTree::new(&seeds.positions);
    let share = |v: u32| {
        let p = vertices[v as usize];
        let nearest = tree.nearest(p).map_or(f64::INFINITY, |s| seeds.positions[s as usize].distance(p));
        (nearest / near(v), v)
    };
    let mut far: Vec<(f64, u32)> =
        left.into_par_iter().with_min_len(CHUNK).map(share).filter(|(share, _)| *share > 1.0).collect();
    if far.is_empty() {
        return new;
    }
    far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut triangle_at = vec![0; vertices.len()];
    for (t, triangle) in (0u32..).zip(triangles) {
        triangle.iter().for_each(|v| triangle_at[*v as usize] = t);
    }
    for (_, v) in far {
        let p = vertices[v as usize];
        if new.len() >= seeds.len() / RARE {
            break;
        }
        if new.positions.iter().all(|q| q.distance(p) > near(v)) {
            new.push(p, triangle_at[v as usize]);
        }
    }
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 400 seeds a spacing of 1 apart in a plane, and a surface whose vertices are these and some below them.
    fn scene(below: &[DVec3]) -> (SitesOnSurface, Vec<DVec3>, Vec<[u32; 3]>) {
        let positions: Vec<DVec3> =
            (0..400).map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0)).collect();
        let mut vertices = positions.clone();
        vertices.extend(below);
        let triangles = (400..vertices.len() as u32).map(|v| [0, 1, v]).chain([[0, 1, 20]]).collect();
        (SitesOnSurface { triangles: vec![0; positions.len()], positions }, vertices, triangles)
    }

    fn new_sites(below: &[DVec3]) -> SitesOnSurface {
        let (seeds, vertices, triangles) = scene(below);
        uncovered(&seeds, &vertices, &triangles, &|_| 1.0)
    }

    #[test]
    fn what_is_covered_gets_nothing() {
        assert!(new_sites(&[]).is_empty());
        assert!(new_sites(&[DVec3::new(3.0, 4.0, -0.99)]).is_empty());
    }

    #[test]
    fn the_deepest_points_come_first_and_cover_those_around_them() {
        let at = |x: f64, z: f64| DVec3::new(x, 4.0, z);
        let got = new_sites(&[at(3.0, -1.1), at(3.0, -1.6), at(9.0, -1.2)]);
        assert_eq!(got.positions, [at(3.0, -1.6), at(9.0, -1.2)]);
        assert_eq!(got.triangles, [1, 2]);
    }

    #[test]
    fn there_is_one_for_two_hundred_seeds_at_most() {
        let below: Vec<DVec3> = (0..5).map(|i| DVec3::new(4.0 * f64::from(i), 0.0, -1.5)).collect();
        assert_eq!(new_sites(&below).positions, below[..2]);
    }
}
