//! `rtfmesh remesh`.

use super::{table, tell};
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use rtfmesh::mesh::io;
use rtfmesh::report::Report;
use rtfmesh::{
    Centroid, Device, DeviceOptions, Error, Features, MeasureDepth, Method, Options, Progress, Quality,
    remesh,
};
use std::path::{Path, PathBuf};

/// Turn a triangle mesh into one of well-shaped triangles with exactly N vertices.
///
/// Example: rtfmesh remesh kitten.ply kitten-10k.ply -n 10000 --report kitten.json
#[derive(clap::Args)]
pub struct Args {
    /// Mesh to read: .obj or .ply
    input: PathBuf,
    /// Mesh to write: .obj or .ply
    output: PathBuf,
    /// Vertices of the result
    #[arg(short = 'n', long, value_name = "N")]
    vertices: usize,
    /// Settings to start from: rtf is the paper's method with the paper's settings
    #[arg(long, value_enum, default_value_t = Preset::Default)]
    preset: Preset,
    /// Time against triangles [preset default: normal]
    #[arg(long, value_enum)]
    quality: Option<QualityName>,
    /// Preset rtf: where a site moves in its face: the mean of the corners, close ones counted once, or the centroid
    /// of the area [preset rtf: vertex]
    #[arg(long, value_enum)]
    centroid: Option<CentroidName>,
    /// Preset rtf: sites in a normal's plane fit, the site included [preset rtf: 16]
    #[arg(long, value_name = "K")]
    k_normal: Option<u32>,
    /// Preset rtf: nearest sites that clip a cell [preset rtf: 32]
    #[arg(long, value_name = "K")]
    k_clip: Option<u32>,
    /// Preset rtf: nearest input vertices whose triangles a site is projected onto [preset rtf: 16]
    #[arg(long, value_name = "K")]
    k_project: Option<u32>,
    /// Most iterations, with all vertices [default: 10, or what --quality says; preset rtf: 160]
    #[arg(long, value_name = "COUNT")]
    iterations: Option<u32>,
    /// Stop when the root mean square step is below this many edge lengths [default: 1e-4]
    #[arg(long, value_name = "STEP")]
    tolerance: Option<f64>,
    /// Keep every vertex on the input surface; else they leave it by a little, so that the faces fit it better
    #[arg(long)]
    no_fit: bool,
    /// Edges where the surface turns by at least this angle are sharp and stay; 180: none [default: 40]
    #[arg(long, value_name = "DEGREES")]
    feature_angle: Option<f64>,
    /// OBJ file with lines along edges of the input that stay as well
    #[arg(long, value_name = "FILE.obj")]
    features: Option<PathBuf>,
    /// Weld vertices of the input closer than this share of its bounding box's diagonal [default: 0]
    #[arg(long, value_name = "SHARE")]
    weld: Option<f64>,
    /// Drop components of the input with less than this share of its area [default: 0]
    #[arg(long, value_name = "SHARE")]
    min_component: Option<f64>,
    /// Seed of the random start [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// Write a JSON report: options, device, topology, measures, timings
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Device: index, cpu, gpu or part of a name (see `rtfmesh devices`)
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
    /// No progress bar, notes or table; warnings about the result remain
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Preset {
    /// Coarse to fine: fast, even triangles
    Default,
    /// Restricted tangent faces as in the paper
    Rtf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum QualityName {
    /// Quick
    Draft,
    /// For most uses
    Normal,
    /// As even as it gets
    Best,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum CentroidName {
    /// Mean of the face's corners, close ones counted once (Eq. 7)
    Vertex,
    /// Centroid of the face's area (Eq. 3)
    Area,
}

impl Args {
    /// An option of the other preset would do nothing, and nobody would notice.
    fn refuse_foreign(&self, method: Method) -> rtfmesh::Result<()> {
        let given = [
            ("--quality", Method::CoarseToFine, self.quality.is_some()),
            ("--no-fit", Method::CoarseToFine, self.no_fit),
            ("--feature-angle", Method::CoarseToFine, self.feature_angle.is_some()),
            ("--features", Method::CoarseToFine, self.features.is_some()),
            ("--centroid", Method::Rtf, self.centroid.is_some()),
            ("--k-normal", Method::Rtf, self.k_normal.is_some()),
            ("--k-clip", Method::Rtf, self.k_clip.is_some()),
            ("--k-project", Method::Rtf, self.k_project.is_some()),
        ];
        let Some((name, of, _)) = given.iter().find(|(_, of, given)| *given && *of != method) else {
            return Ok(());
        };
        let preset = if *of == Method::Rtf { "rtf" } else { "default" };
        Err(Error::usage(
            format!("{name} is an option of preset {preset} alone"),
            format!("leave it out, or add --preset {preset}"),
        ))
    }

    fn options(&self) -> rtfmesh::Result<Options> {
        let quality = match self.quality {
            Some(QualityName::Draft) => Quality::Draft,
            Some(QualityName::Normal) | None => Quality::Normal,
            Some(QualityName::Best) => Quality::Best,
        };
        let base = match self.preset {
            Preset::Default => Options::with_quality(self.vertices, quality),
            Preset::Rtf => Options::rtf(self.vertices),
        };
        self.refuse_foreign(base.method)?;
        Ok(Options {
            method: base.method,
            coarsest: base.coarsest,
            first_iterations: base.first_iterations,
            coarse_iterations: base.coarse_iterations,
            polish_rounds: base.polish_rounds,
            fit: base.fit && !self.no_fit,
            vertices: self.vertices,
            feature_angle: self.feature_angle.unwrap_or(base.feature_angle),
            // Read with the mesh, once the other options are known to be right.
            features: base.features,
            weld: self.weld.unwrap_or(base.weld),
            min_component: self.min_component.unwrap_or(base.min_component),
            k_normal: self.k_normal.unwrap_or(base.k_normal),
            k_clip: self.k_clip.unwrap_or(base.k_clip),
            k_project: self.k_project.unwrap_or(base.k_project),
            iterations: self.iterations.unwrap_or(base.iterations),
            tolerance: self.tolerance.unwrap_or(base.tolerance),
            seed: self.seed.unwrap_or(base.seed),
            measures: match (&self.report, self.quiet) {
                (Some(_), _) => MeasureDepth::Full,
                (None, false) => MeasureDepth::Intersections,
                (None, true) => MeasureDepth::Basic,
            },
            centroid: match self.centroid {
                Some(CentroidName::Vertex) => Centroid::Vertex,
                Some(CentroidName::Area) => Centroid::Area,
                None => base.centroid,
            },
        })
    }
}

/// Reads, remeshes, writes. Nothing is written unless everything before it went well.
pub fn run(args: &Args) -> Result<()> {
    let mut options = args.options()?;
    options.validate()?;
    io::check_target(&args.output)?;
    refuse_overwriting(args)?;
    if let Some(report) = &args.report {
        io::check_text_target(report)?;
    }
    if let Some(path) = &args.features {
        options.features = Some(Features { file: Some(path.clone()), lines: io::read_lines(path)? });
    }
    let (loaded, device) = rayon::join(|| io::read(&args.input), || open(args));
    let loaded = loaded?;
    for note in loaded.notes.iter().filter(|_| !args.quiet) {
        tell(&format!("note: {}: {note}\n", args.input.display()));
    }
    let device = device?;
    let bar = progress_bar(args.quiet, options.iterations);
    let result = remesh(&device, &loaded.mesh, &options, &mut |p| show(&bar, p));
    bar.finish_and_clear();
    let result = result.map_err(|e| e.in_file(&args.input))?;
    let messages = device.take_validation_messages();
    if let Some(first) = messages.first() {
        return Err(
            Error::Internal(format!("{} validation messages, the first: {first}", messages.len())).into()
        );
    }
    for remark in result.summary.remarks.iter().filter(|_| !args.quiet) {
        tell(&format!("note: {}: {remark}\n", args.input.display()));
    }
    for warning in &result.summary.warnings {
        tell(&format!("warning: {warning}\n"));
    }
    io::write(&args.output, &result.mesh)?;
    if let Some(path) = &args.report {
        let report = Report {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            input_file: args.input.display().to_string(),
            output_file: args.output.display().to_string(),
            notes: &loaded.notes,
            options: &options,
            device: device.info(),
            summary: &result.summary,
        };
        io::write_text(path, &report.to_json()?)?;
    }
    if !args.quiet {
        tell(&table::run(&result.summary, device.info()));
    }
    Ok(())
}

/// Files that are read must not be written.
fn refuse_overwriting(args: &Args) -> rtfmesh::Result<()> {
    if let Some(report) = &args.report
        && (same_file(report, &args.output) || same_file(report, &args.input))
    {
        let problem = format!("the report would overwrite the mesh in {}", report.display());
        return Err(Error::usage(problem, "name another file after --report"));
    }
    let Some(features) = &args.features else { return Ok(()) };
    if [Some(&args.output), args.report.as_ref()].into_iter().flatten().any(|path| same_file(path, features))
    {
        let problem = format!("the lines in {} would be overwritten", features.display());
        return Err(Error::usage(problem, "name another file after --features"));
    }
    Ok(())
}

/// Whether both names lead to one file, which need not exist yet.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    let full = |path: &Path| std::fs::canonicalize(path).or_else(|_| std::path::absolute(path)).ok();
    a == b || full(a).is_some_and(|a| full(b) == Some(a))
}

fn open(args: &Args) -> Result<Device> {
    let mut wish = DeviceOptions::from_env();
    if args.device.is_some() {
        wish.device.clone_from(&args.device);
    }
    Ok(Device::open(&wish)?)
}

fn progress_bar(quiet: bool, iterations: u32) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    // Drawn on standard error, and only if that is a terminal.
    let style = ProgressStyle::with_template("{bar:40} iteration {pos}/{len}  step {msg}  {eta} left");
    let bar = ProgressBar::new(iterations.into());
    if let Ok(style) = style { bar.with_style(style) } else { bar }
}

fn show(bar: &ProgressBar, progress: Progress) {
    bar.set_length(progress.iterations.into());
    bar.set_message(format!("{:.5}", progress.step));
    bar.set_position(progress.iteration.into());
}
