//! The iteration of the default pipeline, built from its stages as in
//! `src/pipeline/coarse_to_fine/level.rs`.

use crate::check;
use crate::context::{Context, Group, Model, Work};
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::Vec4;
use rtfmesh::gpu::{Buffer, Device, Recorder};
use rtfmesh::sites::on_surface::SitesOnSurface;
use rtfmesh::stages::face::planar::{PlanarFaces, PlanarInputs, PlanarMove, PlanarOptions};
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists};
use rtfmesh::stages::normals::SmoothNormals;
use rtfmesh::stages::project::walk::Walk;
use rtfmesh::stages::site_layout::SiteLayout;
use rtfmesh::stages::step::Settle;

/// Neighbours in a list.
pub const LIST: u32 = 20;
/// Lists are built again when a site has moved by more than this share of its reach.
const MAX_RHO: f32 = 0.14;
/// A share that no site near rest moves by in a few iterations.
const NEVER: f32 = 0.5;
/// Longest move, in spacings, until the faces are typical.
const LARGEST_MOVE: f64 = 0.5;
/// Share of it from then on, as in the last iterations of a level. A walk over boxes decides what lists do
/// not, and takes the longer the farther sites have moved since the lists were built.
const LATE: f32 = 0.14;
/// No face reaches farther than this many spacings from its site.
const WIDEST: f64 = 2.5;
/// Largest share of the previous motion that is added to a step.
const MOMENTUM: f32 = 0.9;
/// Iterations until the faces are typical.
const RELAX: u32 = 10;

/// The whole iteration, with the lists kept and with the lists built again.
pub const GROUP: Group = Group { kernels: &[KEPT, ANEW], most_sites: usize::MAX, run: whole };

const KEPT: &str = "iteration.lists_kept";
const ANEW: &str = "iteration.lists_anew";

/// What to do with the lists.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Refresh {
    /// The device decides, as in a run.
    Decided,
    /// They are kept, however far the sites moved.
    Kept,
    /// They are built again.
    Anew,
}

/// The stages with their buffers.
pub struct Iteration {
    /// Positions, w = 0.
    pub sites: Buffer<Vec4>,
    /// The triangle under each.
    pub site_triangle: Buffer<u32>,
    /// Their neighbours.
    pub lists: Lists,
    /// Normals of their tangent planes.
    pub normals: SmoothNormals,
    /// Their faces and targets.
    pub faces: PlanarFaces,
    /// The targets on the surface.
    pub walk: Walk,
    /// The move and the surface's normals.
    pub settle: Settle,
    spacing: f64,
    density: f64,
}

impl Iteration {
    /// For `seeds` with this mean spacing, which varies by `density`, and as many iterations as relaxing and
    /// `runs` timed runs take.
    pub fn new(
        device: &Device,
        seeds: &SitesOnSurface,
        spacing: f64,
        runs: u32,
        density: f64,
    ) -> rtfmesh::Result<Self> {
        let n = seeds.len();
        let lists = Lists::new(device, n, &ListOptions::new(LIST))?;
        let iterations = RELAX + 2 * runs;
        Ok(Self {
            sites: Buffer::new(device, "bench.sites", n)?,
            site_triangle: Buffer::from_slice(device, "bench.site_triangle", &seeds.triangles)?,
            normals: SmoothNormals::new(device, n, false, None)?,
            faces: PlanarFaces::new(
                device,
                &lists.neighbours.blocks(),
                &PlanarOptions::new(LIST, iterations),
            )?,
            lists,
            walk: Walk::new(device, n, None)?,
            settle: Settle::new(device, n, iterations, None, SiteLayout::Marked, None)?,
            spacing,
            density,
        })
    }

    /// Iterates until the faces are typical, and builds the lists of the result.
    pub fn relax(&self, device: &Device, model: &Model, seeds: &SitesOnSurface) -> rtfmesh::Result<()> {
        let mut recorder = Recorder::new(device)?;
        let targets: Vec<Vec4> = seeds.positions.iter().map(|p| p.as_vec3().extend(0.0)).collect();
        recorder.upload(&self.faces.targets, &targets)?;
        self.record_move(&mut recorder, model, 0)?;
        self.lists.record_build(&mut recorder, &self.sites)?;
        for iteration in 0..RELAX {
            self.record(&mut recorder, model, Refresh::Decided, iteration)?;
        }
        self.lists.record_build(&mut recorder, &self.sites)?;
        self.normals.record(
            &mut recorder,
            &self.settle.surface_normals,
            &self.lists.neighbours,
            &self.sites,
        )?;
        recorder.submit()?;
        Ok(())
    }

