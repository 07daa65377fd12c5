//! From the cells' corners to fans: the neighbours of every sector in cyclic order.

use super::FEW_CELLS;
use super::boundary::{Encroached, PatchBoundary};
use super::walk::{Cell, Few, Scene};
use crate::mesh::chunks::par_map_chunks;
use crate::sites::fans::{Fans, FansPart};
use rayon::prelude::*;
use smallvec::smallvec;

/// The fans of all sectors, the sectors whose cells are broken, and the curve segments in cells of other
/// sites.
pub(crate) fn fans(
    scene: &Scene,
    boundary: &PatchBoundary,
    cells: &[Cell],
) -> (Fans, Vec<usize>, Vec<Encroached>) {
    let one_each = scene.sectors.are_sites;
    if one_each && !scene.surface.has_boundary {
        let (fans, broken) = closed_fans(cells);
        return (fans, broken, Vec::new());
    }
    let mut rings: Vec<Ring> =
        cells.par_iter().enumerate().map(|(s, cell)| ring(scene, boundary, s, cell)).collect();
    let broken = (0..).zip(&rings).filter(|(_, ring)| !ring.is_sound).map(|(s, _)| s).collect();
    let mut encroached: Vec<Encroached> =
        rings.iter_mut().flat_map(|ring| std::mem::take(&mut ring.encroached)).collect();
    encroached.sort_unstable();
    let open: Vec<bool> = rings.iter().map(|ring| ring.is_open).collect();
    let rings: Vec<Few<u32>> = rings.into_iter().map(|ring| ring.ring).collect();
    let fans = if one_each && boundary.is_free() {
        Fans::of_sectors(rings, scene.sectors.site.clone(), open)
    } else {
        let lists = (0..rings.len()).map(|s| sector_fan(scene, boundary, &rings, s));
        Fans::of_sectors(lists, scene.sectors.site.clone(), open)
    };
    (fans, broken, encroached)
}

/// Like [`fans`], for sites with a sector each on a surface without boundary.
pub(crate) fn closed_fans(cells: &[Cell]) -> (Fans, Vec<usize>) {
    let (parts, broken): (Vec<FansPart>, Vec<Vec<usize>>) = par_map_chunks(cells.len(), |range| {
        let (mut part, mut broken) = (FansPart::default(), Vec::new());
        for s in range {
            let (ring, is_cycle) = order(&cells[s].corners);
            if !is_cycle || ring.len() < 3 {
                broken.push(s);
            }
            part.neighbours.extend_from_slice(&ring);
            part.counts.push(ring.len() as u32);
        }
        (part, broken)
    })
    .into_iter()
    .unzip();
    (Fans::from_parts(parts), broken.concat())
}

/// The neighbours around a sector, as sites, counter-clockwise.
struct Ring {
    /// For a site on the boundary from the first neighbour along it to the last. Where no site is on the
    /// boundary, the same holds for sites whose cells reach it.
    ring: Few<u32>,
    /// Whether the cell's outline is one closed curve.
    is_sound: bool,
    /// Whether the ring begins and ends at the boundary.
    is_open: bool,
    /// Curve segments of other sites in the cell.
    encroached: Vec<Encroached>,
}

fn ring(scene: &Scene, boundary: &PatchBoundary, s: usize, cell: &Cell) -> Ring {
    let mut encroached = Vec::new();
    let mut links = cell.corners.clone();
    let (runs, mut is_sound) = boundary.runs_of_cell(s, cell);
    let mut first = None;
    let spans_boundary = boundary.is_free() && runs.len() == 1;
    for run in &runs {
        let [before, after] = run.neighbours;
        if before != after {
            links.push(run.neighbours);
        }
        if spans_boundary && before != after {
            first = Some(after);
            continue;
        }
        if run.own && scene.sectors.ends[s].is_some() {
            first = Some(after);
            continue;
        }
        let by = scene.sectors.site[s];
        match boundary.segment(run) {
            Some(segment) if segment.contains(&by) => {}
            Some(segment) => encroached.push(Encroached { segment, by }),
            None => is_sound = false,
        }
    }
    let is_open = scene.sectors.ends[s].is_some() || (spans_boundary && first.is_some());
    is_sound &= is_open == first.is_some();
    if let Some(only) = first.filter(|_| links.is_empty()) {
        return Ring { ring: smallvec![only], is_sound, is_open, encroached };
    }
    let (mut ring, closed) = order(&links);
    if let Some(place) = first.and_then(|first| ring.iter().position(|j| *j == first)) {
        ring.rotate_left(place);
    }
    let enough = is_open || ring.len() > 2;
    Ring { ring, is_sound: is_sound && closed && enough, is_open, encroached }
}

