//! How the positions of sites are in a buffer.

use super::blocks::Block;
use crate::Result;
use crate::gpu::{Buffer, Device};
use crate::mesh::chunks::CHUNK;
use bytemuck::allocation::pod_collect_to_vec;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// See `glsl/common/sites.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SiteLayout {
    /// Each with a fourth number: 0, or the marks of [`super::pins`].
    #[default]
    Marked,
    /// Three numbers each, one after another. A quarter smaller, but there is no place for marks.
    Packed,
}

impl SiteLayout {
    /// [`SiteLayout::Marked`] unless that is more than a kernel can be given.
    pub fn fitting(device: &Device, sites: usize) -> Self {
        let fits = sites <= Block::largest(device, size_of::<Vec4>());
        if fits { Self::Marked } else { Self::Packed }
    }

    /// A buffer for `sites` positions, not initialised.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn buffer(self, device: &Device, name: &str, sites: usize) -> Result<Buffer<Vec4>> {
        Buffer::new(device, name, self.place(sites))
    }

    /// The part of `sites` that is of a block.
    ///
    /// # Errors
    /// As [`Buffer::window`].
    pub fn window(self, sites: &Buffer<Vec4>, block: Block) -> Result<Buffer<Vec4>> {
        let [first, end] = [block.first, block.first + block.sites].map(|i| self.place(i as usize));
        sites.window(first, end - first)
    }

    /// Positions as such a buffer has them.
    pub fn pack(self, positions: &[Vec4]) -> Vec<Vec4> {
        match self {
            Self::Marked => positions.to_vec(),
            Self::Packed => {
                let mut numbers: Vec<f32> = positions.iter().flat_map(|p| p.truncate().to_array()).collect();
                numbers.resize(4 * self.place(positions.len()), 0.0);
                pod_collect_to_vec(&numbers)
            }
        }
    }

    /// The first `sites` positions of such a buffer's content.
    pub fn unpack(self, content: &[Vec4], sites: usize) -> Vec<Vec3> {
        match self {
            Self::Marked => {
                content.par_iter().take(sites).with_min_len(CHUNK).map(|p| p.truncate()).collect()
            }
            Self::Packed => {
                let numbers: &[f32] = bytemuck::cast_slice(content);
                let positions = numbers.par_chunks_exact(3).take(sites).with_min_len(CHUNK);
                positions.map(Vec3::from_slice).collect()
            }
        }
    }

    /// The constant of the kernels.
    pub(super) fn packed(self) -> u32 {
        u32::from(self == Self::Packed)
    }

    /// Vectors before that of site i; for packed sites those with anything of them.
    fn place(self, i: usize) -> usize {
        match self {
            Self::Marked => i,
            Self::Packed => (3 * i).div_ceil(4),
        }
    }
}
