//! Restricted tangent faces in the plane, by intervals on their lines: faces, centroids and targets of the
//! default pipeline.
//!
//! Three kernels, each for the faces that the one before leaves undecided: by the nearest neighbours, by the
//! whole list, and by a walk through the boxes to all sites near enough. So faces do not depend on the length
//! of the lists.

use crate::Result;
use crate::gpu::kernels::face::{planar, planar_exact, planar_rest};
use crate::gpu::{Buffer, Device, Download, Pipeline, Recorder, Submitted, Threads};
use crate::stages::blocks::{Block, Blocked};
use crate::stages::neighbours::lists::{BoxTree, Lists, NEAR};
use crate::stages::site_layout::SiteLayout;
use glam::{Vec2, Vec4};

/// What the kernels read of the sites.
#[derive(Clone, Copy)]
pub struct PlanarInputs<'a> {
    /// Positions; w = 0, or the marks of [`crate::stages::pins`].
    pub sites: &'a Buffer<Vec4>,
    /// Unit normals of the tangent planes, packed as in `glsl/common/octahedral.glsl`.
    pub normals: &'a Buffer<u32>,
    /// Lists, nearest first.
    pub neighbours: &'a Blocked<u32>,
    /// How near the sites after the first [`NEAR`] (x) and outside the list (y) may be, had only the site
    /// itself moved since the list was made.
    pub away: &'a Buffer<Vec2>,
    /// Word 1 has the bits of rho, the largest way gone since then relative to a site's own reach.
    pub status: &'a Buffer<u32>,
    /// The boxes that were made with the lists.
    pub tree: BoxTree<'a>,
}

impl<'a> PlanarInputs<'a> {
    /// Sites with packed normals and their lists.
    pub fn new(sites: &'a Buffer<Vec4>, normals: &'a Buffer<u32>, lists: &'a Lists) -> Self {
        let Lists { neighbours, away, status, .. } = lists;
        Self { sites, normals, neighbours, away, status, tree: lists.tree() }
    }
}

/// How the kernels are set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlanarOptions {
    /// Length of the lists, 1 or more. Faces do not depend on it.
    pub k: u32,
    /// Most iterations.
    pub iterations: u32,
    /// Edges that a face may have at any time while it is clipped, 3 or more; faces with more take longer.
    pub slots: u32,
    /// Invocations of a workgroup; `None`: the kernels' own.
    pub workgroup: Option<u32>,
    /// How sites are in their buffer.
    pub layout: SiteLayout,
}

impl PlanarOptions {
    /// For lists of `k` and at most `iterations` iterations.
    pub fn new(k: u32, iterations: u32) -> Self {
        let slots = planar_exact::Constants::default().slots;
        Self { k, iterations, slots, workgroup: None, layout: SiteLayout::Marked }
    }

    /// For a kernel of few invocations: where its `own` are less than a subgroup, lanes would be idle.
    fn workgroup_of(&self, device: &Device, own: u32) -> u32 {
        self.workgroup.unwrap_or(own.max(device.info().limits.subgroup_size))
    }

    fn exact(&self, device: &Device) -> planar_exact::Constants {
        let own = planar_exact::Constants::default().workgroup;
        planar_exact::Constants {
            workgroup: self.workgroup_of(device, own),
            slots: self.slots,
            packed: self.layout.packed(),
        }
    }
}

/// With at most this many sites, each has a thread for faces that the lists do not decide.
const FEW: u32 = 4096;

/// The size of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarMove {
    /// Number of this iteration.
    pub iteration: u32,
    /// Share of the last motion that is added, 0 to 1.
    pub momentum: f32,
    /// Longest step, in the unit-diagonal frame.
    pub largest_move: f32,
    /// No face reaches farther from its site.
    pub widest: f32,
    /// Faces that the lists do not decide are completed by the walk if they reach less than this many times
    /// as far as their lists; all are with [`PlanarMove::ALL`], and none with 0. Others stay as the lists
    /// leave them, maybe too large, which does while sites still move far.
    pub exact_within: f32,
}

impl PlanarMove {
    /// All faces are completed.
    pub const ALL: f32 = 1e9;

    /// Whether any face is completed by the walk.
    fn is_exact(&self) -> bool {
        self.exact_within > 0.0
    }
}