/// The cyclic order of the neighbours, each followed by the one it shares a corner with; false if the corners
/// do not form one cycle, and then the longest chain there is.
fn order(links: &[[u32; 2]]) -> (Few<u32>, bool) {
    if let Some(cycle) = cycle(links) {
        return (cycle, true);
    }
    let mut left: Few<[u32; 2]> = links.iter().copied().collect();
    left.sort_unstable();
    left.dedup();
    let total = left.len();
    let mut best = Few::new();
    let mut sound = true;
    while let Some(&[first, _]) =
        left.iter().find(|c| left.iter().all(|d| d[1] != c[0])).or_else(|| left.first())
    {
        let mut fan: Few<u32> = smallvec![first];
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

/// The neighbours from the smallest on, if the corners form one cycle.
fn cycle(links: &[[u32; 2]]) -> Option<Few<u32>> {
    let first = links.iter().map(|link| link[0]).min()?;
    let mut cycle = Few::new();
    let mut at = first;
    // What comes back after as many steps as there are corners has been through all of them.
    for _ in links {
        cycle.push(at);
        at = links.iter().find(|link| link[0] == at)?[1];
        if at == first {
            break;
        }
    }
    (at == first && cycle.len() == links.len()).then_some(cycle)
}

/// The fan of a sector, as sectors: at a curve it runs from the next site along it to the previous one, even
/// if the cells disagree.
fn sector_fan(scene: &Scene, boundary: &PatchBoundary, rings: &[Few<u32>], s: usize) -> Few<u32> {
    let [previous, next] = boundary.beside(s);
    let mut ring = rings[s].as_slice();
    let site_of = |sector: Option<u32>| sector.map(|r| scene.sectors.site[r as usize]);
    if next.is_some() && ring.first().copied() == site_of(next) {
        ring = &ring[1..];
    }
    if previous.is_some() && ring.last().copied() == site_of(previous) {
        ring = &ring[..ring.len() - 1];
    }
    let mut fan: Few<u32> = next.into_iter().collect();
    fan.extend(
        ring.iter()
            .filter_map(|j| sector_of_neighbour(scene, rings, s, *j))
            .filter(|r| Some(*r) != next && Some(*r) != previous),
    );
    fan.extend(previous);
    fan
}

/// The sector of site `j` that is adjacent to sector `s`.
fn sector_of_neighbour(scene: &Scene, rings: &[Few<u32>], s: usize, j: u32) -> Option<u32> {
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

/// Whether the three cells at each corner all have it, and have it once, of sites with a sector each: nearly
/// always, and quickly found.
pub(crate) fn all_are_shared(scene: &Scene, cells: &[Cell]) -> bool {
    let sectors = &scene.sectors;
    let has_once = |s: usize, j: u32, corner: [u32; 2]| {
        let mut theirs = sectors.of(j);
        theirs.len() == 1
            && theirs.next().is_some_and(|r| {
                sectors.patch[r] == sectors.patch[s]
                    && cells[r].corners.iter().filter(|other| **other == corner).count() == 1
            })
    };
    // Each is looked up once, from its smallest site; then there may be no more than three times as many.
    let looked_up = |(s, cell): (usize, &Cell)| {
        let i = sectors.site[s];
        let own = cell.corners.iter().filter(|[j, k]| i < *j && i < *k);
        own.map(|&[j, k]| {
            let is_shared =
                j != k && has_once(s, i, [j, k]) && has_once(s, j, [k, i]) && has_once(s, k, [i, j]);
            is_shared.then_some(1)
        })
        .sum::<Option<usize>>()
    };
    let cells_of = || cells.par_iter().with_min_len(FEW_CELLS);
    let shared = cells_of().enumerate().map(looked_up).try_reduce(|| 0, |a, b| Some(a + b));
    shared.is_some_and(|shared| 3 * shared == cells_of().map(|cell| cell.corners.len()).sum::<usize>())
}

/// The sites, each with one cell, of corners that not all three cells have once, in ascending order; those
/// without corners, too.
pub(crate) fn disputed_sites(cells: &[Cell]) -> Vec<usize> {
    let has_once = |s: u32, corner: [u32; 2]| {
        cells[s as usize].corners.iter().filter(|other| **other == corner).count() == 1
    };
    let of_cell = |(s, cell): (usize, &Cell)| {
        let i = s as u32;
        let is_shared =
            |&[j, k]: &[u32; 2]| j != k && has_once(i, [j, k]) && has_once(j, [k, i]) && has_once(k, [i, j]);
        let mut at_odds = Vec::new();
        for corner in cell.corners.iter().filter(|corner| !is_shared(corner)) {
            at_odds.extend([s, corner[0] as usize, corner[1] as usize]);
        }
        if cell.corners.is_empty() {
            at_odds.push(s);
        }
        at_odds
    };
    let mut at_odds: Vec<usize> =
        cells.par_iter().enumerate().with_min_len(FEW_CELLS).flat_map_iter(of_cell).collect();
    at_odds.par_sort_unstable();
    at_odds.dedup();
    at_odds
}

/// The number of corners that not exactly three cells of their patch have: 0 if [`all_are_shared`].
pub(crate) fn unshared_corner_count(scene: &Scene, cells: &[Cell]) -> usize {
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
    corners.par_chunk_by(|a, b| a == b).filter(|same| same.len() != 3).count()
}

/// A sector with each of the neighbours, in ascending order, whose cell lacks the edge between them. Cells in
/// tangent planes have no edges to be compared.
pub(crate) fn one_sided(
    scene: &Scene,
    cells: &[Cell],
    s: usize,
) -> impl Iterator<Item = (usize, u32)> + use<> {
    let sectors = &scene.sectors;
    let (i, patch) = (sectors.site[s], sectors.patch[s]);
    let has = |r: usize, edge: [u32; 2]| cells[r].is_in_tangent_plane || cells[r].edges.contains(&edge);
    let runs_along = |&&[j, t]: &&[u32; 2]| sectors.in_patch(j, patch).any(|r| has(r, [i, t]));
    let mut alone: Vec<u32> =
        cells[s].edges.iter().filter(|edge| !runs_along(edge)).map(|[j, _]| *j).collect();
    alone.sort_unstable();
    alone.dedup();
    alone.into_iter().map(move |j| (s, j))
}

/// Rotated so that the smallest index comes first.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::super::sectors::Sectors;
    use super::super::surface::{CellSites, CellSurface};
    use super::*;
    use crate::sites::place::Place;
    use glam::DVec3;

    #[test]
    fn corners_that_are_missing_or_there_twice_are_counted() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let surface = CellSurface::new(&vertices, &triangles, &[DVec3::Z; 4]);
        let places = [0, 1, 2, 3].map(Place::Inside);
        let sectors = Sectors::new(&surface, &places);
        let sites =
            CellSites { positions: &vertices, places: &places, near: &[], spacing: 1.0, lengths: &[] };
        let scene = Scene::new(&surface, &sites, sectors);
        // As if the triangles were the corners of three cells each.
        let cell = |site: u32| {
            let mut cell = Cell::default();
            for [a, b, c] in triangles {
                let turns = [[a, b, c], [b, c, a], [c, a, b]];
                cell.corners
                    .extend(turns.iter().filter(|turn| turn[0] == site).map(|turn| [turn[1], turn[2]]));
            }
            cell
        };
        let cells = || -> Vec<Cell> { (0..4).map(cell).collect() };
        assert!(unshared_corner_count(&scene, &cells()) == 0 && all_are_shared(&scene, &cells()));
        let mut missing = cells();
        missing[2].corners.pop();
        assert!(unshared_corner_count(&scene, &missing) == 1 && !all_are_shared(&scene, &missing));
        let mut twice = cells();
        let again = twice[3].corners[0];
        twice[3].corners.push(again);
        assert!(unshared_corner_count(&scene, &twice) == 1 && !all_are_shared(&scene, &twice));
        let mut turned = cells();
        turned[1].corners[1].reverse();
        assert!(unshared_corner_count(&scene, &turned) == 2 && !all_are_shared(&scene, &turned));
    }

    #[test]
    fn corners_that_form_one_cycle_are_in_order_from_the_smallest_neighbour() {
        let closed = |links: &[[u32; 2]]| order(links).1.then(|| order(links).0.to_vec());
        assert_eq!(closed(&[[5, 2], [9, 5], [2, 9]]), Some(vec![2, 9, 5]));
        assert_eq!(closed(&[[1, 2], [2, 1]]), Some(vec![1, 2]));
        assert_eq!(closed(&[[3, 3]]), Some(vec![3]));
        // None; open; two cycles; twice the same neighbour; the same corner twice, which counts once.
        assert_eq!(closed(&[]), Some(vec![]));
        assert_eq!(closed(&[[1, 2], [2, 3]]), None);
        assert_eq!(closed(&[[1, 2], [2, 1], [3, 4], [4, 3]]), None);
        assert_eq!(closed(&[[1, 2], [2, 3], [3, 2], [2, 1]]), None);
        assert_eq!(closed(&[[1, 2], [2, 3], [1, 2], [3, 1]]), Some(vec![1, 2, 3]));
    }
}
