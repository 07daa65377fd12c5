//! Values of sites in several buffers, where one would be larger than a kernel can be given, or its dispatch
//! would take too long.

use crate::gpu::{Buffer, Device, Download, Recorder};
use crate::{Error, Result};

/// Blocks begin at multiples of this, so that the workgroups of a block are those of all sites together, and
/// windows begin where Vulkan allows it.
pub(super) const STEP: usize = 64;

/// Consecutive sites whose values are in one buffer, as kernels take them; see `glsl/common/blocks.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    /// The first site.
    pub first: u32,
    /// How many there are.
    pub sites: u32,
}

impl Block {
    /// Divides `sites` sites into blocks of at most `most`, rounded down to a multiple of 64, but 64 at
    /// least; into one block if there are no sites.
    pub fn divide(sites: usize, most: usize) -> Vec<Self> {
        let most = (most / STEP * STEP).max(STEP);
        let block = |first| Self { first: first as u32, sites: most.min(sites - first) as u32 };
        (0..sites.max(1)).step_by(most).map(block).collect()
    }

    /// The values of its sites, of those of all sites.
    ///
    /// # Errors
    /// As [`Buffer::window`].
    pub fn window<T: bytemuck::Pod>(self, all: &Buffer<T>) -> Result<Buffer<T>> {
        all.window(self.first as usize, self.sites as usize)
    }

    /// The largest blocks for which `bytes` bytes a site fit into a buffer of the device.
    pub fn largest(device: &Device, bytes: usize) -> usize {
        let fit = device.info().limits.storage_buffer_bytes / bytes.max(1) as u64;
        usize::try_from(fit).unwrap_or(usize::MAX)
    }
}

/// Values of sites, in a buffer for each block: `values[slot * block.sites + site - block.first]`.
pub struct Blocked<T> {
    blocks: Vec<(Block, Buffer<T>)>,
    slots: usize,
}

impl<T: bytemuck::Pod> Blocked<T> {
    /// `slots` values a site, not initialised.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn new(device: &Device, name: &str, blocks: &[Block], slots: usize) -> Result<Self> {
        let buffer = |block: &Block| Ok((*block, Buffer::new(device, name, slots * block.sites as usize)?));
        Ok(Self { blocks: blocks.iter().map(buffer).collect::<Result<_>>()?, slots })
    }

    /// The given values, `values[slot * sites + site]` over all sites.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn from_slice(device: &Device, name: &str, blocks: &[Block], values: &[T]) -> Result<Self> {
        let sites = blocks.iter().map(|block| block.sites as usize).sum::<usize>();
        let slots = values.len() / sites.max(1);
        let buffer = |block: &Block| {
            let [first, len] = [block.first, block.sites].map(|n| n as usize);
            let own: Vec<T> = (0..slots).flat_map(|s| &values[s * sites + first..][..len]).copied().collect();
            Ok((*block, Buffer::from_slice(device, name, &own)?))
        };
        Ok(Self { blocks: blocks.iter().map(buffer).collect::<Result<_>>()?, slots })
    }

    /// All values, `values[slot * sites + site]` over all sites; waits for the device, once for each block,
    /// so that no more than one is copied at a time.
    ///
    /// # Errors
    /// As [`Buffer::to_vec`].
    pub fn to_vec(&self, device: &Device) -> Result<Vec<T>> {
        if let [(_, only)] = self.blocks.as_slice() {
            return only.to_vec(device);
        }
        let sites = self.sites();
        let mut all = vec![T::zeroed(); self.slots * sites];
        for (block, buffer) in &self.blocks {
            let [first, len] = [block.first, block.sites].map(|n| n as usize);
            let values = buffer.to_vec(device)?;
            for slot in 0..self.slots {
                all[slot * sites + first..][..len].copy_from_slice(&values[slot * len..][..len]);
            }
        }
        Ok(all)
    }
}

impl<T: bytemuck::Pod> Blocked<T> {
    /// Records a copy of all values as [`Blocked::to_vec`] has them, if they are in one buffer.
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download(&self, recorder: &mut Recorder) -> Result<Option<Download<T>>> {
        match self.blocks.as_slice() {
            [(_, only)] => recorder.download(only).map(Some),
            _ => Ok(None),
        }
    }
}

impl<T> Blocked<T> {
    /// The blocks with their buffers.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Block, &Buffer<T>)> {
        self.blocks.iter().map(|(block, buffer)| (*block, buffer))
    }

    /// The blocks.
    pub fn blocks(&self) -> Vec<Block> {
        self.iter().map(|(block, _)| block).collect()
    }

    /// Number of sites.
    pub fn sites(&self) -> usize {
        self.iter().map(|(block, _)| block.sites as usize).sum()
    }

    /// The one buffer with the values of all sites, for kernels that need them together.
    ///
    /// # Errors
    /// [`Error::Internal`] if there are several; the plan of a run's memory must not allow it.
    pub fn whole(&self) -> Result<&Buffer<T>> {
        match self.blocks.as_slice() {
            [(_, only)] => Ok(only),
            blocks => Err(Error::Internal(format!("{} buffers where a kernel takes one", blocks.len()))),
        }
    }
}
