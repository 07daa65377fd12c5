//! Runs through the library, each done once, however many tables use it.

use crate::markdown::Table;
use crate::models::{Model, Models};
use crate::paper::Paper;
use crate::preset::Preset;
use crate::row::{COLUMNS, Figures, Row};
use anyhow::Result;
use rtfmesh::measure::{energy, measure};
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Device, Error, MeasureDepth, Options, Remesher, Summary};
use std::collections::{BTreeMap, HashMap};

/// A method that took so many seconds on a model is not timed again, because noise is small in comparison.
const LONG: f64 = 5.0;

/// With `--quick`, sizes are divided by the first number, but not below the second.
const QUICK: (usize, usize) = (10, 1000);
/// Most iterations with `--quick`.
const QUICK_ITERATIONS: u32 = 60;

/// The state that all tables share.
pub struct Bench {
    /// The device that runs everything.
    pub device: Device,
    /// The same device, but with timed kernels.
    pub timing: Device,
    /// Source of the meshes.
    pub models: Models,
    /// The paper's figures.
    pub paper: Paper,
    /// Methods to compare.
    pub presets: Vec<Preset>,
    /// Whether the user named them; then none is left out because it takes long.
    pub named: bool,
    /// Most runs that a time is the median of.
    pub runs: usize,
    /// Whether to run smaller sizes and fewer iterations.
    pub quick: bool,
    /// Most vertices of Fig. 8.
    pub largest: usize,
    known: HashMap<String, Row>,
}

impl Bench {
    /// A bench without results; the second device times its kernels.
    pub fn new(
        [device, timing]: [Device; 2],
        models: Models,
        presets: Vec<Preset>,
        runs: usize,
    ) -> Result<Self> {
        let (named, quick, largest) = (false, false, 100_000);
        let paper = Paper::read()?;
        Ok(Self {
            device,
            timing,
            models,
            paper,
            presets,
            named,
            runs,
            quick,
            largest,
            known: HashMap::new(),
        })
    }

    /// A size of the paper, or a tenth of it in a quick run.
    pub fn scaled(&self, vertices: usize) -> usize {
        if self.quick { (vertices / QUICK.0).max(QUICK.1) } else { vertices }
    }

    /// The models in `names` that are available.
    ///
    /// # Errors
    /// Those of reading them.
    pub fn models(&self, names: &[&str]) -> Result<Vec<Model>> {
        let loaded: Vec<Option<Model>> =
            names.iter().map(|name| self.models.load(name)).collect::<Result<_>>()?;
        Ok(loaded.into_iter().flatten().collect())
    }

    /// The result of a preset with its own settings.
    ///
    /// # Errors
    /// As [`Bench::row`].
    pub fn preset(&mut self, model: &Model, preset: Preset, vertices: usize) -> Result<Row> {
        let mut options = preset.options(vertices);
        if self.quick {
            options.iterations = options.iterations.min(QUICK_ITERATIONS);
        }
        self.row(model, preset.name(), &options)
    }

    /// The result of a run, taken from an earlier identical run if there was one. If remeshing fails, the row
    /// says why.
    ///
    /// # Errors
    /// Those of the device.
    pub fn row(&mut self, model: &Model, method: &str, options: &Options) -> Result<Row> {
        let key = format!("{} {method} {}", model.title, serde_json::to_string(options)?);
        if let Some(row) = self.known.get(&key) {
            return Ok(row.clone());
        }
        println!("{}: {method}, {} vertices", model.title, options.vertices);
        let row = match self.timed(model, method, options) {
            Ok(row) => row,
            Err(error @ (Error::Device { .. } | Error::DeviceLost(_))) => return Err(error.into()),
            Err(error) => Row::refused(&model.title, method, options.vertices, error.to_string()),
        };
        self.known.insert(key, row.clone());
        Ok(row)
    }

    fn timed(&self, model: &Model, method: &str, options: &Options) -> rtfmesh::Result<Row> {
        let result = Remesher::new(&self.timing, options.clone())?.remesh(&model.mesh)?;
        let energy = energy(&model.mesh, &result.mesh.vertices)?;
        let first = result.summary;
        let mut seconds = Vec::new();
        // Timing kernels slows short runs down.
        let enough = if time_of(&first) < LONG { self.runs } else { 0 };
        let bare = options.clone().measures(MeasureDepth::Basic);
        let again = Remesher::new(&self.device, bare)?;
        while seconds.len() < enough && seconds.iter().sum::<f64>() < LONG {
            seconds.push(time_of(&again.remesh(&model.mesh)?.summary));
        }
        if seconds.is_empty() {
            seconds.push(time_of(&first));
        }
        Ok(Row {
            model: model.title.clone(),
            method: method.to_owned(),
            wanted: options.vertices,
            iterations: (first.iterations > 0).then_some(first.iterations),
            figures: Some(Figures::of(&first.output, &first.input, Some(energy))),
            runs: seconds.len(),
            seconds: median(&mut seconds),
            stages: stages_of(&first),
            phases: first.timings.phases.iter().map(|p| (p.name, p.milliseconds)).collect(),
            note: first.warnings.join("; "),
        })
    }

    /// The row of the input mesh itself.
    ///
    /// # Errors
    /// If it cannot be measured.
    pub fn input(&self, model: &Model) -> Result<Row> {
        let measures = measure(&model.mesh, None)?;
        let figures =
            Figures { topology: String::new(), ..Figures::of(&measures, &topology(&model.mesh), None) };
        let method = "input".to_owned();
        Ok(Row { model: model.title.clone(), method, figures: Some(figures), ..Row::default() })
    }
}

/// An empty table with [`COLUMNS`] after `first`, and a column for notes.
pub fn table_of_rows(first: &[&'static str]) -> Table {
    Table::new(first.iter().copied().chain(COLUMNS).chain(["note"]))
}

/// Wall time without measuring, which is not part of the method.
fn time_of(summary: &Summary) -> f64 {
    let measured: f64 =
        summary.timings.phases.iter().filter(|p| p.name == "measure").map(|p| p.milliseconds).sum();
    1e-3 * (summary.timings.wall_milliseconds - measured)
}

/// The median; sorts the values.
pub fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.get(values.len().checked_sub(1)? / 2)?, values.get(values.len() / 2)?);
    Some(0.5 * (low + high))
}

/// Device time by kind of work.
fn stages_of(summary: &Summary) -> BTreeMap<&'static str, f64> {
    let mut sums = BTreeMap::new();
    for stage in &summary.timings.stages {
        let kind = match stage.name.split('.').next() {
            Some("neighbours" | "spatial") => "search",
            Some("normals") => "normals",
            Some("face" | "centroid" | "exact") => "face",
            Some("project") => "projection",
            _ => "other",
        };
        *sums.entry(kind).or_insert(0.0) += stage.milliseconds.unwrap_or(0.0);
    }
    sums
}