    /// Neighbours → normals → face and centroid → project → step.
    fn record(
        &self,
        recorder: &mut Recorder,
        model: &Model,
        refresh: Refresh,
        iteration: u32,
    ) -> rtfmesh::Result<()> {
        let max_rho = if refresh == Refresh::Decided { MAX_RHO } else { NEVER };
        self.lists.record_refresh(recorder, &self.sites, max_rho)?;
        if refresh == Refresh::Anew {
            self.lists.record_build(recorder, &self.sites)?;
        }
        self.normals.record(recorder, &self.settle.surface_normals, &self.lists.neighbours, &self.sites)?;
        let share = iteration as f32 / (iteration as f32 + 3.0);
        let late = if iteration < RELAX { 1.0 } else { LATE };
        let step = PlanarMove {
            momentum: share.min(MOMENTUM),
            largest_move: late * self.largest_move(),
            ..self.planar_move(iteration)
        };
        self.faces.record(recorder, &self.inputs(), &step)?;
        self.record_move(recorder, model, iteration)
    }

    fn record_move(&self, recorder: &mut Recorder, model: &Model, iteration: u32) -> rtfmesh::Result<()> {
        let targets = &self.faces.targets;
        self.walk.record(recorder, targets, &model.records, &self.site_triangle)?;
        self.settle.record(recorder, &self.walk, targets, &self.sites, iteration)
    }

    /// The inputs of the face kernels.
    pub fn inputs(&self) -> PlanarInputs<'_> {
        PlanarInputs::new(&self.sites, &self.normals.normals, &self.lists)
    }

    /// A step without momentum.
    pub fn planar_move(&self, iteration: u32) -> PlanarMove {
        PlanarMove {
            iteration,
            momentum: 0.0,
            largest_move: self.largest_move(),
            widest: self.widest(),
            exact_within: PlanarMove::ALL,
        }
    }

    /// The longest move: short enough where sites are close together.
    pub fn largest_move(&self) -> f32 {
        (LARGEST_MOVE * self.spacing / self.density) as f32
    }

    /// The farthest that a face reaches: far enough where sites are far apart.
    pub fn widest(&self) -> f32 {
        (WIDEST * self.spacing * self.density) as f32
    }
}

/// Times iterations that start from the relaxed sites, and puts these back.
fn whole(context: &Context) -> Result<Vec<Row>> {
    let it = &context.iteration;
    let builds = || anyhow::Ok(it.lists.status.to_vec(context.device)?[2]);
    let mut rows = Vec::new();
    let mut iteration = RELAX;
    for (kernel, refresh) in [(KEPT, Refresh::Kept), (ANEW, Refresh::Anew)] {
        let before = builds()?;
        let mut record = |recorder: &mut _, _| {
            iteration += 1;
            it.record(recorder, context.model, refresh, iteration - 1)
        };
        let runs = context.times(&mut |number| context.submit(&mut record, number))?;
        let made = builds()? - before;
        let wanted = if refresh == Refresh::Anew { context.runs } else { 0 };
        ensure!(made == wanted, "{kernel}: the lists were built {made} times instead of {wanted}");
        let calls = runs[0].values().map(|(calls, _)| calls).sum();
        let sums = runs.iter().map(|run| run.values().map(|(_, ms)| ms).sum()).collect();
        rows.push(context.row(&Work::new(kernel, 0), calls, sums));
    }
    check::landed(context, &it.sites.to_vec(context.device)?, &it.site_triangle.to_vec(context.device)?)?;
    let steps = it.settle.history.to_vec(context.device)?;
    let step = |i: u32| f64::from(steps[i as usize].x) / context.spacing;
    let (first, last) = (step(0), step(iteration - 1));
    // Sites of uneven density hardly move.
    let least = if context.density > 1.0 { first } else { 0.5 * first };
    ensure!(last > 0.0 && last < least, "the step went from {first} to {last} spacings");
    rows[0].note = format!("step {first:.3} spacings at first, {last:.4} at last");
    put_back(context)?;
    Ok(rows)
}

fn put_back(context: &Context) -> Result<()> {
    let it = &context.iteration;
    let mut recorder = Recorder::new(context.device)?;
    recorder.upload(&it.sites, &context.sites)?;
    recorder.upload(&it.site_triangle, &context.under)?;
    it.lists.record_build(&mut recorder, &it.sites)?;
    // The point of the surface nearest to a site is the site itself; this restores its normal.
    recorder.upload(&it.faces.targets, &context.sites)?;
    it.record_move(&mut recorder, context.model, 0)?;
    recorder.upload(&it.sites, &context.sites)?;
    it.normals.record(&mut recorder, &it.settle.surface_normals, &it.lists.neighbours, &it.sites)?;
    recorder.submit()?;
    Ok(())
}
