//! Shared by all measurements: the surface, relaxed sites on it, samples to check, and the clock.

use crate::iteration::Iteration;
use crate::reference::knn::nearest;
use crate::results::Row;
use anyhow::{Result, ensure};
use glam::{DVec3, Vec4};
use rtfmesh::gpu::{Device, Recorder};
use rtfmesh::io;
use rtfmesh::mesh::repair::repair;
use rtfmesh::mesh::samples;
use rtfmesh::mesh::sizing::SizeField;
use rtfmesh::mesh::unit_frame::UnitFrame;
use rtfmesh::sites::on_surface::SitesOnSurface;
use rtfmesh::sites::seed;
use rtfmesh::sites::surface::Surface;
use rtfmesh::stages::records::TriangleRecords;
use std::collections::BTreeMap;
use std::path::Path;

/// Kernels that are measured together.
pub struct Group {
    /// Their dotted names.
    pub kernels: &'static [&'static str],
    /// Largest number of sites to run with.
    pub most_sites: usize,
    /// Checks the results, then measures the time.
    pub run: fn(&Context) -> Result<Vec<Row>>,
}

/// The size up to which quadratic and slow kernels are run.
pub const SMALL: usize = 10_000;

/// A surface on host and device.
pub struct Model {
    /// The built-in model, or the file without folder and extension.
    pub name: String,
    /// The repaired mesh in the unit-diagonal frame.
    pub surface: Surface,
    /// Its triangles for the walk and the search.
    pub records: TriangleRecords,
    /// The corners of its triangles as the device sees them.
    pub corners: Vec<[DVec3; 3]>,
}

impl Model {
    /// Loads a built-in model, or else a file.
    pub fn load(device: &Device, name: &str) -> Result<Self> {
        let known = samples::names().iter().any(|(sample, _)| *sample == name);
        let mesh = if known { samples::sample(name)? } else { io::read(Path::new(name))?.mesh };
        let mesh = repair(&mesh)?.mesh;
        let surface = Surface::new(&mesh, &UnitFrame::of(&mesh)?);
        let records = TriangleRecords::new(device, &surface, None)?;
        let point = |v: &u32| surface.vertices[*v as usize].as_vec3().as_dvec3();
        let corners = surface.triangles.iter().map(|t| t.each_ref().map(point)).collect();
        let name = Path::new(name).file_stem().map_or(name.into(), |stem| stem.to_string_lossy());
        Ok(Self { name: name.into_owned(), surface, records, corners })
    }
}

/// One surface with relaxed sites.
pub struct Context<'a> {
    /// The device that is measured.
    pub device: &'a Device,
    /// The surface.
    pub model: &'a Model,
    /// The stages of the default pipeline with the sites.
    pub iteration: Iteration,
    /// Edge length of a perfect layout, of the mean density if it varies.
    pub spacing: f64,
    /// How many times farther apart the sites are at one end than at the other.
    pub density: f64,
    /// Number of timed runs.
    pub runs: u32,
    /// The relaxed sites as they are on the device.
    pub sites: Vec<Vec4>,
    /// The same in f64.
    pub points: Vec<DVec3>,
    /// The triangle under each.
    pub under: Vec<u32>,
    /// Sites that are compared with the references.
    pub samples: Vec<usize>,
    /// For each sample its [`Context::KNOWN`] nearest other sites, by the reference.
    pub near: Vec<Vec<u32>>,
}

/// One kernel of a measurement.
pub struct Work {
    /// Dotted name.
    pub kernel: &'static str,
    /// Bytes that all its dispatches in a run must read and write at least.
    pub bytes: usize,
    /// A remark for the table.
    pub note: String,
}

impl Work {
    /// Work without a note.
    pub fn new(kernel: &'static str, bytes: usize) -> Self {
        Self { kernel, bytes, note: String::new() }
    }
}

/// `count` sites chosen from many more seeds, fewer and fewer along x, so that their distances vary by
/// `ratio`.
fn uneven(model: &Model, count: usize, ratio: f64) -> SitesOnSurface {
    // Enough that sites are well spread at the dense end, too.
    let all = seed::stratified(&model.surface, &SizeField::default(), 16 * count, 1);
    let (low, high) = all.positions.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.x), h.max(p.x)));
    let weight = |p: &DVec3| ratio.powf(-2.0 * (p.x - low) / (high - low));
    let sum: f64 = all.positions.iter().map(weight).sum();
    let mut seeds = SitesOnSurface::with_capacity(count);
    let mut passed = 0.0;
    for (site, triangle) in all.positions.iter().zip(&all.triangles) {
        passed += weight(site) * count as f64 / sum;
        // Shifted by a half, so that rounding cannot lose the last one.
        if seeds.len() < count && seeds.len() as f64 + 0.5 <= passed {
            seeds.push(*site, *triangle);
        }
    }
    seeds
}

