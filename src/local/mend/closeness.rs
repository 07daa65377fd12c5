//! Whether a changed part is as close to the surface as it was.

use glam::DVec3;

use super::Mending;
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
        // Ragged boundaries may be cut off.
        let near = self.deviation.unwrap_or(unit * NEAR.max(self.stray_of_boundary(&before.mesh)));
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

    /// How far a boundary of the part may be from its edges, in spacings; 0 without any.
    fn stray_of_boundary(&self, part: &StarMesh) -> f64 {
        let of_edge = |(a, b): (u32, u32)| {
            let is_whole = !part.is_frozen(a) || !part.is_frozen(b);
            let curve =
                part.curves.get(a, b).filter(|_| is_whole && part.at_edge_in_any_order(a, b).count() == 1);
            curve.map_or(0.0, |curve| self.stray(Some(curve)))
        };
        part.edges().into_iter().map(of_edge).fold(0.0, f64::max)
    }
}

impl StarMesh {
    /// The largest relative target length.
    fn largest_size(&self) -> f64 {
        if self.sizes.is_empty() { 1.0 } else { self.sizes.iter().copied().fold(0.0, f64::max) }
    }
}

/// Corners, middles of sides and the centre.
fn samples([a, b, c]: [DVec3; 3]) -> [DVec3; 7] {
    [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0]
}
