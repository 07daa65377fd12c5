//! Cells that are as they were before other sites moved.

use super::surface::CellSites;
use super::walk::{Cell, Scene};
use crate::mesh::NONE;
use crate::sites::place::Place;
use glam::DVec3;
use std::collections::BTreeMap;

/// The cells of some sites before they moved, with what they were computed from: if a few sites move, only
/// the cells around them are computed again.
#[derive(Default)]
pub struct KnownCells {
    /// One a sector, without repairs.
    cells: Vec<Cell>,
    /// The site of each sector.
    site: Vec<u32>,
    positions: Vec<DVec3>,
    places: Vec<Place>,
    near: Vec<u32>,
}

impl KnownCells {
    /// Takes the cells out, each of them that would come out the same; `None` if no cell is known.
    pub(super) fn take(&mut self, scene: &Scene) -> Option<Vec<Option<Cell>>> {
        let Self { cells, site, positions, places, near } = std::mem::take(self);
        let sites = scene.sites;
        let n = sites.positions.len();
        if cells.is_empty() || site != scene.sectors.site || near.len() != sites.near.len() {
            return None;
        }
        let stays: Vec<bool> =
            (0..n).map(|i| positions[i] == sites.positions[i] && places[i] == sites.places[i]).collect();
        // Another site that comes near changes the list, unless all sites were looked at.
        let has_same_neighbours = |i: usize| {
            let slots = || (i..near.len()).step_by(n);
            slots().all(|slot| near[slot] == sites.near[slot])
                && slots().map(|slot| near[slot]).filter(|j| *j != NONE).all(|j| stays[j as usize])
        };
        let is_same: Vec<bool> = (0..n).map(|i| stays[i] && has_same_neighbours(i)).collect();
        let keep = |(cell, i): (Cell, u32)| (is_same[i as usize] && !cell.needs_more_sites).then_some(cell);
        Some(cells.into_iter().zip(site).map(keep).collect())
    }

    /// Keeps the cells of some sites; `unrepaired` are those that others have replaced since.
    pub(super) fn keep(&mut self, scene: &Scene, mut cells: Vec<Cell>, unrepaired: BTreeMap<usize, Cell>) {
        unrepaired.into_iter().for_each(|(s, cell)| cells[s] = cell);
        let CellSites { positions, places, near, .. } = scene.sites;
        *self = Self {
            cells,
            site: scene.sectors.site.clone(),
            positions: positions.to_vec(),
            places: places.to_vec(),
            near: near.to_vec(),
        };
    }
}
