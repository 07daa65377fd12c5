//! Triangles filed by place, to find those that a changed part may run into.

use glam::DVec3;
use std::collections::HashMap;

use crate::local::apart::intersecting;
use crate::local::part::Part;
use crate::local::star_mesh::StarMesh;
use crate::mesh::NONE;

/// Triangles over more cells than this are looked at wherever they are.
const MOST_CELLS: i64 = 64;

/// The triangles of a mesh in the cells of a grid that their boxes overlap. Those that are gone stay filed.
#[derive(Default)]
pub(super) struct Nearby {
    side: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
    large: Vec<u32>,
}

impl Nearby {
    /// All triangles of a mesh, in cells with this side, above 0.
    pub fn new(mesh: &StarMesh, side: f64) -> Self {
        let mut nearby = Self { side, ..Self::default() };
        (0..mesh.triangles.len() as u32).for_each(|t| nearby.add(mesh, t));
        nearby
    }

    pub fn add(&mut self, mesh: &StarMesh, t: u32) {
        let triangle = mesh.triangles[t as usize];
        if triangle[0] == NONE {
            return;
        }
        let Some(cells) = self.cells_of(&mesh.corners(triangle)) else {
            self.large.push(t);
            return;
        };
        cells.for_each(|cell| self.cells.entry(cell).or_default().push(t));
    }

    /// The cells that the box of some points overlaps; `None` if these are many.
    fn cells_of(&self, points: &[DVec3]) -> Option<impl Iterator<Item = [i64; 3]> + use<>> {
        let cell = |p: DVec3| (p / self.side).floor().to_array().map(|c| c as i64);
        let low = cell(points.iter().copied().reduce(DVec3::min)?);
        let high = cell(points.iter().copied().reduce(DVec3::max)?);
        let steps = [0, 1, 2].map(|k| high[k].saturating_sub(low[k]).saturating_add(1));
        let count = steps.iter().fold(1i64, |product, n| product.saturating_mul(*n));
        (count <= MOST_CELLS).then(|| {
            let of = move |i: i64| {
                [low[0] + i % steps[0], low[1] + i / steps[0] % steps[1], low[2] + i / (steps[0] * steps[1])]
            };
            (0..count).map(of)
        })
    }

    /// Whether no more triangles intersect once a part of the mesh has changed, those near it included.
    pub fn stays_apart(&self, mesh: &StarMesh, before: &Part, after: &Part) -> bool {
        let mut near = self.large.clone();
        for triangle in after.mesh.alive() {
            match self.cells_of(&after.mesh.corners(triangle)) {
                Some(cells) => near.extend(cells.filter_map(|cell| self.cells.get(&cell)).flatten()),
                None => return after.stays_apart_from(before),
            }
        }
        near.sort_unstable();
        near.dedup();
        near.retain(|t| mesh.triangles[*t as usize][0] != NONE && !before.has(*t));
        // Vertices of the part keep their numbers there, others come after these.
        let count = after.mesh.points.len().max(before.mesh.points.len()) as u32;
        let number = |v: u32| before.number(v).unwrap_or(count + v);
        let others: Vec<[u32; 3]> = near.iter().map(|t| mesh.triangles[*t as usize].map(number)).collect();
        let with =
            |part: &Part| -> Vec<[u32; 3]> { part.mesh.alive().chain(others.iter().copied()).collect() };
        let at = |part: &StarMesh, v: u32| match v.checked_sub(count) {
            Some(v) => mesh.points[v as usize],
            None => part.points[v as usize],
        };
        let after_count = intersecting(&with(after), |v| at(&after.mesh, v));
        after_count == 0 || after_count <= intersecting(&with(before), |v| at(&before.mesh, v))
    }
}
