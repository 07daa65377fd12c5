//! Cells in tangent planes where these agree, and exact cells where they do not.

use super::fan::{all_are_shared, closed_fans, disputed_sites, one_sided};
use super::sectors::Sectors;
use super::surface::{CellSites, CellSurface};
use super::walk::{Cell, Scene, Walk};
use super::{par_drop, repair};
use crate::{ProgressToken, Result};
use rayon::prelude::*;

/// Fewer cells than this are done by one thread.
const FEW: usize = 64;
/// Largest share of the cells that are made exact; with more, it is quicker to make all of them exact.
const MOST_EXACT: f64 = 0.6;
/// Times that exact cells that do not agree are repaired, with those around compared again.
const TRIES: u32 = 3;

/// Triangles over the sites of a closed surface in one patch, from each site's cell in its tangent plane; the
/// sites whose cells do not agree about a corner get exact connected cells. They form a closed manifold that
/// uses all sites. `None` if that many do not agree, if the exact ones among them do not either, or on a
/// surface of another kind: [`super::connected_cells`] does those.
///
/// Where nearly all agree, and cells lie in many triangles, this takes a fifth of the time of exact cells,
/// since the surface is not clipped. Areas certify nothing here.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn tangent_cells(
    surface: &CellSurface,
    sites: &CellSites,
    progress: &ProgressToken,
) -> Result<Option<Vec<[u32; 3]>>> {
    let sectors = Sectors::new(surface, sites.places);
    if surface.has_boundary || !sectors.are_sites || !sectors.in_one_patch {
        return Ok(None);
    }
    let scene = Scene::new(surface, sites, sectors);
    let count = scene.sectors.len();
    let mut cells: Vec<Cell> = (0..count)
        .into_par_iter()
        .with_min_len(FEW)
        .map_init(Walk::default, |walk, s| match progress.is_cancelled() {
            true => Cell::default(),
            false => walk.tangent_cell(&scene, s),
        })
        .collect();
    let (mut left, mut exact) = (TRIES, 0);
    loop {
        progress.poll()?;
        if all_are_shared(&scene, &cells) {
            break;
        }
        let at_odds = disputed_sites(&cells);
        let again: Vec<usize> = at_odds.iter().copied().filter(|s| cells[*s].is_in_tangent_plane).collect();
        exact += again.len();
        if exact as f64 > MOST_EXACT * count as f64 || left == 0 {
            return Ok(None);
        }
        if again.is_empty() {
            left -= 1;
            let mismatched = at_odds.into_iter().flat_map(|s| one_sided(&scene, &cells, s)).collect();
            repair(&scene, &mut cells, mismatched, progress)?;
        }
        let exact_cell = |walk: &mut Walk, k: usize| match progress.is_cancelled() {
            true => Cell::default(),
            false => walk.cell(&scene, again[k], &[]),
        };
        let mut new: Vec<Cell> =
            (0..again.len()).into_par_iter().map_init(Walk::default, exact_cell).collect();
        scene.complete(&mut new, exact_cell);
        again.into_iter().zip(new).for_each(|(s, cell)| cells[s] = cell);
    }
    let (fans, broken) = closed_fans(&cells);
    par_drop(cells);
    Ok(broken.is_empty().then(|| fans.triangles()))
}
