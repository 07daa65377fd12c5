//! Values at the nodes of a cubic grid, kept in blocks only where there are any.

use glam::DVec3;
use rayon::prelude::*;

/// Nodes of a block along each axis.
pub const BLOCK: i32 = 8;
/// Nodes of a block.
pub const BLOCK_NODES: usize = (BLOCK * BLOCK * BLOCK) as usize;

/// A grid of nodes with integer coordinates, in blocks of 8 x 8 x 8 nodes. Node `x, y, z` of a block has the
/// number `x + 8 (y + 8 z)` in it.
pub struct SparseGrid {
    /// The place of node 0, 0, 0.
    pub origin: DVec3,
    /// Distance between nodes, above 0, in the unit of `origin`.
    pub side: f64,
    /// Coordinates of the blocks in units of blocks, ascending by z, y, x.
    blocks: Vec<[i32; 3]>,
    /// The field, negative inside; NaN where it is undefined. Those of block `b` begin at `512 b`.
    pub values: Vec<f32>,
}

/// The order of blocks.
fn key([x, y, z]: [i32; 3]) -> [i32; 3] {
    [z, y, x]
}

impl SparseGrid {
    /// A grid with these blocks, each at most once and in any order, and undefined values.
    pub fn new(origin: DVec3, side: f64, mut blocks: Vec<[i32; 3]>) -> Self {
        blocks.par_sort_unstable_by_key(|block| key(*block));
        blocks.dedup();
        let values = vec![f32::NAN; blocks.len() * BLOCK_NODES];
        Self { origin, side, blocks, values }
    }

    /// Its blocks.
    pub fn blocks(&self) -> &[[i32; 3]] {
        &self.blocks
    }

    /// The index of a block, if it is there.
    pub fn block(&self, at: [i32; 3]) -> Option<usize> {
        self.blocks.binary_search_by_key(&key(at), |block| key(*block)).ok()
    }

    /// The coordinates of a node of a block, by its number in it.
    pub fn node(block: [i32; 3], number: usize) -> [i32; 3] {
        let within = [number & 7, number >> 3 & 7, number >> 6];
        [0, 1, 2].map(|axis| BLOCK * block[axis] + within[axis] as i32)
    }

    /// Where a node is.
    pub fn position(&self, node: [i32; 3]) -> DVec3 {
        self.origin + self.side * DVec3::from_array(node.map(f64::from))
    }

    /// The place of the node with this index among all values.
    pub fn position_of(&self, index: u32) -> DVec3 {
        let (block, number) = (index as usize / BLOCK_NODES, index as usize % BLOCK_NODES);
        self.position(Self::node(self.blocks[block], number))
    }
}
