//! One level of the default pipeline: a number of sites, relaxed on the device.

use crate::Result;
use crate::gpu::{Buffer, Device, Download, Recorder, Submitted};
use crate::mesh::chunks::CHUNK;
use crate::pipeline::near_sites::LIST;
use crate::pipeline::submission::{Pace, require_moves};
use crate::progress::ProgressReporter;
use crate::sites::on_surface::SitesOnSurface;
use crate::stages::blocks::Block;
use crate::stages::face::planar::{PlanarFaces, PlanarInputs, PlanarMove, PlanarOptions};
use crate::stages::flags::FlagCounts;
use crate::stages::neighbours::lists::{ListOptions, Lists};
use crate::stages::normals::SmoothNormals;
use crate::stages::pins::PinnedSites;
use crate::stages::project::walk::Walk;
use crate::stages::records::TriangleRecords;
use crate::stages::site_layout::SiteLayout;
use crate::stages::sizing::{DeviceSizes, Sizing};
use crate::stages::step::{KeepOff, Settle};
use glam::Vec4;
use rayon::prelude::*;

/// Lists are built again when a site has moved by more than this fraction of its reach.
const MAX_RHO: f32 = 0.14;
/// Largest distance of a face's points from its site, in spacings.
const WIDEST: f64 = 2.5;
/// Number of iterations at the end of a level whose faces are exact even where the lists do not decide them.
const EXACT: u32 = 10;
/// Where sizes vary, faces that reach this many times as far as their lists stay as these leave them: those
/// of needles among sites that are far closer together than the largest size. Hundreds of sites may cut such
/// a face, and its centroid is not to be trusted.
const HOPELESS: f32 = 3.0;
/// Iterations between two checks of the step size.
const PER_CHECK: u32 = 10;
/// Largest product of sites and checks in a submission of a coarse level: at each check, all results are
/// copied, some 110 bytes a site. What follows the check at which the step is small enough is in vain.
const CHECKED: usize = 1 << 19;
/// Checks in a submission of a coarse level, at most: each has copies of its own.
const MOST_CHECKS: usize = 16;
/// With at most this many sites, all results are copied to the host at once.
const SMALL: usize = 1 << 16;

/// Limits on the moves of a level.
///
/// A few sites at tips and folds never come to rest, and their moves make it necessary to build all lists
/// again. So the limits shrink with the iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moves {
    /// Longest move of the first iteration, in spacings.
    pub largest: f64,
    /// After this many iterations it is half of that, after twice as many a third, and so on.
    pub halved: f64,
    /// Largest share of the last motion that is added to a step.
    pub momentum: f32,
}

impl Moves {
    /// For scattered sites.
    pub const SCATTERED: Self = Self { largest: 0.5, halved: 5.0, momentum: MOMENTUM };
    /// For sites that come from a coarser level and have their order already.
    pub const REFINED: Self = Self { largest: 0.25, halved: 4.0, momentum: MOMENTUM };

    /// In spacings.
    fn longest(&self, iteration: u32) -> f64 {
        self.largest / (1.0 + f64::from(iteration) / self.halved)
    }
}

const MOMENTUM: f32 = 0.9;

/// How a level is relaxed and connected.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelOptions {
    pub spacing: f64,
    /// Whether edge lengths differ.
    pub has_sizes: bool,
    pub iterations: u32,
    pub moves: Moves,
    /// Whether no finer one follows.
    pub is_last: bool,
}

/// The stages for a number of sites, with their buffers.
pub(crate) struct Level {
    sites: Buffer<Vec4>,
    layout: SiteLayout,
    site_triangle: Buffer<u32>,
    lists: Lists,
    normals: SmoothNormals,
    faces: PlanarFaces,
    walk: Walk,
    settle: Settle,
    /// On surfaces with curves.
    keep_off: Option<KeepOff>,
    /// If edge lengths differ.
    sizing: Option<Sizing>,
    spacing: f64,
    iterations: u32,
    moves: Moves,
    /// Checks of the step size in a submission, at most. With more than one, each has copies of the results.
    checks: u32,
}

