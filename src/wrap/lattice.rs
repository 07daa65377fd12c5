//! Which nodes of a sparse grid a ball reaches from far away.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::bvh::Bvh;
use crate::mesh::level_set::{BLOCK, BLOCK_NODES, SparseGrid};
use crate::{ProgressToken, Result};

/// A place of the lattice without a block.
const FAR: u32 = u32::MAX;
/// A place without a block that is outside.
const OUTSIDE: u32 = u32::MAX - 1;
/// Most places of a lattice, 200 MB.
const MOST_PLACES: f64 = 5e7;
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
    /// The blocks of nodes this far apart that may have nodes within `reach` of a surface, as a grid with
    /// undefined values, and the lattice that they lie in; `None` if there are more than `most` of them, or
    /// very many places.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn near(
        bvh: &Bvh,
        side: f64,
        reach: f64,
        most: usize,
        progress: &ProgressToken,
    ) -> Result<Option<(SparseGrid, Self)>> {
        let bounds = bvh.bounds();
        let block = f64::from(BLOCK) * side;
        // Not at a point of symmetry, where values would be exactly 0.
        let shift = side * DVec3::new(0.137, 0.291, 0.419);
        let origin = bounds.min - (reach + block) - shift;
        let size = ((bounds.max + (reach + block) - origin) / block).ceil() + 1.0;
        // Not a number, either.
        let is_small = size.element_product() <= MOST_PLACES;
        if !is_small {
            return Ok(None);
        }
        let size = size.to_array().map(|blocks| blocks as i32);
        let whole = size.into_iter().max().unwrap_or(1) as u32;
        let search = Search { bvh, origin, block, reach, most, found: AtomicUsize::new(0), progress };
        let blocks = search.blocks([0; 3], whole.next_power_of_two() as i32, &mut 0)?;
        if search.is_over() {
            return Ok(None);
        }
        let grid = SparseGrid::new(origin, side, blocks);
        let mut lattice = Self { size, places: vec![FAR; size.iter().map(|n| *n as usize).product()] };
        for (number, at) in (0..).zip(grid.blocks()) {
            if let Some(place) = lattice.place(*at) {
                lattice.places[place] = number;
            }
        }
        Ok(Some((grid, lattice)))
    }

    fn place(&self, at: [i32; 3]) -> Option<usize> {
        let [x, y, z] = at;
        let [nx, ny, nz] = self.size;
        let is_there = (0..nx).contains(&x) && (0..ny).contains(&y) && (0..nz).contains(&z);
        is_there.then(|| x as usize + nx as usize * (y as usize + ny as usize * z as usize))
    }

    /// The number of the block at a place next to what is outside. Without a block, the place is outside as
    /// well, and `reached` gets it the first time; `None`, as beyond the lattice.
    fn enter_place(&mut self, at: [i32; 3], reached: &mut VecDeque<[i32; 3]>) -> Option<u32> {
        let place = self.place(at)?;
        match self.places[place] {
            OUTSIDE => None,
            FAR => {
                self.places[place] = OUTSIDE;
                reached.push_back(at);
                None
            }
            number => Some(number),
        }
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
                    let Some(number) = self.enter_place(stepped(at, step), &mut blocks) else { continue };
                    for node in facing(step).map(|node| number * BLOCK_NODES as u32 + node) {
                        enter(node, is_free, &mut outside, &mut nodes);
                    }
                }
            }
            let Some(node) = nodes.pop_front() else { return outside };
            let block = grid.blocks()[node as usize / BLOCK_NODES];
            let at = SparseGrid::node(block, node as usize % BLOCK_NODES);
            for step in STEPS {
                let next = stepped(at, step);
                let block = next.map(|c| c.div_euclid(BLOCK));
                let Some(number) = self.enter_place(block, &mut blocks) else { continue };
                let [x, y, z] = next.map(|c| c.rem_euclid(BLOCK) as u32);
                let node = number * BLOCK_NODES as u32 + x + 8 * (y + 8 * z);
                enter(node, is_free, &mut outside, &mut nodes);
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
    /// It ends once more are found.
    most: usize,
    found: AtomicUsize,
    progress: &'a ProgressToken,
}

impl Search<'_> {
    fn is_over(&self) -> bool {
        self.found.load(Ordering::Relaxed) > self.most
    }

    /// Of a cube of blocks with its lowest one at `at` and `count` along each axis, a power of two.
    fn blocks(&self, at: [i32; 3], count: i32, rank: &mut usize) -> Result<Vec<[i32; 3]>> {
        let side = f64::from(count) * self.block;
        let centre = self.origin + self.block * DVec3::from_array(at.map(f64::from)) + 0.5 * side;
        let near = self.reach + 0.5 * 3f64.sqrt() * side;
        if self.is_over() || self.bvh.distance_sq_beyond(centre, rank, near * near).is_some() {
            return Ok(Vec::new());
        }
        if count == 1 {
            self.found.fetch_add(1, Ordering::Relaxed);
            return Ok(vec![at]);
        }
        let half = count / 2;
        let part = |k: i32| [0, 1, 2].map(|axis| at[axis] + half * (k >> axis & 1));
        if count < 8 {
            let mut found = Vec::new();
            for k in 0..8 {
                found.extend(self.blocks(part(k), half, rank)?);
            }
            return Ok(found);
        }
        self.progress.poll()?;
        let rank = *rank;
        let parts = (0..8).into_par_iter().map(|k| self.blocks(part(k), half, &mut { rank }));
        Ok(parts.collect::<Result<Vec<_>>>()?.concat())
    }
}
