//! The pieces of borders in a tetrahedron whose corners have labels (Bonnell et al. 2003).
//!
//! Cubes are cut into six tetrahedra around the diagonal that all cubes have in common (Kuhn's subdivision),
//! so that faces of neighbours fit. A label's part of a tetrahedron is around its corners, and the border of
//! any label is a manifold, whatever the labels are.

use std::sync::OnceLock;

/// A vertex of the borders, on the edge, the face or in the tetrahedron between these corners; numbers of
/// corners, as bits.
pub(super) type Corners = u8;

/// A polygon between two labels, with the corners of the tetrahedron on either side of it.
pub(super) struct Piece {
    /// Three or four vertices around it.
    pub around: [Corners; 4],
    /// How many of them there are.
    pub count: usize,
    /// A corner with one label, and one with the other.
    pub sides: [u8; 2],
}

/// Bits of the cube's corners along the edges of each tetrahedron, from the lowest corner to the highest.
pub(super) const PATHS: [[u8; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// The polygons in a tetrahedron whose corners have these labels.
pub(super) fn pieces(labels: [u32; 4]) -> &'static [Piece] {
    // They depend on nothing but the first corner with each corner's label.
    static KNOWN: OnceLock<Vec<Vec<Piece>>> = OnceLock::new();
    let known = KNOWN.get_or_init(|| {
        (0..256).map(|all: u32| pieces_of([0, 2, 4, 6].map(|shift| all >> shift & 3))).collect()
    });
    let first = |k: usize| labels.iter().position(|label| *label == labels[k]).unwrap_or(k);
    &known[(0..4).fold(0, |all, k| all | first(k) << (2 * k))]
}

fn pieces_of(labels: [u32; 4]) -> Vec<Piece> {
    let mut found = Vec::new();
    // Corners of one label, by the first of them.
    let group = |first: usize| (0..4).filter(move |k| labels[*k] == labels[first]);
    let firsts: Vec<usize> = (0..4).filter(|k| group(*k).next() == Some(*k)).collect();
    for (n, a) in firsts.iter().enumerate() {
        for b in &firsts[n + 1..] {
            let (own, other): (Vec<usize>, Vec<usize>) = (group(*a).collect(), group(*b).collect());
            let rest: Vec<usize> = (0..4).filter(|k| !own.contains(k) && !other.contains(k)).collect();
            let around = polygon(&own, &other, &rest, firsts.len());
            let mut all = [0; 4];
            all[..around.len()].copy_from_slice(&around);
            found.push(Piece { around: all, count: around.len(), sides: [*a as u8, *b as u8] });
        }
    }
    found
}

fn set(corners: &[usize]) -> Corners {
    corners.iter().fold(0, |bits, corner| bits | 1 << corner)
}

/// The polygon around the border of two groups of corners, if the tetrahedron has this many labels.
fn polygon(own: &[usize], other: &[usize], rest: &[usize], labels: usize) -> Vec<Corners> {
    match (own, other, rest) {
        ([a], [b, c, d], _) | ([b, c, d], [a], _) => vec![set(&[*a, *b]), set(&[*a, *c]), set(&[*a, *d])],
        ([a, b], [c, d], _) => vec![set(&[*a, *c]), set(&[*a, *d]), set(&[*b, *d]), set(&[*b, *c])],
        // The third label has the other faces' common edge.
        ([a, b], [c], [d]) | ([c], [a, b], [d]) => {
            vec![set(&[*a, *c]), set(&[*b, *c]), set(&[*b, *c, *d]), set(&[*a, *c, *d])]
        }
        ([a], [b], [c, d]) if labels == 3 => vec![set(&[*a, *b]), set(&[*a, *b, *c]), set(&[*a, *b, *d])],
        ([a], [b], [c, d]) => {
            vec![set(&[*a, *b]), set(&[*a, *b, *c]), set(&[0, 1, 2, 3]), set(&[*a, *b, *d])]
        }
        _ => Vec::new(),
    }
}