/// Faces of one iteration that needed more work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlanarCounts {
    /// Not decided by the first [`NEAR`] neighbours: left to the whole list.
    pub undecided_by_near: usize,
    /// Not decided by the list either: left to the walk, which always decides.
    pub undecided_by_list: usize,
    /// Bounded by the disc of radius [`PlanarMove::widest`], since no site clips them there, as at the tip of
    /// an ear.
    pub open: usize,
}

/// Faces, their centroids, and targets with momentum.
pub struct PlanarFaces {
    near: Pipeline<planar::Shader>,
    rest: Pipeline<planar_rest::Shader>,
    /// Of the kernel of the walk, which is compiled when it is first needed.
    exact: planar_exact::Constants,
    device: Device,
    /// Targets of the sites, w = squared distance to the centroid.
    pub targets: Buffer<Vec4>,
    /// The area centroids of the last iteration; w = 0 before the first.
    pub centroids: Buffer<Vec4>,
    /// For each block of sites, counts of every iteration, then lists for the kernels; see
    /// `glsl/face/planar_targets.glsl`.
    insecure: Vec<Buffer<u32>>,
    iterations: u32,
}

/// A block of sites, its lists, and what is written of it.
struct Listed<'a> {
    own: Block,
    neighbours: &'a Buffer<u32>,
    insecure: &'a Buffer<u32>,
    targets: Buffer<Vec4>,
    centroids: Buffer<Vec4>,
}

/// Push constants and bindings of one of the two kernels that read lists.
macro_rules! listed {
    ($kernel:ident, $faces:expr, $inputs:expr, $step:expr, $block:expr $(, $more:ident: $value:expr)*) => {
        (
            $kernel::Push {
                first: $block.own.first,
                block_sites: $block.own.sites,
                iteration: $step.iteration,
                iterations: $faces.iterations,
                momentum: $step.momentum,
                largest_move: $step.largest_move,
                widest: $step.widest,
                $($more: $value,)*
            },
            $kernel::Bindings {
                sites: $inputs.sites,
                normals: $inputs.normals,
                neighbours: $block.neighbours,
                away: $inputs.away,
                status: $inputs.status,
                targets: &$block.targets,
                centroids: &$block.centroids,
                insecure: $block.insecure,
            },
        )
    };
}