/// The surface on the device.
#[derive(Clone, Copy)]
pub(crate) struct DeviceSurface<'a> {
    pub records: &'a TriangleRecords,
    /// If edge lengths differ.
    pub sizes: Option<&'a DeviceSizes>,
}

/// The initial sites of a level.
pub(crate) struct Start {
    /// All sites, in Morton order.
    pub sites: SitesOnSurface,
    /// The sites in the form that the device needs on surfaces with curves.
    pub pinned: Option<PinnedSites>,
}

/// Relaxed sites.
pub(crate) struct Relaxed {
    pub sites: SitesOnSurface,
    /// Same as [`crate::sites::cells::CellSites::near`].
    pub near: Vec<u32>,
    /// Root mean square distance to the centroid of every iteration, in spacings.
    pub steps: Vec<f64>,
    /// Counts in the last iteration: faces that no site bounds within `WIDEST` spacings, stopped walks.
    pub flags: FlagCounts,
}

/// What is copied to the host in the end.
struct Results {
    positions: Download<Vec4>,
    triangles: Download<u32>,
    walked: Download<Vec4>,
    counts: Vec<Download<u32>>,
    near: Option<Download<u32>>,
}

impl Level {
    /// Compiles all kernels for surfaces without curves, in parallel; later levels find them ready.
    ///
    /// # Errors
    /// As [`Level::new`].
    pub fn compile(device: &Device) -> Result<()> {
        // Threads begin at the start and in the middle of the list, so what takes longest stands there.
        let parts: [&(dyn Fn() -> Result<()> + Sync); 6] = [
            &|| PlanarFaces::compile_exact(device),
            &|| Lists::new(device, 1, &ListOptions::new(LIST)).map(drop),
            &|| Walk::new(device, 1, None).map(drop),
            &|| PlanarFaces::new(device, &Block::divide(1, 1), &PlanarOptions::new(LIST, 1)).map(drop),
            &|| SmoothNormals::new(device, 1, false, None).map(drop),
            &|| Settle::new(device, 1, 1, None, SiteLayout::Marked, None).map(drop),
        ];
        parts.par_iter().try_for_each(|part| part())
    }

    pub fn new(device: &Device, start: &Start, options: &LevelOptions) -> Result<Self> {
        let LevelOptions { spacing, has_sizes, iterations, moves, is_last } = *options;
        let Start { sites, pinned } = start;
        let n = sites.len();
        let curves = pinned.is_some();
        // Marks need their place; memory.rs refuses what then does not fit.
        let layout = if curves { SiteLayout::Marked } else { SiteLayout::fitting(device, n) };
        let lists = Lists::new(device, n, &ListOptions { layout, ..ListOptions::in_blocks(device, LIST) })?;
        let faces = PlanarOptions { layout, ..PlanarOptions::new(LIST, iterations) };
        // The last level may be ended early, so it does not compute what may be left out.
        let has_few_checks =
            is_last || n > SMALL || device.has_memory_limit() || lists.neighbours.blocks().len() > 1;
        Ok(Self {
            sites: layout.buffer(device, "default.sites", n)?,
            layout,
            site_triangle: Buffer::from_slice(device, "default.site_triangle", &sites.triangles)?,
            normals: SmoothNormals::new(device, n, curves, None)?,
            faces: PlanarFaces::new(device, &lists.neighbours.blocks(), &faces)?,
            lists,
            walk: Walk::new(device, n, None)?,
            settle: Settle::new(device, n, iterations, pinned.as_ref().map(|p| p.moving), layout, None)?,
            keep_off: curves.then(|| KeepOff::new(device, has_sizes, None)).transpose()?,
            sizing: has_sizes.then(|| Sizing::new(device, n, curves, layout, None)).transpose()?,
            spacing,
            iterations,
            moves,
            checks: if has_few_checks { 1 } else { (CHECKED / n.max(1)).min(MOST_CHECKS) as u32 },
        })
    }

