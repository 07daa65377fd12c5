//! Which nodes of a sparse grid a ball reaches from far away.

use std::collections::VecDeque;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::bvh::Bvh;
use crate::mesh::level_set::{BLOCK, BLOCK_NODES, SparseGrid};

/// A place of the lattice without a block.
const FAR: u32 = u32::MAX;
/// A place without a block that is outside.
const OUTSIDE: u32 = u32::MAX - 1;
/// Steps to the neighbours of a node or block.
const STEPS: [(usize, i32); 6] = [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)];

/// All blocks of a cubic lattice around a surface, those near it with a number.
pub(super) struct Lattice {
    /// Blocks along each axis. The outermost ones are far from the surface.
    size: [i32; 3],
    /// The number of each block in the grid, [`FAR`] or [`OUTSIDE`]; x runs first.
    places: Vec<u32>,
}

impl Lattice {
    /// The blocks of nodes this far apart that may have nodes within `reach` of a surface, and the place of
    /// node 0, 0, 0; `None` if there are more than `most`.
    pub fn near(bvh: &Bvh, side: f64, reach: f64, most: usize) -> Option<(SparseGrid, [i32; 3])> {
        let bounds = bvh.bounds();
        let block = f64::from(BLOCK) * side;
        // Not at a point of symmetry, where values would be exactly 0.
        let shift = side * DVec3::new(0.137, 0.291, 0.419);
        let origin = bounds.min - (reach + block) - shift;
        let extent = bounds.max + (reach + block) - origin;
        let size = (extent / block).ceil().to_array().map(|blocks| blocks as i32 + 1);
        let search = Search { bvh, origin, block, reach };
        let whole = size.into_iter().max().unwrap_or(1) as u32;
        let blocks = search.blocks([0; 3], whole.next_power_of_two() as i32, &mut 0);
        (blocks.len() <= most).then(|| (SparseGrid::new(origin, side, blocks), size))
    }

    /// With the numbers of the grid's blocks.
    pub fn new(grid: &SparseGrid, size: [i32; 3]) -> Self {
        let mut lattice = Self { size, places: vec![FAR; size.iter().map(|n| *n as usize).product()] };
        for (number, at) in (0..).zip(grid.blocks()) {
            if let Some(place) = lattice.place(*at) {
                lattice.places[place] = number;
            }
        }
        lattice
    }

    fn place(&self, at: [i32; 3]) -> Option<usize> {
        let [x, y, z] = at;
        let [nx, ny, nz] = self.size;
        let is_there = (0..nx).contains(&x) && (0..ny).contains(&y) && (0..nz).contains(&z);
        is_there.then(|| x as usize + nx as usize * (y as usize + ny as usize * z as usize))
    }

    /// For each node of the grid whether it is outside: joined to the corner of the lattice by steps between
    /// free nodes. All nodes of places without a block are free.
    pub fn outside(mut self, grid: &SparseGrid, is_free: &[bool]) -> Vec<bool> {
        let mut outside = vec![false; is_free.len()];
        let mut blocks = VecDeque::from([[0; 3]]);
        let mut nodes: VecDeque<u32> = VecDeque::new();
        self.places[0] = OUTSIDE;
        loop {
            while let Some(at) = blocks.pop_front() {
                for step in STEPS {
                    let next = stepped(at, step);
                    let Some(place) = self.place(next) else { continue };
                    match self.places[place] {
                        OUTSIDE => {}
                        FAR => {
                            self.places[place] = OUTSIDE;
                            blocks.push_back(next);
                        }
                        number => {
                            for node in facing(step).map(|node| number * BLOCK_NODES as u32 + node) {
                                enter(node, is_free, &mut outside, &mut nodes);
                            }
                        }
                    }
                }
            }
            let Some(node) = nodes.pop_front() else { return outside };
            let block = grid.blocks()[node as usize / BLOCK_NODES];
            let at = SparseGrid::node(block, node as usize % BLOCK_NODES);
            for step in STEPS {
                let next = stepped(at, step);
                let of = next.map(|c| c.div_euclid(BLOCK));
                let Some(place) = self.place(of) else { continue };
                match self.places[place] {
                    OUTSIDE => {}
                    FAR => {
                        self.places[place] = OUTSIDE;
                        blocks.push_back(of);
                    }
                    number => {
                        let [x, y, z] = next.map(|c| c.rem_euclid(BLOCK) as u32);
                        let node = number * BLOCK_NODES as u32 + x + 8 * (y + 8 * z);
                        enter(node, is_free, &mut outside, &mut nodes);
                    }
                }
            }
        }
    }
}

fn enter(node: u32, is_free: &[bool], outside: &mut [bool], nodes: &mut VecDeque<u32>) {
    if is_free[node as usize] && !std::mem::replace(&mut outside[node as usize], true) {
        nodes.push_back(node);
    }
}

fn stepped(mut at: [i32; 3], (axis, by): (usize, i32)) -> [i32; 3] {
    at[axis] += by;
    at
}

/// The nodes of a block that this step enters it by.
fn facing((axis, by): (usize, i32)) -> impl Iterator<Item = u32> {
    let layer = if by > 0 { 0 } else { BLOCK as u32 - 1 };
    (0..BLOCK_NODES as u32).filter(move |node| (node >> (3 * axis)) & 7 == layer)
}

/// A search for blocks near a surface.
struct Search<'a> {
    bvh: &'a Bvh,
    origin: DVec3,
    /// The side of a block.
    block: f64,
    reach: f64,
}

impl Search<'_> {
    /// Of a cube of blocks with its lowest one at `at` and `count` along each axis, a power of two.
    fn blocks(&self, at: [i32; 3], count: i32, rank: &mut usize) -> Vec<[i32; 3]> {
        let side = f64::from(count) * self.block;
        let centre = self.origin + self.block * DVec3::from_array(at.map(f64::from)) + 0.5 * side;
        let near = self.reach + 0.5 * 3f64.sqrt() * side;
        if self.bvh.distance_sq_beyond(centre, rank, near * near).is_some() {
            return Vec::new();
        }
        if count == 1 {
            return vec![at];
        }
        let half = count / 2;
        let part = |k: i32| [0, 1, 2].map(|axis| at[axis] + half * (k >> axis & 1));
        if count < 8 {
            return (0..8).flat_map(|k| self.blocks(part(k), half, rank)).collect();
        }
        let rank = *rank;
        (0..8).into_par_iter().flat_map_iter(|k| self.blocks(part(k), half, &mut { rank })).collect()
    }
}
