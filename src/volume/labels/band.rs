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
    /// Whether the distance of a node is exact.
    pub is_fixed: Vec<bool>,
    /// For each node, the numbers in the band of the nodes before and after it along each axis: -x, x, -y, y,
    /// -z, z. The band's length stands for a node outside the band.
    pub neighbours: Vec<[u32; 6]>,
}

/// Ranges of indices along each axis.
pub(super) type Extent = [std::ops::Range<usize>; 3];

impl Band {
    /// The band of the nodes within `extent` for which `is_inside` holds; all of them are in it.
    pub fn new(size: [usize; 3], extent: &Extent, is_inside: impl Fn(usize) -> bool + Sync) -> Self {
        let grown: Extent = std::array::from_fn(|a| {
            extent[a].start.saturating_sub(REACH)..(extent[a].end + REACH).min(size[a])
        });
        let lengths = [0, 1, 2].map(|a: usize| grown[a].len());
        let shape = Inside::new(size, &grown, is_inside);
        let squares = shape.squares();
        let (row, first) = (lengths[0], [0, 1, 2].map(|a: usize| grown[a].start));
        let of_row = |number: usize| {
            let (y, z) = (first[1] + number % lengths[1], first[2] + number / lengths[1]);
            let node = first[0] + size[0] * (y + size[1] * z);
            let own = number * row..(number + 1) * row;
            let values = shape.inside[own.clone()].iter().zip(&squares[own]).enumerate();
            values.filter(|(_, (_, square))| **square != FAR).map(move |(x, (inside, square))| {
                let distance = f32::from(*square).sqrt() - HALF;
                ((node + x) as u32, if *inside { distance } else { -distance })
            })
        };
        let (nodes, distance): (Vec<u32>, Vec<f32>) =
            (0..lengths[1] * lengths[2]).into_par_iter().flat_map_iter(of_row).unzip();
        let neighbours = neighbours(&nodes, size);
        let is_fixed = vec![false; nodes.len()];
        Self { nodes, distance, is_fixed, neighbours }
    }
}

/// Which nodes of a part of a volume have a label.
struct Inside {
    /// Nodes along each axis.
    lengths: [usize; 3],
    inside: Vec<bool>,
}

impl Inside {
    fn new(size: [usize; 3], part: &Extent, is_inside: impl Fn(usize) -> bool + Sync) -> Self {
        let lengths = [0, 1, 2].map(|a: usize| part[a].len());
        let mut inside = vec![false; lengths.iter().product()];
        inside.par_chunks_mut(lengths[0]).enumerate().for_each(|(row, inside)| {
            let (y, z) = (part[1].start + row % lengths[1], part[2].start + row / lengths[1]);
            let first = part[0].start + size[0] * (y + size[1] * z);
            inside.iter_mut().enumerate().for_each(|(x, inside)| *inside = is_inside(first + x));
        });
        Self { lengths, inside }
    }

    /// For each node, the square of its distance from the nearest node on the other side within reach. Such
    /// a node has one of this side next to it.
    fn squares(&self) -> Vec<u8> {
        let [nx, ny, nz] = self.lengths;
        let borders: Vec<Vec<[u32; 2]>> = (0..nz).into_par_iter().map(|z| self.border(z)).collect();
        let mut squares = vec![FAR; self.inside.len()];
        squares.par_chunks_mut(nx * ny).enumerate().for_each(|(z, squares)| {
            let own = &self.inside[z * nx * ny..][..nx * ny];
            let near = z.saturating_sub(REACH)..(z + REACH + 1).min(nz);
            for (other, border) in near.clone().zip(&borders[near]) {
                for [x, y] in border.iter().map(|at| at.map(|c| c as usize)) {
                    let side = self.inside[x + nx * (y + ny * other)];
                    for to_y in y.saturating_sub(REACH)..(y + REACH + 1).min(ny) {
                        for to_x in x.saturating_sub(REACH)..(x + REACH + 1).min(nx) {
                            let steps = [to_x.abs_diff(x), to_y.abs_diff(y), other.abs_diff(z)];
                            let square = steps.iter().map(|step| step * step).sum::<usize>() as u8;
                            let to = to_x + nx * to_y;
                            if own[to] != side && square < squares[to] {
                                squares[to] = square;
                            }
                        }
                    }
                }
            }
        });
        squares
    }

    /// The nodes of a slice that have one of the other side next to them.
    fn border(&self, z: usize) -> Vec<[u32; 2]> {
        let [nx, ny, nz] = self.lengths;
        let mut found = Vec::new();
        for y in 0..ny {
            for x in 0..nx {
                let i = x + nx * (y + ny * z);
                let differs = |is_there: bool, to: usize| is_there && self.inside[to] != self.inside[i];
                if differs(x > 0, i.wrapping_sub(1))
                    || differs(x + 1 < nx, i + 1)
                    || differs(y > 0, i.wrapping_sub(nx))
                    || differs(y + 1 < ny, i + nx)
                    || differs(z > 0, i.wrapping_sub(nx * ny))
                    || differs(z + 1 < nz, i + nx * ny)
                {
                    found.push([x as u32, y as u32]);
                }
            }
        }
        found
    }
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
