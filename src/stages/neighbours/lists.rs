//! Neighbour lists from an implicit hierarchy of boxes, rebuilt only when sites have moved too far.

use crate::gpu::kernels::neighbours::{box_levels, decide, lists, moved};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use crate::stages::blocks::{Block, Blocked};
use crate::stages::site_layout::SiteLayout;
use crate::{Error, Result};
use glam::{UVec4, Vec2, Vec4};

/// Neighbours that a face is first cut by: more than the faces of relaxed sites need.
pub const NEAR: u32 = 12;

/// Sites in a leaf and boxes in a box: fixed in the kernels.
const BRANCH: usize = 8;
/// Levels that the kernel's push constants and its stack have room for.
const MAX_LEVELS: usize = 8;
/// Words of the status: largest moved / reach so far, its value after the decision, number of builds.
const STATUS: usize = 4;

/// One level of boxes.
struct Level {
    /// First box in the buffer.
    start: u32,
    /// Boxes with sites inside.
    boxes: u32,
    /// Boxes rounded up to a multiple of eight.
    padded: u32,
}

/// How the lists are built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ListOptions {
    /// Neighbours of a site, 1 to 32.
    pub k: u32,
    /// Blocks of 32 sites, around a site's own in Morton order, that are searched first; 1 or more.
    pub window: u32,
    /// Whether the lanes of a subgroup of eight keep each other's sites in registers, where a subgroup has
    /// eight lanes.
    pub registers: bool,
    /// Sites in a block of lists; `None`: as many as fit into one buffer.
    pub block: Option<usize>,
    /// How sites are in their buffer.
    pub layout: SiteLayout,
}

impl ListOptions {
    /// Lists of `k` neighbours.
    pub fn new(k: u32) -> Self {
        Self {
            k,
            window: lists::Constants::default().window,
            registers: true,
            block: None,
            layout: SiteLayout::Marked,
        }
    }

    /// Lists of `k` neighbours in blocks, each of which the device makes in a short time.
    pub fn in_blocks(device: &Device, k: u32) -> Self {
        let largest = Block::largest(device, 4 * k as usize);
        Self { block: device.indirect_threads().map(|most| most.min(largest)), ..Self::new(k) }
    }
}

/// The boxes as kernels that walk them take them; see `glsl/common/box_walk.glsl`.
#[derive(Clone, Copy)]
pub struct BoxTree<'a> {
    /// Lower and upper corner of each box, of the sites as they were when the lists were built.
    pub boxes: &'a Buffer<Vec4>,
    /// First box of levels 0 to 3 and 4 to 7.
    pub starts: [UVec4; 2],
    /// Number of levels.
    pub levels: u32,
}

/// The reach of a list that has all other sites, as in `glsl/common/list_bounds.glsl`.
pub const ENDLESS: f32 = 1e18;

/// The neighbour lists of all sites, and when to rebuild them.
///
/// A site that is not in the list of site i was at least `reach[i].y` away when the lists were made. `reach`
/// changes from site to site no faster than the distance between them, so with `rho` the largest moved /
/// reach of all sites, such a site now is at least `away[i].y - 2 * rho * reach[i].y` away.
pub struct Lists {
    boxes_kernel: Pipeline<box_levels::Shader>,
    lists_kernel: Pipeline<lists::Shader>,
    moved_kernel: Pipeline<moved::Shader>,
    decide_kernel: Pipeline<decide::Shader>,
    levels: Vec<Level>,
    boxes: Buffer<Vec4>,
    /// Workgroups of every dispatch that builds the lists: each level, then each block of lists. `groups`: as
    /// decided.
    full: Buffer<UVec4>,
    groups: Buffer<UVec4>,
    /// The nearest sites of each, nearest first, ties by index; [`crate::mesh::NONE`] where there are fewer.
    pub neighbours: Blocked<u32>,
    /// Distances of the nearest site after the first [`NEAR`] (x) and outside
    /// the list (y) when it was made; [`ENDLESS`] if there is none.
    pub reach: Buffer<Vec2>,
    /// Where the sites were when the lists were made, in the same layout. w is for the next time.
    pub list_sites: Buffer<Vec4>,
    /// The reach less the distance that the site itself has moved since.
    pub away: Buffer<Vec2>,
    /// Word 1 has the bits of rho, an `f32`, word 2 the number of times that the lists were made; the rest is
    /// for the kernels.
    pub status: Buffer<u32>,
}

