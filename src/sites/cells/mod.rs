//! Exact connected cells: the connected component of each site's restricted Voronoi cell that contains the
//! site.
//!
//! A cell starts in the site's own triangle, clipped by the bisectors with the other sites, and continues
//! across the triangle's edges that remain. A corner between the bisectors with j and k is the triangle (i,
//! j, k) of the dual, and three cells share it. No tangent plane is involved, so creases, thin tips and rough
//! places are treated as smooth ones are; the price is host time that grows with the surface's triangles.
//!
//! No cell crosses the *boundary of its patch*, which is where the surface ends or a curve runs. A site there
//! has one cell, a *sector*, for each side of the patches, and only sites of the same patch cut it.
//!
//! Two figures certify the result: the areas of the cells sum to the surface's, and every corner occurs three
//! times.

mod boundary;
mod clip;
mod fan;
mod known;
mod sectors;
mod surface;
mod tangent;
mod walk;

use super::connect::{ConnectCounts, connect};
use super::fans::Fans;
use crate::mesh::chunks::par_map_chunks;
use crate::mesh::triangle::area;
use crate::{ProgressToken, Result};
pub use boundary::Encroached;
use boundary::PatchBoundary;
use glam::DVec3;
pub use known::KnownCells;
use rayon::prelude::*;
use sectors::Sectors;
use serde::Serialize;
use std::collections::BTreeMap;
pub use surface::{CellSites, CellSurface};
pub use tangent::tangent_cells;
use walk::{Cell, Scene, Uncut, Walk};

/// Maximum number of times that cells that do not fit together are computed again.
const REPAIRS: u32 = 6;
/// Fewer cells than this are looked at by one thread.
const FEW_CELLS: usize = 256;

/// Cells as fans, with their certificate.
#[derive(Debug, Clone, Default)]
pub struct ConnectedCells {
    /// Counter-clockwise neighbours in every sector.
    pub fans: Fans,
    /// Figures that certify them.
    pub certificate: Certificate,
    /// Cells whose outline is not one closed curve, or meets a neighbour twice.
    pub broken: Vec<BrokenCell>,
    /// Where a curve needs more sites, in ascending order. The fans have an edge there all the same.
    pub encroached: Vec<Encroached>,
    /// Whether the triangles are known to be a closed manifold that uses all sites: the surface has no
    /// boundary, and all cells are discs that agree about each corner.
    pub is_closed: bool,
}

/// A cell that is not a disc, or has fewer than three neighbours: there are too few sites around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrokenCell {
    /// The cell's site.
    pub site: u32,
    /// Where another site would help most: far from that site, inside the cell and inside a triangle, which
    /// is given too.
    pub farthest: (DVec3, u32),
}

/// Figures of correct cells are all 0, and `area` is 1 up to rounding.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Certificate {
    /// Sum of the cells' areas relative to the surface's.
    pub area: f64,
    /// Corners that not all three of their cells have.
    pub unshared_corners: usize,
    /// Cells whose outline is not one closed curve, or meets a neighbour twice.
    pub broken_cells: usize,
}

/// The cells of all sites.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn connected_cells(
    surface: &CellSurface,
    sites: &CellSites,
    progress: &ProgressToken,
) -> Result<ConnectedCells> {
    cells_after_moves(surface, sites, &mut KnownCells::default(), progress)
}

/// The same, for sites of which a few may have moved since an earlier call with the same surface, spacing and
/// edge lengths. What is known is kept for the next one if cells are broken.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn cells_after_moves(
    surface: &CellSurface,
    sites: &CellSites,
    known: &mut KnownCells,
    progress: &ProgressToken,
) -> Result<ConnectedCells> {
    let sectors = Sectors::new(surface, sites.places);
    let scene = Scene::new(surface, sites, sectors);
    let compute = |walk: &mut Walk, s: usize| match progress.is_cancelled() {
        true => Cell::default(),
        false => walk.cell(&scene, s, &[]),
    };
    let mut cells: Vec<Cell> = match known.take(&scene) {
        None => (0..scene.sectors.len()).into_par_iter().map_init(Walk::default, compute).collect(),
        Some(cells) => (cells.into_par_iter().enumerate())
            .map_init(Walk::default, |walk, (s, cell)| cell.unwrap_or_else(|| compute(walk, s)))
            .collect(),
    };
    scene.complete(&mut cells, compute);
    progress.poll()?;
    let mut unrepaired = BTreeMap::new();
    let mut all_are_shared = fan::all_are_shared(&scene, &cells);
    if surface.has_boundary || !all_are_shared {
        let all = (0..cells.len()).into_par_iter().with_min_len(FEW_CELLS);
        let mismatched = all.flat_map_iter(|s| fan::one_sided(&scene, &cells, s)).collect();
        unrepaired = repair(&scene, &mut cells, mismatched, progress)?;
        all_are_shared = fan::all_are_shared(&scene, &cells);
    }
    let unshared_corners = if all_are_shared { 0 } else { fan::unshared_corner_count(&scene, &cells) };
    progress.poll()?;
    let whole: f64 = (0..surface.triangles.len()).map(|t| area(surface.corners(t as u32))).sum();
    let boundary = PatchBoundary::new(&scene);
    let (fans, broken, encroached) = fan::fans(&scene, &boundary, &cells);
    let areas = par_map_chunks(cells.len(), |range| cells[range].iter().map(|c| c.area).sum::<f64>());
    let certificate =
        Certificate { area: areas.iter().sum::<f64>() / whole, unshared_corners, broken_cells: broken.len() };
    let broken_cell = |s: usize| BrokenCell { site: scene.sectors.site[s], farthest: cells[s].farthest };
    let broken: Vec<BrokenCell> = broken.into_iter().map(broken_cell).collect();
    let is_whole = all_are_shared && broken.is_empty();
    let is_closed = is_whole && scene.sectors.are_sites && !surface.has_boundary;
    if broken.is_empty() {
        par_drop(cells);
    } else {
        known.keep(&scene, cells, unrepaired);
    }
    Ok(ConnectedCells { fans, certificate, broken, encroached, is_closed })
}