    /// Iterates until the root mean square step is below `tolerance` spacings, which is checked every few
    /// iterations, or the run is to finish early.
    pub fn relax(
        &self,
        device: &Device,
        start: &Start,
        surface: &DeviceSurface,
        tolerance: f64,
        progress: &mut ProgressReporter,
    ) -> Result<Relaxed> {
        let mut steps = Vec::new();
        let mut recorder = Recorder::new(device)?;
        // The seeds are the first targets; projection onto the surface gives them their normals.
        let positions = start.sites.positions.par_iter().with_min_len(CHUNK);
        let targets: Vec<Vec4> = positions.map(|p| p.as_vec3().extend(0.0)).collect();
        recorder.upload(&self.faces.targets, &targets)?;
        if let Some(pinned) = &start.pinned {
            recorder.upload(&self.sites, &pinned.sites)?;
            recorder.upload(&self.settle.surface_normals, &pinned.normals)?;
        }
        self.settle.record_begin(&mut recorder)?;
        self.record_move(&mut recorder, surface, 0)?;
        self.lists.record_build(&mut recorder, &self.sites)?;
        let mut pace = Pace::new(start.sites.len(), PER_CHECK * self.checks);
        loop {
            let begin = steps.len() as u32;
            let end = self.end_of_submission(begin, pace.iterations);
            pace.begin();
            // Of each iteration that may be the last.
            let mut results = Vec::new();
            for iteration in begin..end {
                self.record_iteration(&mut recorder, surface, iteration)?;
                let end = iteration + 1;
                if end == self.iterations || (self.is_check(end) && self.checks > 1) {
                    results.push((end, self.record_results(&mut recorder)?));
                }
            }
            let history = recorder.download(&self.settle.history)?;
            let done = recorder.submit()?;
            pace.end((end - begin).max(1));
            let history = done.view(&history)?;
            let step = |iteration: u32| f64::from(history[iteration as usize].x) / self.spacing;
            let converged = (begin..end).find(|i| self.is_check(i + 1) && step(*i) < tolerance);
            let end = converged.map_or(end, |i| i + 1);
            steps.extend((begin..end).map(step));
            progress.iterated(end, self.iterations, steps.last().copied().unwrap_or(0.0))?;
            if end == self.iterations || converged.is_some() || progress.leave_out() {
                require_moves(device, &steps)?;
                return match results.iter().find(|(last, _)| *last == end) {
                    Some((_, results)) => self.relaxed(device, &done, results, steps),
                    None => {
                        let mut recorder = Recorder::new(device)?;
                        let results = self.record_results(&mut recorder)?;
                        self.relaxed(device, &recorder.submit()?, &results, steps)
                    }
                };
            }
            recorder = Recorder::new(device)?;
        }
    }

    /// Whether the step size is checked after this many iterations.
    fn is_check(&self, iterations: u32) -> bool {
        iterations.is_multiple_of(PER_CHECK) || iterations == self.iterations
    }

    /// After which iteration a submission ends that has at most `most` of them: at a check if it gets to one,
    /// at the last where each has copies of the results.
    fn end_of_submission(&self, begin: u32, most: u32) -> u32 {
        let end = (begin + most).min(self.iterations);
        let mut checks = (begin + 1..=end).filter(|end| self.is_check(*end));
        let last = if self.checks > 1 { checks.next_back() } else { checks.next() };
        last.unwrap_or(end)
    }