impl PlanarFaces {
    /// For sites with lists in these `blocks`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, blocks: &[Block], options: &PlanarOptions) -> Result<Self> {
        let PlanarOptions { k, iterations, slots, workgroup, layout } = *options;
        let packed = layout.packed();
        let mut near = planar::Constants { k: NEAR.min(k), packed, ..Default::default() };
        let mut rest = planar_rest::Constants { k, slots, packed, ..Default::default() };
        near.workgroup = workgroup.unwrap_or(near.workgroup);
        rest.workgroup = options.workgroup_of(device, rest.workgroup);
        let sites = blocks.iter().map(|block| block.sites as usize).sum();
        let words = |block: &Block| 3 * iterations as usize + 4 * block.sites as usize;
        let insecure = |block: &Block| Buffer::zeros(device, "default.face.insecure", words(block));
        // The first time they are compiled, which takes a while.
        let (near, rest) = rayon::join(|| Pipeline::new(device, near), || Pipeline::new(device, rest));
        Ok(Self {
            near: near?,
            rest: rest?,
            exact: options.exact(device),
            device: device.clone(),
            targets: Buffer::of_windows(device, "default.face.targets", sites)?,
            centroids: Buffer::of_windows(device, "default.face.centroids", sites)?.zeroed(device)?,
            insecure: blocks.iter().map(insecure).collect::<Result<_>>()?,
            iterations,
        })
    }

    /// Compiles the kernel of the walk, which takes as long as all others, for [`PlanarOptions::new`].
    ///
    /// # Errors
    /// [`crate::Error::Device`].
    pub fn compile_exact(device: &Device) -> Result<()> {
        let options = PlanarOptions::new(1, 1);
        Pipeline::<planar_exact::Shader>::new(device, options.exact(device)).map(drop)
    }

    /// Records all rounds of one iteration.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        inputs: &PlanarInputs<'_>,
        step: &PlanarMove,
    ) -> Result<()> {
        let blocks = self.blocks(inputs)?;
        for block in &blocks {
            let (push, bindings) = listed!(planar, self, inputs, step, block);
            recorder.dispatch(&self.near, Threads(block.own.sites as usize), &push, &bindings)?;
        }
        // Few faces are left; both kernels loop over them with however many threads they have.
        for block in &blocks {
            let (threads, within) = (block.own.sites.div_ceil(16), step.exact_within);
            let (push, bindings) =
                listed!(planar_rest, self, inputs, step, block, threads: threads, exact_within: within);
            recorder.dispatch(&self.rest, Threads(threads as usize), &push, &bindings)?;
        }
        if step.is_exact() { self.record_exact(recorder, inputs, &blocks, step) } else { Ok(()) }
    }

    fn record_exact(
        &self,
        recorder: &mut Recorder,
        inputs: &PlanarInputs<'_>,
        blocks: &[Listed<'_>],
        step: &PlanarMove,
    ) -> Result<()> {
        let exact = Pipeline::<planar_exact::Shader>::new(&self.device, self.exact)?;
        for Listed { own: block, insecure, targets, centroids, .. } in blocks {
            // Not too many for each thread: lavapipe ends a thread after 65,535 rounds of all its loops
            // together. There are few such faces unless there are few sites at all.
            let threads = block.sites.min(FEW).max(block.sites.div_ceil(4));
            let push = planar_exact::Push {
                starts_low: inputs.tree.starts[0],
                starts_high: inputs.tree.starts[1],
                levels: inputs.tree.levels,
                site_count: inputs.neighbours.sites() as u32,
                first: block.first,
                block_sites: block.sites,
                iteration: step.iteration,
                iterations: self.iterations,
                momentum: step.momentum,
                largest_move: step.largest_move,
                widest: step.widest,
                threads,
            };
            let bindings = planar_exact::Bindings {
                sites: inputs.sites,
                normals: inputs.normals,
                boxes: inputs.tree.boxes,
                targets,
                centroids,
                insecure,
            };
            recorder.dispatch(&exact, Threads(threads as usize), &push, &bindings)?;
        }
        Ok(())
    }

    /// The blocks of sites, each with its buffers.
    fn blocks<'a>(&'a self, inputs: &PlanarInputs<'a>) -> Result<Vec<Listed<'a>>> {
        let listed = |((own, neighbours), insecure): ((Block, &'a Buffer<u32>), &'a Buffer<u32>)| {
            let [targets, centroids] = [&self.targets, &self.centroids].map(|all| own.window(all));
            Ok(Listed { own, neighbours, insecure, targets: targets?, centroids: centroids? })
        };
        inputs.neighbours.iter().zip(&self.insecure).map(listed).collect()
    }

    /// What happened in `iteration`; waits for the device.
    ///
    /// # Errors
    /// As [`Buffer::to_vec`].
    pub fn counts(&self, iteration: u32) -> Result<PlanarCounts> {
        let mut recorder = Recorder::new(&self.device)?;
        let copies = self.download_counts(&mut recorder)?;
        self.read_counts(&recorder.submit()?, &copies, iteration)
    }

    /// Records a copy of the counts of all iterations, for [`PlanarFaces::read_counts`].
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download_counts(&self, recorder: &mut Recorder) -> Result<Vec<Download<u32>>> {
        let counters = 3 * self.iterations as usize;
        self.insecure.iter().map(|block| recorder.download_first(block, counters)).collect()
    }

    /// The counts of an iteration from a copy.
    ///
    /// # Errors
    /// As [`Submitted::read`].
    pub fn read_counts(
        &self,
        downloads: &Submitted,
        copies: &[Download<u32>],
        iteration: u32,
    ) -> Result<PlanarCounts> {
        let mut counts = PlanarCounts::default();
        for copy in copies {
            let words = downloads.read(copy)?;
            let count =
                |kind| words.get((kind * self.iterations + iteration) as usize).map_or(0, |c| *c as usize);
            counts.undecided_by_near += count(0);
            counts.undecided_by_list += count(1);
            counts.open += count(2);
        }
        Ok(counts)
    }
}