impl ConnectedCells {
    /// The triangles over the sites, with what joining the fans to them found and did.
    pub fn connect(&self, sites: &[DVec3]) -> (Vec<[u32; 3]>, ConnectCounts) {
        let (triangles, counts) = match self.is_closed {
            true => (self.fans.triangles(), ConnectCounts::default()),
            false => connect(sites, &self.fans),
        };
        (triangles, ConnectCounts { cells: Some(self.certificate), ..counts })
    }
}

/// Drops cells by all threads: one alone would take long to free what they have.
fn par_drop(cells: Vec<Cell>) {
    cells.into_par_iter().with_min_len(FEW_CELLS).for_each(drop);
}

/// Near the boundary, and in folds, a site may have cut a cell although a gap or a curve lies between, so
/// that its own cell does not reach there. Such cells are computed again: that site cuts them in the
/// triangles of its own cell only. `mismatched` are the cells to begin with, as [`fan::one_sided`] gives
/// them. Returns those cells as they were.
fn repair(
    scene: &Scene,
    cells: &mut [Cell],
    mut mismatched: Vec<(usize, u32)>,
    progress: &ProgressToken,
) -> Result<BTreeMap<usize, Cell>> {
    let mut unrepaired = BTreeMap::new();
    let sectors = &scene.sectors;
    let one_sided = |cells: &[Cell], s: usize| fan::one_sided(scene, cells, s);
    let mut without: BTreeMap<usize, Vec<Uncut>> = BTreeMap::new();
    for _ in 0..REPAIRS {
        // The other cell may be too large, computed when this one was smaller.
        let uncut_by = |r: usize, i: u32| without.get(&r).is_some_and(|list| list.iter().any(|u| u.by == i));
        let too_large = mismatched.iter().flat_map(|&(s, by)| {
            let i = sectors.site[s];
            let was_without = move |r: &usize| uncut_by(*r, i);
            sectors.in_patch(by, sectors.patch[s]).filter(was_without).map(move |r| (r, i))
        });
        let mut again: Vec<(usize, u32)> = too_large.chain(mismatched.iter().copied()).collect();
        again.sort_unstable();
        again.dedup();
        for (s, by) in &again {
            let theirs = sectors.in_patch(*by, sectors.patch[*s]);
            let mut but_in: Vec<u32> = theirs.flat_map(|r| cells[r].triangles.iter().copied()).collect();
            but_in.sort_unstable();
            let uncut = without.entry(*s).or_default();
            uncut.retain(|u| u.by != *by);
            uncut.push(Uncut { by: *by, but_in });
        }
        again.dedup_by_key(|(s, _)| *s);
        if again.is_empty() {
            break;
        }
        progress.poll()?;
        // What others lack or have cannot change: their edges are in both cells, and with none of these.
        let beside =
            |s: usize| cells[s].edges.iter().flat_map(move |[j, _]| sectors.in_patch(*j, sectors.patch[s]));
        let mut affected: Vec<usize> =
            again.iter().flat_map(|(s, _)| std::iter::once(*s).chain(beside(*s))).collect();
        affected.sort_unstable();
        affected.dedup();
        let compute = |walk: &mut Walk, k: usize| walk.cell(scene, again[k].0, &without[&again[k].0]);
        let mut new: Vec<Cell> = (0..again.len()).into_par_iter().map_init(Walk::default, compute).collect();
        scene.complete(&mut new, compute);
        for ((s, _), cell) in again.into_iter().zip(new) {
            let old = std::mem::replace(&mut cells[s], cell);
            unrepaired.entry(s).or_insert(old);
        }
        mismatched = affected.into_iter().flat_map(|s| one_sided(cells, s)).collect();
    }
    Ok(unrepaired)
}