impl<'a> Context<'a> {
    /// Number of known neighbours of a sample.
    pub const KNOWN: usize = 64;

    /// Places and relaxes `count` sites, `density` times farther apart at one end than at the other.
    pub fn new(device: &'a Device, model: &'a Model, count: usize, runs: u32, density: f64) -> Result<Self> {
        let seeds = if density > 1.0 {
            uneven(model, count, density)
        } else {
            seed::stratified(&model.surface, &SizeField::default(), count, 1)
        };
        let spacing = (2.0 * model.surface.area() / (3.0_f64.sqrt() * count as f64)).sqrt();
        let iteration = Iteration::new(device, &seeds, spacing, runs, density)?;
        iteration.relax(device, model, &seeds)?;
        let sites = iteration.sites.to_vec(device)?;
        let points: Vec<DVec3> = sites.iter().map(|s| s.truncate().as_dvec3()).collect();
        let under = iteration.site_triangle.to_vec(device)?;
        // The references look at every site, so fewer samples are compared when there are more sites.
        let wanted = (20_000_000 / count).clamp(24, 96);
        let samples: Vec<usize> = (0..wanted).map(|s| s * count / wanted).collect();
        let queries: Vec<DVec3> = samples.iter().map(|s| points[*s]).collect();
        let mut near = nearest(&queries, &points, Self::KNOWN + 1, false);
        for (list, own) in near.iter_mut().zip(&samples) {
            list.retain(|j| *j as usize != *own);
        }
        Ok(Self { device, model, iteration, spacing, density, runs, sites, points, under, samples, near })
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.sites.len()
    }

    /// Submits what `record` records; `record` gets the number of the submission.
    pub fn submit(
        &self,
        record: &mut dyn FnMut(&mut Recorder, u32) -> rtfmesh::Result<()>,
        number: u32,
    ) -> Result<()> {
        let mut recorder = Recorder::new(self.device)?;
        record(&mut recorder, number)?;
        recorder.submit()?;
        Ok(())
    }

    /// Submits what `record` records as often as asked for, and gives a row for each of `kernels`. These must
    /// have run before, as they have if they were checked, because lavapipe compiles a kernel at its first
    /// dispatch.
    pub fn time(
        &self,
        kernels: &[Work],
        record: &mut dyn FnMut(&mut Recorder, u32) -> rtfmesh::Result<()>,
    ) -> Result<Vec<Row>> {
        self.time_runs(kernels, &mut |number| self.submit(record, number))
    }

    /// [`Context::time`] of what takes several submissions; `run` gets the number of the run.
    pub fn time_runs(&self, kernels: &[Work], run: &mut dyn FnMut(u32) -> Result<()>) -> Result<Vec<Row>> {
        let runs = self.times(run)?;
        let mut rows = Vec::new();
        for work in kernels {
            let found: Vec<(u64, f64)> =
                runs.iter().filter_map(|run| run.get(work.kernel).copied()).collect();
            ensure!(found.len() == runs.len(), "{} was not dispatched", work.kernel);
            rows.push(self.row(work, found[0].0, found.iter().map(|f| f.1).collect()));
        }
        Ok(rows)
    }

    /// Dispatches and milliseconds of every kernel, for each timed run.
    pub fn times(&self, run: &mut dyn FnMut(u32) -> Result<()>) -> Result<Vec<BTreeMap<String, (u64, f64)>>> {
        let mut runs = Vec::new();
        for number in 1..=self.runs {
            self.device.take_timings();
            run(number)?;
            let times = self.device.take_timings().into_iter();
            let known = times.filter_map(|t| Some((t.name, (t.calls, t.milliseconds?))));
            runs.push(known.filter(|(name, _)| !name.starts_with("copy.")).collect());
        }
        Ok(runs)
    }

    /// The row of one kernel with its time in each run.
    pub fn row(&self, work: &Work, calls: u64, mut milliseconds: Vec<f64>) -> Row {
        milliseconds.sort_by(f64::total_cmp);
        let median = milliseconds[milliseconds.len() / 2];
        Row {
            calls,
            median_milliseconds: median,
            min_milliseconds: milliseconds[0],
            microseconds_per_site: 1e3 * median / self.len() as f64,
            bytes: work.bytes as u64,
            gigabytes_per_second: if median > 0.0 { 1e-6 * work.bytes as f64 / median } else { 0.0 },
            ..Row::refused(work.kernel, self.model, self.len(), work.note.clone())
        }
    }
}
