//! From the cells' corners to fans: the neighbours of every sector in their order.

use super::border::{Border, Encroached};
use super::walk::{Cell, Scene};
use crate::sites::connect::Fans;
use rayon::prelude::*;

/// The fans of all sectors, the sectors whose cells are not one closed curve, and the curves' stretches in cells of others.
pub(crate) fn fans(scene: &Scene, border: &Border, cells: &[Cell]) -> (Fans, Vec<usize>, Vec<Encroached>) {
    let mut broken = Vec::new();
    let mut encroached = Vec::new();
    let mut open = Vec::new();
    let rings: Vec<Vec<u32>> = cells
        .iter()
        .enumerate()
        .map(|(s, cell)| {
            let Ring { ring, sound, is_open } = ring(scene, border, s, cell, &mut encroached);
            open.push(is_open);
            if !sound {
                broken.push(s);
            }
            ring
        })
        .collect();
    encroached.sort_unstable();
    let one_each = scene.sectors.len() == scene.sites.positions.len();
    let fans = if one_each && !scene.surface.has_border {
        Fans::from_lists(rings)
    } else if one_each && border.is_free() {
        Fans::of_sectors(rings, scene.sectors.site.clone(), open)
    } else {
        let lists = (0..rings.len()).map(|s| sector_fan(scene, border, &rings, s));
        Fans::of_sectors(lists, scene.sectors.site.clone(), open)
    };
    (fans, broken, encroached)
}

/// The neighbours around a sector, as sites, counter-clockwise.
struct Ring {
    /// For a site on the border from the first beside it to the last. Where no site is on the border, those whose cells reach
    /// it take its place.
    ring: Vec<u32>,
    /// Whether the cell's boundary is one closed curve.
    sound: bool,
    /// Whether the ring begins and ends at the border.
    is_open: bool,
}

fn ring(scene: &Scene, border: &Border, s: usize, cell: &Cell, encroached: &mut Vec<Encroached>) -> Ring {
    let mut links = cell.corners.clone();
    let (runs, mut sound) = border.runs(s, cell);
    let mut own = None;
    let stands_for_rim = border.is_free() && runs.len() == 1;
    for run in &runs {
        let [before, after] = run.neighbours;
        if before != after {
            links.push(run.neighbours);
        }
        if stands_for_rim && before != after {
            own = Some(after);
            continue;
        }
        if run.own && scene.sectors.ends[s].is_some() {
            own = Some(after);
            continue;
        }
        let by = scene.sectors.site[s];
        match border.segment(run) {
            Some(segment) if segment.contains(&by) => {}
            Some(segment) => encroached.push(Encroached { segment, by }),
            None => sound = false,
        }
    }
    let is_open = scene.sectors.ends[s].is_some() || (stands_for_rim && own.is_some());
    sound &= is_open == own.is_some();
    if let Some(only) = own.filter(|_| links.is_empty()) {
        return Ring { ring: vec![only], sound, is_open };
    }
    let (mut ring, closed) = order(links);
    if let Some(place) = own.and_then(|first| ring.iter().position(|j| *j == first)) {
        ring.rotate_left(place);
    }
    let enough = is_open || ring.len() > 2;
    Ring { ring, sound: sound && closed && enough, is_open }
}

/// The cyclic order of the neighbours, each followed by the one it shares a corner with; false if the corners do not
/// make one cycle, and then the longest stretch there is.
fn order(mut left: Vec<[u32; 2]>) -> (Vec<u32>, bool) {
    left.sort_unstable();
    left.dedup();
    let total = left.len();
    let mut best = Vec::new();
    let mut sound = true;
    while let Some(&[first, _]) =
        left.iter().find(|c| left.iter().all(|d| d[1] != c[0])).or_else(|| left.first())
    {
        let mut fan = vec![first];
        let mut at = first;
        while let Some(place) = left.iter().position(|c| c[0] == at) {
            at = left.remove(place)[1];
            if at == first {
                break;
            }
            sound &= !fan.contains(&at);
            fan.push(at);
        }
        sound &= at == first;
        if fan.len() > best.len() {
            best = fan;
        }
    }
    let sound = sound && best.len() == total;
    (best, sound)
}

/// The fan of a sector, as sectors: beside a curve it goes from the next site along it to the one before, whatever the
/// cells say.
fn sector_fan(scene: &Scene, border: &Border, rings: &[Vec<u32>], s: usize) -> Vec<u32> {
    let [previous, next] = border.beside(s);
    let mut ring = rings[s].as_slice();
    let site_of = |sector: Option<u32>| sector.map(|r| scene.sectors.site[r as usize]);
    if next.is_some() && ring.first().copied() == site_of(next) {
        ring = &ring[1..];
    }
    if previous.is_some() && ring.last().copied() == site_of(previous) {
        ring = &ring[..ring.len() - 1];
    }
    let mut fan: Vec<u32> = next.into_iter().collect();
    fan.extend(
        ring.iter()
            .filter_map(|j| sector_of_neighbour(scene, rings, s, *j))
            .filter(|r| Some(*r) != next && Some(*r) != previous),
    );
    fan.extend(previous);
    fan
}

/// The sector of site `j` that has a border with sector `s`.
fn sector_of_neighbour(scene: &Scene, rings: &[Vec<u32>], s: usize, j: u32) -> Option<u32> {
    let sectors = &scene.sectors;
    let mut theirs = sectors.in_patch(j, sectors.patch[s]);
    let first = theirs.next()?;
    let fit = |r: usize| (rings[r].contains(&sectors.site[s]), sectors.normal[r].dot(sectors.normal[s]));
    let best = theirs.fold((first, None), |(best, known), r| {
        let known = known.unwrap_or_else(|| fit(best));
        let new = fit(r);
        if new > known { (r, Some(new)) } else { (best, Some(known)) }
    });
    Some(best.0 as u32)
}

/// How many corners not exactly three cells of their patch see.
pub(crate) fn unshared(scene: &Scene, cells: &[Cell]) -> usize {
    let mut corners: Vec<[u32; 4]> = cells
        .par_iter()
        .enumerate()
        .flat_map_iter(|(s, cell)| {
            let (i, patch) = (scene.sectors.site[s], scene.sectors.patch[s]);
            cell.corners.iter().map(move |&[j, k]| {
                let [a, b, c] = smallest_first([i, j, k]);
                [patch, a, b, c]
            })
        })
        .collect();
    corners.par_sort_unstable();
    corners.chunk_by(|a, b| a == b).filter(|same| same.len() != 3).count()
}

/// Sectors, rising, with a site whose cell does not run along theirs where theirs runs along it.
pub(crate) fn one_sided(scene: &Scene, cells: &[Cell]) -> Vec<(usize, u32)> {
    let sectors = &scene.sectors;
    let of_sector = |s: usize| {
        let (i, patch) = (sectors.site[s], sectors.patch[s]);
        let runs_along =
            move |&&[j, t]: &&[u32; 2]| sectors.in_patch(j, patch).any(|r| cells[r].edges.contains(&[i, t]));
        let mut alone: Vec<u32> =
            cells[s].edges.iter().filter(|edge| !runs_along(edge)).map(|[j, _]| *j).collect();
        alone.sort_unstable();
        alone.dedup();
        alone.into_iter().map(move |j| (s, j))
    };
    (0..cells.len()).into_par_iter().flat_map_iter(of_sector).collect()
}

/// Turned so that the smallest index comes first.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}
