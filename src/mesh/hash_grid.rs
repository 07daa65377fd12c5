//! Points that are found by their place.

use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Points in cubes.
pub(crate) struct HashGrid {
    side: f64,
    cubes: HashMap<IVec3, Vec<DVec3>>,
}

impl HashGrid {
    pub fn new(side: f64, points: &[DVec3]) -> Self {
        let mut grid = Self { side, cubes: HashMap::new() };
        points.iter().for_each(|p| grid.insert(*p));
        grid
    }

    fn cube(&self, p: DVec3) -> IVec3 {
        (p / self.side).floor().as_ivec3()
    }

    pub fn insert(&mut self, p: DVec3) {
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
    pub fn is_near(&self, p: DVec3) -> bool {
        self.around(p, 1).any(|q| q.distance_squared(p) <= self.side * self.side)
    }
}
