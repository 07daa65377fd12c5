//! More sites where cells are broken: at thin parts that sites equally far apart leave too few for.
//!
//! A cell that runs around a tube, or over the tip of one, is no disc, and its site misses neighbours there. Another site in
//! the farthest part of each such cell, again and again, ends with discs, as in Delaunay refinement (Boissonnat and Oudot
//! 2005). The sites come from where they are closest together, so their number stays.

use crate::mesh::hash_grid::HashGrid;
use crate::mesh::sizing::SizeField;
use crate::sites::cells::BrokenCell;
use glam::DVec3;

/// A site nearer to another than this many spacings would be another one of the same cell's troubles.
const APART: f64 = 0.05;
/// No more than one site of so many moves in a round.
const RARE: usize = 10;

/// The sites of a level, which it may move.
pub(crate) struct Movable<'a> {
    pub positions: &'a mut [DVec3],
    /// The triangle under each.
    pub under: &'a mut [u32],
    /// Those that stay.
    pub fixed: &'a [bool],
}

/// Moves sites from where they are closest together into broken cells; false if none or too few can be.
pub(crate) fn densify(
    sites: &mut Movable,
    triangles: &[[u32; 3]],
    broken: &[BrokenCell],
    (spacing, sizes): (f64, &SizeField),
) -> bool {
    let mut wanted: Vec<(DVec3, u32)> = Vec::new();
    let own: Vec<DVec3> = broken.iter().map(|b| sites.positions[b.site as usize]).collect();
    let mut taken = HashGrid::new(APART * spacing * sizes.range()[0], &own);
    for BrokenCell { farthest, .. } in broken {
        if !taken.is_near(farthest.0) {
            taken.insert(farthest.0);
            wanted.push(*farthest);
        }
    }
    let lengths = sizes.at_all(sites.positions, sites.under);
    let spare = spare((sites, &lengths), triangles, broken, wanted.len());
    if wanted.is_empty() || spare.len() < wanted.len() {
        return false;
    }
    for (v, (point, triangle)) in spare.into_iter().zip(wanted) {
        sites.positions[v] = point;
        sites.under[v] = triangle;
    }
    true
}

/// `count` sites, or fewer, that are the closest to others beside the `lengths` wanted there, if those are not equal; none at a broken cell, and no two that share an edge.
fn spare(
    (sites, lengths): (&Movable, &[f64]),
    triangles: &[[u32; 3]],
    broken: &[BrokenCell],
    count: usize,
) -> Vec<usize> {
    let n = sites.positions.len();
    let mut shortest = vec![f64::INFINITY; n];
    let mut rings: Vec<Vec<u32>> = vec![Vec::new(); n];
    for &[a, b, c] in triangles {
        for [i, j] in [[a, b], [b, c], [c, a]].map(|edge| edge.map(|v| v as usize)) {
            let length = sites.positions[i].distance_squared(sites.positions[j]);
            for v in [i, j] {
                let wanted = lengths.get(v).map_or(1.0, |wanted| wanted * wanted);
                shortest[v] = shortest[v].min(length / wanted);
            }
            rings[i].push(j as u32);
            rings[j].push(i as u32);
        }
    }
    let mut taken = sites.fixed.to_vec();
    taken.resize(n, false);
    // Twice, for the ring of the ring: what mends a cell must not break one beside it.
    let mut around: Vec<u32> = broken.iter().map(|b| b.site).collect();
    for _ in 0..2 {
        around = around.iter().flat_map(|v| rings[*v as usize].iter().chain([v])).copied().collect();
        around.sort_unstable();
        around.dedup();
    }
    around.iter().for_each(|v| taken[*v as usize] = true);
    let mut order: Vec<usize> = (0..n).filter(|v| !taken[*v] && shortest[*v].is_finite()).collect();
    order.sort_by(|a, b| shortest[*a].total_cmp(&shortest[*b]).then(a.cmp(b)));
    let mut found = Vec::new();
    for v in order {
        if found.len() >= count.min(n / RARE) {
            break;
        }
        if !taken[v] {
            rings[v].iter().for_each(|j| taken[*j as usize] = true);
            found.push(v);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of `n` + 1 pairs of sites a unit apart, but for the pair 20, which is nearer to 21.
    fn strip(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: u32| f64::from(i) + if i == 20 { 0.3 } else { 0.0 };
        let positions =
            (0..=n).flat_map(|i| [0.0, 1.0].map(|y| DVec3::new(at(i), y, 0.0))).collect::<Vec<_>>();
        let quad = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]];
        (positions, (0..n).flat_map(quad).collect())
    }

    fn densified(broken: &[BrokenCell], fixed: &[bool]) -> Option<Vec<usize>> {
        let (mut positions, triangles) = strip(30);
        let (before, mut under) = (positions.clone(), vec![0; positions.len()]);
        let mut sites = Movable { positions: &mut positions, under: &mut under, fixed };
        let done = densify(&mut sites, &triangles, broken, (1.0, &SizeField::default()));
        let moved: Vec<usize> = (0..before.len()).filter(|v| before[*v] != positions[*v]).collect();
        assert!(moved.iter().all(|v| under[*v] == 7) && done != moved.is_empty());
        done.then_some(moved)
    }

    fn broken(site: u32, x: f64) -> BrokenCell {
        BrokenCell { site, farthest: (DVec3::new(x, 0.5, 0.0), 7) }
    }

    #[test]
    fn the_most_crowded_site_moves_to_the_broken_cell() {
        assert_eq!(densified(&[broken(4, 2.4)], &[]), Some(vec![40]));
        // Nothing is taken away from beside it.
        let moved = densified(&[broken(38, 19.4)], &[]).unwrap();
        assert!(moved.len() == 1 && !(35..=42).contains(&moved[0]), "{moved:?}");
    }

    #[test]
    fn fixed_sites_stay_and_one_spot_gets_one_site() {
        let fixed: Vec<bool> = (0..62).map(|v| v != 50).collect();
        assert_eq!(densified(&[broken(4, 2.4), broken(5, 2.41)], &fixed), Some(vec![50]));
        assert_eq!(densified(&[broken(4, 2.4), broken(5, 2.6)], &fixed), None);
        assert_eq!(densified(&[], &[]), None);
        // At the site itself, where there is one already.
        let at_site = BrokenCell { site: 4, farthest: (DVec3::new(2.0, 0.01, 0.0), 7) };
        assert_eq!(densified(&[at_site], &[]), None);
    }
}
