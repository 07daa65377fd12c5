//! Holes in the cover: points of the surface that no site is near, as the bottoms of folds that the coarser level's edges
//! ran over.

use crate::mesh::kd_tree::KdTree;
use crate::mesh::sizing::SizeField;
use crate::sites::seed::Seeds;
use crate::sites::surface::Surface;
use glam::DVec3;
use rayon::prelude::*;

/// Spacings that a point of the surface may be from the nearest site; the middle of an even triangle is at 0.58.
const NEAR: f64 = 1.0;
/// One new site for so many at most.
const RARE: usize = 200;
/// Vertices that a thread takes at the least.
const CHUNK: usize = 512;

/// New sites for the holes that `seeds` leave: vertices of a surface, each in some triangle, all farther than a spacing,
/// times the length wanted there, from the seeds and from each other, the farthest first, and no more than one for 200
/// seeds.
pub(crate) fn holes(seeds: &Seeds, surface: &Surface, sizes: &SizeField, spacing: f64) -> Seeds {
    missed(seeds, (&surface.vertices, &surface.triangles), &|v| NEAR * spacing * sizes.at_vertex(v))
}

fn missed(
    seeds: &Seeds,
    (vertices, triangles): (&[DVec3], &[[u32; 3]]),
    near: &(dyn Fn(u32) -> f64 + Sync),
) -> Seeds {
    let mut found = Seeds { sites: Vec::new(), triangles: Vec::new() };
    let tree = KdTree::new(&seeds.sites);
    let distance = |(v, p): (u32, &DVec3)| {
        let nearest = tree.nearest(*p).map_or(f64::INFINITY, |s| seeds.sites[s as usize].distance(*p));
        (nearest / near(v), v)
    };
    let mut bare: Vec<(f64, u32)> = (0u32..vertices.len() as u32)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|v| distance((v, &vertices[v as usize])))
        .filter(|(share, _)| *share > 1.0)
        .collect();
    if bare.is_empty() {
        return found;
    }
    bare.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut under = vec![0; vertices.len()];
    for (t, triangle) in (0u32..).zip(triangles) {
        triangle.iter().for_each(|v| under[*v as usize] = t);
    }
    for (_, v) in bare {
        let p = vertices[v as usize];
        if found.sites.len() >= seeds.sites.len() / RARE {
            break;
        }
        if found.sites.iter().all(|q| q.distance(p) > near(v)) {
            found.sites.push(p);
            found.triangles.push(under[v as usize]);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 400 seeds a spacing of 1 apart in a plane, and a surface whose vertices are these and some below them.
    fn scene(below: &[DVec3]) -> (Seeds, Vec<DVec3>, Vec<[u32; 3]>) {
        let sites: Vec<DVec3> =
            (0..400).map(|i| DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0)).collect();
        let mut vertices = sites.clone();
        vertices.extend(below);
        let triangles = (400..vertices.len() as u32).map(|v| [0, 1, v]).collect();
        (Seeds { triangles: vec![0; sites.len()], sites }, vertices, triangles)
    }

    fn found(below: &[DVec3]) -> Seeds {
        let (seeds, vertices, triangles) = scene(below);
        missed(&seeds, (&vertices, &triangles), &|_| 1.0)
    }

    #[test]
    fn what_is_covered_gets_nothing() {
        assert!(found(&[]).sites.is_empty());
        assert!(found(&[DVec3::new(3.0, 4.0, -0.99)]).sites.is_empty());
    }

    #[test]
    fn the_deepest_points_come_first_and_cover_those_around_them() {
        let at = |x: f64, z: f64| DVec3::new(x, 4.0, z);
        let got = found(&[at(3.0, -1.1), at(3.0, -1.6), at(9.0, -1.2)]);
        assert_eq!(got.sites, [at(3.0, -1.6), at(9.0, -1.2)]);
        assert_eq!(got.triangles, [1, 2]);
    }

    #[test]
    fn there_is_one_for_two_hundred_seeds_at_most() {
        let below: Vec<DVec3> = (0..5).map(|i| DVec3::new(4.0 * f64::from(i), 0.0, -1.5)).collect();
        assert_eq!(found(&below).sites, below[..2]);
    }
}