impl Lists {
    /// For `sites` sites.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] or [`Error::Device`].
    pub fn new(device: &Device, sites: usize, options: &ListOptions) -> Result<Self> {
        let levels = levels(sites);
        if levels.len() > MAX_LEVELS {
            return Err(Error::Internal(format!("{sites} sites need {} levels of boxes", levels.len())));
        }
        let subgroup = device.info().limits.subgroup_size;
        let known = options.registers && subgroup == BRANCH as u32;
        let constants = lists::Constants {
            // One subgroup: see the kernel's contract in docs/ARCHITECTURE.md about subgroupBarrier().
            workgroup: subgroup,
            k: options.k,
            lanes: if known { subgroup } else { 0 },
            window: options.window,
            near: NEAR,
            packed: options.layout.packed(),
        };
        let boxes = box_levels::Constants { packed: constants.packed, ..Default::default() };
        let moved = moved::Constants { packed: constants.packed, ..Default::default() };
        let box_count = levels.iter().map(|l| l.padded as usize).sum::<usize>();
        let (boxes_kernel, lists_kernel) = (Pipeline::new(device, boxes)?, Pipeline::new(device, constants)?);
        let recorder = Recorder::new(device)?;
        let mut full: Vec<UVec4> =
            levels.iter().map(|l| recorder.groups(&boxes_kernel, Threads(l.padded as usize))).collect();
        let k = options.k as usize;
        let blocks = Block::divide(sites, options.block.unwrap_or_else(|| Block::largest(device, 4 * k)));
        full.extend(blocks.iter().map(|b| recorder.groups(&lists_kernel, Threads(b.sites as usize))));
        Ok(Self {
            boxes_kernel,
            lists_kernel,
            moved_kernel: Pipeline::new(device, moved)?,
            decide_kernel: Pipeline::new(device, decide::Constants::default())?,
            levels,
            boxes: Buffer::new(device, "neighbours.lists.boxes", 2 * box_count)?,
            groups: Buffer::new(device, "neighbours.lists.groups", full.len())?,
            full: Buffer::from_slice(device, "neighbours.lists.full", &full)?,
            neighbours: Blocked::new(device, "neighbours.lists.neighbours", &blocks, k)?,
            reach: Buffer::new(device, "neighbours.lists.reach", sites)?,
            list_sites: options.layout.buffer(device, "neighbours.lists.sites", sites)?,
            away: Buffer::new(device, "neighbours.lists.away", sites)?,
            status: Buffer::from_slice(device, "neighbours.lists.status", &[0; STATUS])?,
        })
    }

    /// Records building the lists of `sites`, which is fast if these are in Morton order.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_build(&self, recorder: &mut Recorder, sites: &Buffer<Vec4>) -> Result<()> {
        // No move is below zero.
        self.record_decision(recorder, -1.0)?;
        self.record_dispatches(recorder, sites, false)
    }

    /// Records rebuilding the lists if a site has moved more than `max_rho` (0 to 0.5) of its reach since
    /// they were built; the device decides. In any case `away` and the status are up to date afterwards.
    /// There must have been a [`Lists::record_build`] of the sites in the same order.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_refresh(&self, recorder: &mut Recorder, sites: &Buffer<Vec4>, max_rho: f32) -> Result<()> {
        let bindings = moved::Bindings {
            sites,
            list_sites: &self.list_sites,
            reach: &self.reach,
            away: &self.away,
            status: &self.status,
        };
        let push = moved::Push { site_count: self.sites() as u32 };
        recorder.dispatch(&self.moved_kernel, Threads(self.sites()), &push, &bindings)?;
        self.record_decision(recorder, max_rho)?;
        self.record_dispatches(recorder, sites, true)
    }

    /// Number of sites.
    fn sites(&self) -> usize {
        self.reach.len()
    }

    /// The boxes over the sites.
    pub fn tree(&self) -> BoxTree<'_> {
        let start = |i: usize| self.levels.get(i).map_or(0, |l| l.start);
        let starts = [0, 4].map(|first| UVec4::from_array(std::array::from_fn(|i| start(first + i))));
        BoxTree { boxes: &self.boxes, starts, levels: self.levels.len() as u32 }
    }

    fn record_decision(&self, recorder: &mut Recorder, max_rho: f32) -> Result<()> {
        let push = decide::Push { dispatch_count: self.full.len() as u32, max_rho };
        let bindings = decide::Bindings { full: &self.full, groups: &self.groups, status: &self.status };
        recorder.dispatch(&self.decide_kernel, Threads(1), &push, &bindings)
    }

    /// `again`: there are lists already, which tell about where to look.
    fn record_dispatches(&self, recorder: &mut Recorder, sites: &Buffer<Vec4>, again: bool) -> Result<()> {
        if self.sites() == 0 {
            return Ok(());
        }
        let bindings = box_levels::Bindings { sites, boxes: &self.boxes };
        for (i, level) in self.levels.iter().enumerate() {
            let below = i.checked_sub(1).and_then(|b| self.levels.get(b));
            let push = box_levels::Push {
                site_end: if below.is_none() { self.sites() as u32 } else { 0 },
                source: below.map_or(0, |b| b.start),
                target: level.start,
                box_end: level.boxes,
                padded: level.padded,
            };
            recorder.dispatch_indirect(&self.boxes_kernel, &self.groups, i, &push, &bindings)?;
        }
        let BoxTree { starts: [starts_low, starts_high], levels, .. } = self.tree();
        for (i, (block, neighbours)) in self.neighbours.iter().enumerate() {
            let push = lists::Push {
                starts_low,
                starts_high,
                site_count: self.sites() as u32,
                levels,
                first: block.first,
                block_sites: block.sites,
                again: u32::from(again),
            };
            let bindings = lists::Bindings {
                sites,
                boxes: &self.boxes,
                neighbours,
                reach: &self.reach,
                list_sites: &self.list_sites,
                away: &self.away,
            };
            let at = self.levels.len() + i;
            recorder.dispatch_indirect(&self.lists_kernel, &self.groups, at, &push, &bindings)?;
        }
        Ok(())
    }
}

/// Levels of boxes from the leaves up to one of at most eight.
fn levels(sites: usize) -> Vec<Level> {
    let (mut list, mut below, mut start) = (Vec::new(), sites, 0);
    while list.is_empty() || below > BRANCH {
        let boxes = below.div_ceil(BRANCH);
        let padded = boxes.next_multiple_of(BRANCH).max(BRANCH);
        list.push(Level { start: start as u32, boxes: boxes as u32, padded: padded as u32 });
        start += padded;
        below = boxes;
    }
    list
}
