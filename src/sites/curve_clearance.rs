//! Where there is room for interior sites beside those on curves.

use super::curve_sites::CurveSites;
use super::seed::{Seeds, stratified};
use super::surface::Surface;
use super::surface_curves::SurfaceCurves;
use crate::mesh::sizing::SizeField;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Closer to a curve site than this, in spacings, an interior one is in the way: between two curve sites in a row it would
/// enter the circle over them, and a strip without such room is full with the sites on its rims.
const ROOM: f64 = 0.6;
/// Times that more seeds are tried where many fall near curves.
const TRIES: u32 = 4;

/// The curve sites by where they are.
pub struct CurveClearance<'a> {
    curves: &'a SurfaceCurves,
    sites: &'a CurveSites,
    radius: f64,
    /// Sites by how long their edges are, by powers of two, and by cell.
    cells: BTreeMap<i32, HashMap<[i64; 3], Vec<u32>>>,
}

impl<'a> CurveClearance<'a> {
    /// Around `sites` of this spacing.
    pub fn new(curves: &'a SurfaceCurves, sites: &'a CurveSites, spacing: f64) -> Self {
        let radius = ROOM * spacing;
        let mut room = Self { curves, sites, radius, cells: BTreeMap::new() };
        for (i, (position, size)) in (0..).zip(sites.positions.iter().zip(&sites.sizes)) {
            let power = size.log2().ceil() as i32;
            let cell = room.cell(*position, power);
            room.cells.entry(power).or_default().entry(cell).or_default().push(i);
        }
        room
    }

    fn cell(&self, point: DVec3, power: i32) -> [i64; 3] {
        let side = self.radius * f64::from(power).exp2();
        point.to_array().map(|x| (x / side).floor() as i64)
    }

    /// Whether a site at `point`, on or near triangle `t`, has room: no curve site of its patch is too close.
    pub fn has_room(&self, point: DVec3, t: u32) -> bool {
        let patch = self.curves.patches[t as usize];
        let close = |i: &u32| {
            let site = *i as usize;
            self.sites.positions[site].distance(point) < self.radius * self.sites.sizes[site]
                && self
                    .curves
                    .around(self.sites.places[site])
                    .iter()
                    .any(|t| self.curves.patches[*t as usize] == patch)
        };
        !self.cells.iter().any(|(power, cells)| {
            let own = self.cell(point, *power);
            (0..27).any(|offset: i64| {
                let cell = std::array::from_fn(|axis| own[axis] + offset / [1, 3, 9][axis] % 3 - 1);
                cells.get(&cell).is_some_and(|list| list.iter().any(close))
            })
        })
    }

    /// `count` scattered sites where there is room; if there is none for so many, some without.
    pub fn scattered(&self, surface: &Surface, sizes: &SizeField, count: usize, seed: u64) -> Seeds {
        let mut tried = count;
        for _ in 0..TRIES {
            let all = stratified(surface, sizes, tried, seed);
            let free: Vec<usize> =
                (0..tried).filter(|i| self.has_room(all.sites[*i], all.triangles[*i])).collect();
            if free.len() >= count && count > 0 {
                // Left out evenly in space, which is their order.
                let kept = (0..count).map(|k| free[k * free.len() / count]);
                let (sites, triangles) = kept.map(|i| (all.sites[i], all.triangles[i])).unzip();
                return Seeds { sites, triangles };
            }
            // As many more as have no room, and some for chance.
            tried = (tried * count).div_ceil(free.len().max(1 + count / 4)) + count / 50 + 1;
        }
        stratified(surface, sizes, count, seed)
    }
}
