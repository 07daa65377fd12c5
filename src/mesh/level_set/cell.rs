//! The pieces of surface in a cell of the grid, for each of the 256 sets of corners that are inside.
//!
//! The table is made by the rule of its derivation instead of typed in: around each face of the cell, every
//! run of corners inside is cut off by one segment, and the segments of all faces join to cycles. Where a
//! face has two corners inside across its diagonal, they are so kept apart in both cells, and the surface
//! has no cracks (Lorensen and Cline 1987; the ambiguous faces of Nielson and Hamann 1991).

use std::sync::LazyLock;

/// A closed polygon across edges of the cell.
pub(super) struct Cycle {
    /// The edges it crosses, 0 to 11: four along x, four along y, four along z; counter-clockwise as seen
    /// from outside.
    pub edges: Vec<u8>,
    /// Whether it crosses a face twice. A diagonal within that face could be in the neighbour as well.
    pub needs_centre: bool,
}

/// The lower corner of each edge; corner bits are 1 for x, 2 for y and 4 for z.
pub(super) const LOW: [u8; 12] = [0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3];

/// Corners around each face, counter-clockwise as seen from outside the cell.
const FACES: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The cycles for each set of corners inside, as bits.
pub(super) static CYCLES: LazyLock<Vec<Vec<Cycle>>> = LazyLock::new(|| (0..=255).map(cycles).collect());

/// The edge between two corners.
fn edge(a: u8, b: u8) -> u8 {
    let (low, axis) = (a.min(b), (a ^ b).trailing_zeros() as u8);
    let first = 4 * axis;
    let rank = (first..first + 4).find(|e| LOW[*e as usize] == low);
    rank.unwrap_or(first)
}

fn cycles(inside: u8) -> Vec<Cycle> {
    let is_in = |corner: u8| inside >> corner & 1 == 1;
    // From each edge that is crossed, the next one and the face between them.
    let mut next = [None; 12];
    for (face, corners) in (0_u8..).zip(FACES) {
        let at = |k: usize| corners[k % 4];
        for enters in (0..4).filter(|k| !is_in(at(*k)) && is_in(at(k + 1))) {
            let leaves = (enters + 1..enters + 4).find(|k| is_in(at(*k)) && !is_in(at(k + 1)));
            let leaves = leaves.unwrap_or(enters);
            next[edge(at(leaves), at(leaves + 1)) as usize] = Some((edge(at(enters), at(enters + 1)), face));
        }
    }
    let mut found = Vec::new();
    for first in 0..12 {
        let (mut edges, mut faces) = (Vec::new(), Vec::new());
        let mut at = first;
        while let Some((to, face)) = next[at as usize].take() {
            edges.push(at);
            faces.push(face);
            at = to;
        }
        if !edges.is_empty() {
            edges.reverse();
            faces.sort_unstable();
            let needs_centre = faces.windows(2).any(|pair| pair[0] == pair[1]);
            found.push(Cycle { edges, needs_centre });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crossed_edge_is_in_one_cycle() {
        for inside in 0..=255_u8 {
            let mut crossed: Vec<u8> = (0..12)
                .filter(|e| {
                    let (low, high) = (LOW[*e as usize], LOW[*e as usize] | 1 << (e / 4));
                    (inside >> low ^ inside >> high) & 1 == 1
                })
                .collect();
            let mut found: Vec<u8> = CYCLES[inside as usize].iter().flat_map(|c| c.edges.clone()).collect();
            found.sort_unstable();
            crossed.sort_unstable();
            assert_eq!(found, crossed, "{inside:08b}");
            assert!(CYCLES[inside as usize].iter().all(|c| c.edges.len() >= 3));
        }
    }

    #[test]
    fn corners_across_a_face_are_kept_apart() {
        // Corners 0 and 3 are opposite in the face z = 0.
        assert_eq!(CYCLES[0b1001].len(), 2);
        assert!(CYCLES[0b1001].iter().all(|c| c.edges.len() == 3 && !c.needs_centre));
        // The complement keeps them apart, too, so that one cycle crosses the face twice.
        assert!(CYCLES[0b1111_0110].iter().any(|c| c.needs_centre));
    }
}
