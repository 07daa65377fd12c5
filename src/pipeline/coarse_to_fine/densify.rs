//! More sites where cells are broken: at thin parts, where evenly spaced sites are too few.
//!
//! A cell that reaches around a tube, or over its tip, is not a disc, and its site lacks neighbours there.
//! Adding a site in the farthest part of each such cell, repeatedly, makes all of them discs, as in Delaunay
//! refinement (Boissonnat and Oudot 2005). The added sites are taken from where sites are closest together,
//! so their number stays the same.

use crate::mesh::hash_grid::HashGrid;
use crate::mesh::sizing::SizeField;
use crate::sites::cells::BrokenCell;
use crate::sites::on_surface::SitesOnSurface;
use glam::DVec3;

/// Minimum distance, in spacings, of a moved site from others and from the sites of broken cells.
const APART: f64 = 0.05;
/// At most one of this many sites moves in a round.
const RARE: usize = 10;

/// Connected sites, with what [`densify`] has to know of them.
pub(crate) struct ConnectedSites<'a> {
    pub faces: &'a [[u32; 3]],
    /// Whether each site is fixed; empty if none is.
    pub fixed: &'a [bool],
    pub spacing: f64,
    pub sizes: &'a SizeField,
}

/// Moves sites from where they are closest together into broken cells; false if there are no broken cells or
/// too few sites that may be moved.
pub(crate) fn densify(sites: &mut SitesOnSurface, of: &ConnectedSites, broken: &[BrokenCell]) -> bool {
    let mut destinations: Vec<(DVec3, u32)> = Vec::new();
    let own: Vec<DVec3> = broken.iter().map(|b| sites.positions[b.site as usize]).collect();
    let apart = APART * of.spacing * of.sizes.range()[0];
    let mut taken = HashGrid::new(apart, 2 * own.len());
    own.iter().for_each(|p| taken.insert(*p, *p));
    for BrokenCell { farthest, .. } in broken {
        if !taken.any(farthest.0, |q: DVec3| q.distance_squared(farthest.0) <= apart * apart) {
            taken.insert(farthest.0, farthest.0);
            destinations.push(*farthest);
        }
    }
    let movable = movable(sites, of, broken, destinations.len());
    if destinations.is_empty() || movable.len() < destinations.len() {
        return false;
    }
    for (v, (point, triangle)) in movable.into_iter().zip(destinations) {
        sites.positions[v] = point;
        sites.triangles[v] = triangle;
    }
    true
}

/// At most `count` sites with the shortest edges, relative to the sizes there; none near a broken cell, and
/// no two that share an edge.
fn movable(sites: &SitesOnSurface, of: &ConnectedSites, broken: &[BrokenCell], count: usize) -> Vec<usize> {
    let n = sites.len();
    let lengths = of.sizes.at_all(&sites.positions, &sites.triangles);
    let mut shortest = vec![f64::INFINITY; n];
    let mut rings: Vec<Vec<u32>> = vec![Vec::new(); n];
    for &[a, b, c] in of.faces {
        for [i, j] in [[a, b], [b, c], [c, a]].map(|edge| edge.map(|v| v as usize)) {
            let length_sq = sites.positions[i].distance_squared(sites.positions[j]);
            for v in [i, j] {
                let size_sq = lengths.get(v).map_or(1.0, |size| size * size);
                shortest[v] = shortest[v].min(length_sq / size_sq);
            }
            rings[i].push(j as u32);
            rings[j].push(i as u32);
        }
    }
    let mut taken = of.fixed.to_vec();
    taken.resize(n, false);
    // Two rings: what repairs a cell must not break a neighbouring one.
    let mut around: Vec<u32> = broken.iter().map(|b| b.site).collect();
    for _ in 0..2 {
        around = around.iter().flat_map(|v| rings[*v as usize].iter().chain([v])).copied().collect();
        around.sort_unstable();
        around.dedup();
    }
    around.iter().for_each(|v| taken[*v as usize] = true);
    let mut order: Vec<usize> = (0..n).filter(|v| !taken[*v] && shortest[*v].is_finite()).collect();
    order.sort_by(|a, b| shortest[*a].total_cmp(&shortest[*b]).then(a.cmp(b)));
    let mut chosen = Vec::new();
    for v in order {
        if chosen.len() >= count.min(n / RARE) {
            break;
        }
        if !taken[v] {
            rings[v].iter().for_each(|j| taken[*j as usize] = true);
            chosen.push(v);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `n` + 1 pairs of sites a unit apart, except for the pair 20, which is nearer to 21.
    fn strip(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: u32| f64::from(i) + if i == 20 { 0.3 } else { 0.0 };
        let positions =
            (0..=n).flat_map(|i| [0.0, 1.0].map(|y| DVec3::new(at(i), y, 0.0))).collect::<Vec<_>>();
        let quad = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]];
        (positions, (0..n).flat_map(quad).collect())
    }

    fn densified(broken: &[BrokenCell], fixed: &[bool]) -> Option<Vec<usize>> {
        let (before, faces) = strip(30);
        let mut sites = SitesOnSurface { triangles: vec![0; before.len()], positions: before.clone() };
        let of = ConnectedSites { faces: &faces, fixed, spacing: 1.0, sizes: &SizeField::default() };
        let has_moved = densify(&mut sites, &of, broken);
        let moved: Vec<usize> = (0..before.len()).filter(|v| before[*v] != sites.positions[*v]).collect();
        assert!(moved.iter().all(|v| sites.triangles[*v] == 7) && has_moved != moved.is_empty());
        has_moved.then_some(moved)
    }

    fn broken(site: u32, x: f64) -> BrokenCell {
        BrokenCell { site, farthest: (DVec3::new(x, 0.5, 0.0), 7) }
    }

    #[test]
    fn the_most_crowded_site_moves_to_the_broken_cell() {
        assert_eq!(densified(&[broken(4, 2.4)], &[]), Some(vec![40]));
        // No site next to it is taken away.
        let moved = densified(&[broken(38, 19.4)], &[]).unwrap();
        assert!(moved.len() == 1 && !(35..=42).contains(&moved[0]), "{moved:?}");
    }

    #[test]
    fn fixed_sites_stay_and_one_place_gets_one_site() {
        let fixed: Vec<bool> = (0..62).map(|v| v != 50).collect();
        assert_eq!(densified(&[broken(4, 2.4), broken(5, 2.41)], &fixed), Some(vec![50]));
        assert_eq!(densified(&[broken(4, 2.4), broken(5, 2.6)], &fixed), None);
        assert_eq!(densified(&[], &[]), None);
        // At the site itself, where there is one already.
        let at_site = BrokenCell { site: 4, farthest: (DVec3::new(2.0, 0.01, 0.0), 7) };
        assert_eq!(densified(&[at_site], &[]), None);
    }
}
