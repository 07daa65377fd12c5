//! The part of a volume near a surface, as a sparse grid in units of nodes.

use glam::DVec3;
use rayon::prelude::*;

use crate::io::Volume;
use crate::mesh::level_set::{BLOCK, BLOCK_NODES, SparseGrid};

/// Values on a grid with those beyond its border.
pub(super) struct Field<'a> {
    pub volume: &'a Volume,
    /// Where the surface is.
    pub iso: f32,
    /// 1 if values inside are below `iso`, -1 if they are above.
    pub sign: f32,
    /// Whether a layer of nodes outside lies around the volume.
    pub closed: bool,
}

impl Field<'_> {
    /// Below 0 inside, NaN where there is nothing.
    fn at(&self, node: [i32; 3]) -> f32 {
        let size = self.volume.size;
        let is_within = |axis: usize| (0..size[axis] as i32).contains(&node[axis]);
        if (0..3).all(is_within) {
            let value = self.sign * (self.volume.at(node.map(|c| c as usize)) - self.iso);
            // Differences of two values stay finite.
            return value.clamp(-f32::MAX / 4.0, f32::MAX / 4.0);
        }
        let is_near = |axis: usize| (-1..=size[axis] as i32).contains(&node[axis]);
        // So far outside that the surface goes along the border.
        if self.closed && (0..3).all(is_near) { f32::MAX / 4.0 } else { f32::NAN }
    }

    /// The values around the surface; places are in units of nodes.
    pub fn grid(&self) -> SparseGrid {
        let first = if self.closed { -1 } else { 0 };
        let blocks = [0, 1, 2].map(|axis| {
            let last = self.volume.size[axis] as i32 - 1 - first;
            first.div_euclid(BLOCK)..=last.div_euclid(BLOCK)
        });
        let [x, y, z] = blocks;
        let rows: Vec<[i32; 2]> = z.flat_map(|z| y.clone().map(move |y| [y, z])).collect();
        let of_row = |[by, bz]: &[i32; 2]| {
            x.clone().map(|bx| [bx, *by, *bz]).filter(|block| self.is_crossed(*block)).collect::<Vec<_>>()
        };
        let crossed: Vec<[i32; 3]> = rows.par_iter().flat_map_iter(of_row).collect();
        // Cells at a block's end have corners in those behind it.
        let ahead = |block: &[i32; 3]| {
            let block = *block;
            (0..8).map(move |bits: i32| [0, 1, 2].map(|axis| block[axis] + (bits >> axis & 1)))
        };
        let mut grid = SparseGrid::new(DVec3::ZERO, 1.0, crossed.iter().flat_map(ahead).collect());
        let blocks = grid.blocks().to_vec();
        grid.values.par_chunks_mut(BLOCK_NODES).zip(&blocks).for_each(|(values, block)| {
            for (number, value) in values.iter_mut().enumerate() {
                *value = self.at(SparseGrid::node(*block, number));
            }
        });
        grid
    }

    /// Whether a block's cells have corners inside and outside.
    fn is_crossed(&self, block: [i32; 3]) -> bool {
        let (mut inside, mut outside) = (false, false);
        for number in 0..(BLOCK + 1).pow(3) {
            let within = [number % 9, number / 9 % 9, number / 81];
            let value = self.at([0, 1, 2].map(|axis| BLOCK * block[axis] + within[axis]));
            inside |= value < 0.0;
            outside |= value >= 0.0;
            if inside && outside {
                return true;
            }
        }
        false
    }
}
