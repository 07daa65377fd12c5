//! Whether a changed part is as close to the surface as it was.

use glam::DVec3;

use super::{Mending, STRAY_OF_BOUNDARY};
use crate::local::part::Part;
use crate::local::star_mesh::StarMesh;
use crate::mesh::triangle::closest_on_triangle;

/// Distance from the surface, and of the part before from that after, that does not count, in target lengths.
const NEAR: f64 = 0.1;

impl Mending<'_> {
    /// Whether no triangle is farther from the surface than one was before, nor the part before from it.
    pub fn stays_close(&self, before: &Part, after: &Part) -> bool {
        let old: Vec<[DVec3; 3]> = before.mesh.alive().map(|t| before.mesh.corners(t)).collect();
        let new: Vec<[DVec3; 3]> = after.mesh.alive().map(|t| after.mesh.corners(t)).collect();
        let unit = self.spacing * before.mesh.largest_size();
        // Boundaries may be cut off.
        let near = match self.deviation {
            Some(deviation) => deviation,
            None if before.mesh.has_boundary() => unit * NEAR.max(STRAY_OF_BOUNDARY),
            None => unit * NEAR,
        };
        let is_new = |corners: &&[DVec3; 3]| !old.contains(corners);
        let is_gone = |corners: &&[DVec3; 3]| !new.contains(corners);
        let farthest = |list: &mut dyn Iterator<Item = &[DVec3; 3]>| {
            let samples = list.flat_map(|corners| samples(*corners));
            samples.map(|p| self.target.nearest(p).map_or(0.0, |(q, _)| q.distance(p))).fold(0.0, f64::max)
        };
        let was = farthest(&mut old.iter().filter(is_gone));
        let limit = near.max(was);
        if farthest(&mut new.iter().filter(is_new)) > limit {
            return false;
        }
        let is_covered = |p: DVec3| {
            new.iter()
                .any(|corners| closest_on_triangle(p, *corners).point.distance_squared(p) <= limit * limit)
        };
        old.iter().filter(is_gone).flat_map(|corners| samples(*corners)).all(is_covered)
    }
}

impl StarMesh {
    /// Whether a curve edge has one triangle.
    fn has_boundary(&self) -> bool {
        let on_curve = self.edges().into_iter().filter(|(a, b)| self.curves.contains(*a, *b));
        on_curve.into_iter().any(|(a, b)| {
            let is_whole = !self.is_frozen(a) || !self.is_frozen(b);
            is_whole && self.at_edge(a, b).count() == 1
        })
    }

    /// The largest relative target length.
    fn largest_size(&self) -> f64 {
        if self.sizes.is_empty() { 1.0 } else { self.sizes.iter().copied().fold(0.0, f64::max) }
    }
}

/// Corners, middles of sides and the centre.
fn samples([a, b, c]: [DVec3; 3]) -> [DVec3; 7] {
    [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0]
}
