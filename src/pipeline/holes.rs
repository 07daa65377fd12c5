//! Holes in the cover: points of the surface that no site is near, as the bottoms of folds that the coarser level's edges
//! ran over.

use crate::stages::seed::Seeds;
use crate::stages::surface::Surface;
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Spacings that a point of the surface may be from the nearest site; the middle of an even triangle is at 0.58.
const NEAR: f64 = 1.0;
/// One new site for so many at most.
const RARE: usize = 200;

/// New sites for the holes that `seeds` leave: vertices of the surface, all farther than a spacing from the seeds and from
/// each other, the farthest first, and no more than one for 200 seeds.
pub(super) fn holes(seeds: &Seeds, surface: &Surface, spacing: f64) -> Seeds {
    let mut grid = Grid::new(NEAR * spacing, &seeds.sites);
    let mut bare: Vec<(f64, u32)> = (0u32..)
        .zip(&surface.vertices)
        .filter(|(_, p)| !grid.is_near(**p))
        .map(|(v, p)| (grid.distance_sq(*p, 2), v))
        .collect();
    bare.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut under: HashMap<u32, Option<u32>> = bare.iter().map(|(_, v)| (*v, None)).collect();
    if !bare.is_empty() {
        for (t, v) in surface.triangles.iter().enumerate().flat_map(|(t, triangle)| triangle.map(|v| (t, v)))
        {
            under.entry(v).and_modify(|first| *first = first.or(Some(t as u32)));
        }
    }
    let mut found = Seeds { sites: Vec::new(), triangles: Vec::new() };
    for (_, v) in bare {
        let p = surface.vertices[v as usize];
        if found.sites.len() >= seeds.sites.len() / RARE {
            break;
        }
        if let Some(t) = under.get(&v).copied().flatten().filter(|_| !grid.is_near(p)) {
            grid.insert(p);
            found.sites.push(p);
            found.triangles.push(t);
        }
    }
    found
}

/// Points in cubes.
struct Grid {
    side: f64,
    cubes: HashMap<IVec3, Vec<DVec3>>,
}

impl Grid {
    fn new(side: f64, points: &[DVec3]) -> Self {
        let mut grid = Self { side, cubes: HashMap::new() };
        points.iter().for_each(|p| grid.insert(*p));
        grid
    }

    fn cube(&self, p: DVec3) -> IVec3 {
        (p / self.side).floor().as_ivec3()
    }

    fn insert(&mut self, p: DVec3) {
        self.cubes.entry(self.cube(p)).or_default().push(p);
    }

    /// The points in the cubes up to so many from that of `p`, the own cube first.
    fn around(&self, p: DVec3, reach: i32) -> impl Iterator<Item = DVec3> {
        let middle = self.cube(p);
        let steps = -reach..=reach;
        let all = steps.clone().flat_map(move |x| {
            let steps = steps.clone();
            steps.clone().flat_map(move |y| steps.clone().map(move |z| IVec3::new(x, y, z)))
        });
        std::iter::once(IVec3::ZERO)
            .chain(all.filter(|step| *step != IVec3::ZERO))
            .filter_map(move |step| self.cubes.get(&(middle + step)))
            .flatten()
            .copied()
    }

    /// Whether a point is within a side length of `p`.
    fn is_near(&self, p: DVec3) -> bool {
        self.around(p, 1).any(|q| q.distance_squared(p) <= self.side * self.side)
    }

    /// The squared distance to the nearest point in the cubes around `p`; infinite if there is none.
    fn distance_sq(&self, p: DVec3, reach: i32) -> f64 {
        self.around(p, reach).map(|q| q.distance_squared(p)).fold(f64::INFINITY, f64::min)
    }
}