    /// Neighbours → normals → face and centroid → project → step.
    fn record_iteration(
        &self,
        recorder: &mut Recorder,
        surface: &DeviceSurface,
        iteration: u32,
    ) -> Result<()> {
        self.lists.record_refresh(recorder, &self.sites, MAX_RHO)?;
        self.normals.record(recorder, &self.settle.surface_normals, &self.lists.neighbours, &self.sites)?;
        let inputs = PlanarInputs::new(&self.sites, &self.normals.normals, &self.lists);
        // Nesterov's sequence; the last iteration is a plain one, so that sites end in their centroids.
        let share = iteration as f32 / (iteration as f32 + 3.0);
        let last = iteration + 1 == self.iterations;
        let longest = self.moves.longest(iteration) * self.spacing;
        let largest = surface.sizes.map_or(1.0, |sizes| sizes.range[1]);
        let step = PlanarMove {
            iteration,
            momentum: if last { 0.0 } else { share.min(self.moves.momentum) },
            largest_move: (longest * largest) as f32,
            widest: (WIDEST * self.spacing * largest) as f32,
            exact_within: self.exact_within(iteration),
        };
        self.faces.record(recorder, &inputs, &step)?;
        if let (Some(sizing), Some(sizes)) = (&self.sizing, surface.sizes) {
            sizing.record_lengths(recorder, sizes, &self.sites, &self.site_triangle)?;
            let moves = (&self.faces.targets, &self.faces.centroids);
            sizing.record_drift(recorder, &inputs, moves, longest as f32)?;
        }
        if let Some(keep_off) = &self.keep_off {
            let lengths = self.sizing.as_ref().map(|sizing| &sizing.lengths);
            keep_off.record(recorder, &inputs, &self.faces.targets, self.spacing, lengths)?;
        }
        self.record_move(recorder, surface, iteration)
    }

    /// See [`PlanarMove::exact_within`].
    fn exact_within(&self, iteration: u32) -> f32 {
        match &self.sizing {
            _ if iteration + EXACT < self.iterations => 0.0,
            Some(_) => HOPELESS,
            None => PlanarMove::ALL,
        }
    }

    fn record_move(&self, recorder: &mut Recorder, surface: &DeviceSurface, iteration: u32) -> Result<()> {
        let targets = &self.faces.targets;
        self.walk.record(recorder, targets, surface.records, &self.site_triangle)?;
        self.settle.record(recorder, &self.walk, targets, &self.sites, iteration)
    }

    /// Whether all results are copied to the host at once.
    fn is_small(&self) -> bool {
        self.lists.neighbours.sites() <= SMALL
    }

    /// Records copies of the results.
    fn record_results(&self, recorder: &mut Recorder) -> Result<Results> {
        // Of many sites one copy after the other, for what they take of the memory.
        let near = if self.is_small() { self.lists.neighbours.download(recorder)? } else { None };
        Ok(Results {
            positions: recorder.download(&self.sites)?,
            triangles: recorder.download(&self.site_triangle)?,
            walked: recorder.download(&self.walk.normals)?,
            counts: self.faces.download_counts(recorder)?,
            near,
        })
    }

    /// The results from their copies.
    fn relaxed(
        &self,
        device: &Device,
        done: &Submitted,
        results: &Results,
        steps: Vec<f64>,
    ) -> Result<Relaxed> {
        let triangles: Vec<u32> = done.read(&results.triangles)?;
        let positions = self.layout.unpack(done.view(&results.positions)?, triangles.len());
        let last = (steps.len() as u32).checked_sub(1);
        let open = |last| self.faces.read_counts(done, &results.counts, last).map(|counts| counts.open);
        let near = results.near.as_ref();
        Ok(Relaxed {
            sites: SitesOnSurface {
                positions: positions.into_par_iter().map(|p| p.as_dvec3()).collect(),
                triangles,
            },
            // They may be from before the last moves; they are candidates, no more.
            near: near.map_or_else(|| self.lists.neighbours.to_vec(device), |near| done.read(near))?,
            flags: FlagCounts {
                unbounded: last.map_or(Ok(0), open)?,
                walk_stopped: Walk::stopped(done.view(&results.walked)?),
                ..FlagCounts::default()
            },
            steps,
        })
    }
}
