//! The nodes near the border of one label, with their distances from the other side.

use rayon::prelude::*;

/// Nodes as far as this from the other side, along any axis, belong to the band.
const REACH: usize = 2;
/// Stands for no node within reach; squares of distances are at most 3 `REACH`².
const FAR: u8 = u8::MAX;
/// The border is so far on this side of the nearest node of the other side, on average.
const HALF: f32 = 0.5;

/// Nodes on both sides of a label's border.
pub(super) struct Band {
    /// Ascending indices of nodes in the volume.
    pub nodes: Vec<u32>,
    /// About the signed distance of each from the border, in nodes; greater than 0 inside.
    pub distance: Vec<f32>,
    /// Of each, the numbers in the band of the nodes before and after it along each axis: -x, x, -y, y, -z,
    /// z. The band's length stands for none.
    pub neighbours: Vec<[u32; 6]>,
}

/// Ranges of indices along each axis.
pub(super) type Extent = [std::ops::Range<usize>; 3];

impl Band {
    /// That of the nodes within `extent` for which `is_inside` holds; all of them are in it.
    pub fn new(size: [usize; 3], extent: &Extent, is_inside: impl Fn(usize) -> bool + Sync) -> Self {
        let grown: Extent = std::array::from_fn(|a| {
            extent[a].start.saturating_sub(REACH)..(extent[a].end + REACH).min(size[a])
        });
        let lengths = [0, 1, 2].map(|a: usize| grown[a].len());
        let slice = lengths[0] * lengths[1];
        let index = |i: usize| {
            let at = [i % lengths[0], i / lengths[0] % lengths[1], i / slice];
            let at: [usize; 3] = std::array::from_fn(|a| at[a] + grown[a].start);
            at[0] + size[0] * (at[1] + size[1] * at[2])
        };
        let inside: Vec<bool> =
            (0..slice * lengths[2]).into_par_iter().map(|i| is_inside(index(i))).collect();
        let other = [true, false].map(|side| squares(&inside, side, lengths));
        let own = |i: usize| {
            let square = other[usize::from(inside[i])][i];
            let distance = f32::from(square).sqrt() - HALF;
            (square != FAR).then_some((index(i) as u32, if inside[i] { distance } else { -distance }))
        };
        let (nodes, distance): (Vec<u32>, Vec<f32>) =
            (0..inside.len()).into_par_iter().filter_map(own).unzip();
        let neighbours = neighbours(&nodes, size);
        Self { nodes, distance, neighbours }
    }
}

/// For each node, the square of its distance from the nearest within reach that is `side`.
fn squares(inside: &[bool], side: bool, lengths: [usize; 3]) -> Vec<u8> {
    let mut squares: Vec<u8> = inside.par_iter().map(|i| if *i == side { 0 } else { FAR }).collect();
    let strides = [1, lengths[0], lengths[0] * lengths[1]];
    for axis in 0..3 {
        let (stride, length) = (strides[axis], lengths[axis]);
        let least = |i: usize| {
            let at = i / stride % length;
            let near = at.saturating_sub(REACH)..(at + REACH + 1).min(length);
            let values = near.map(|to| {
                let step = to.abs_diff(at);
                squares[i + to * stride - at * stride].saturating_add((step * step) as u8)
            });
            values.min().unwrap_or(FAR)
        };
        squares = (0..squares.len()).into_par_iter().map(least).collect();
    }
    squares
}

/// The numbers of each node's neighbours, by walking along the list with one more hand for each direction.
fn neighbours(nodes: &[u32], size: [usize; 3]) -> Vec<[u32; 6]> {
    let none = nodes.len() as u32;
    let mut found = vec![[none; 6]; nodes.len()];
    let strides = [1, size[0], size[0] * size[1]];
    for axis in 0..3 {
        let mut ahead = 0;
        for i in 0..nodes.len() {
            let at = nodes[i] as usize / strides[axis] % size[axis];
            let wanted = nodes[i] as usize + strides[axis];
            while ahead < nodes.len() && (nodes[ahead] as usize) < wanted {
                ahead += 1;
            }
            if at + 1 < size[axis] && ahead < nodes.len() && nodes[ahead] as usize == wanted {
                found[i][2 * axis + 1] = ahead as u32;
                found[ahead][2 * axis] = i as u32;
            }
        }
    }
    found
}
