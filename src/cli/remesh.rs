//! `rtfmesh remesh`.

use super::all_at_once::ResearchArgs;
use super::attributes::AttributeArgs;
use super::cloud::CloudArgs;
use super::files::{InputFormat, Target, input_name, is_standard, tell_notes};
use super::heading::OUTPUT;
use super::job::{Finished, Notes, RemeshJob, Request, SurfaceSource};
use super::method::{DeviceArgs, MethodArgs};
use super::progress;
use super::progress::{ProgressArgs, Reading, RunProgress, begin_writing};
use super::target_count::SizeArgs;
use super::terminal::{print, tell};
use super::volume::VolumeArgs;
use super::wrap::WrapArgs;
use super::{table, words};
use crate::error::shown;
use anyhow::Result;
use clap::ArgAction;
use rtfmesh::glam::DVec3;
use rtfmesh::io;
use rtfmesh::io::{Encoding, Input};
use rtfmesh::report::html::{PageInput, page};
use rtfmesh::{CellColours, CellMesh, CorrespondenceRequest, Error, MeasureDepth, Options, Size};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  rtfmesh remesh scan.ply scan-10k.ply -n 10k
  rtfmesh remesh part.stl part.ply --edge-length 1% --feature-angle 30";

const LONG_EXAMPLES: &str = "Examples:
  rtfmesh remesh scan.ply scan-10k.ply -n 10k --report scan.json
  rtfmesh remesh part.stl part.ply --edge-length 1% --feature-angle 30
  rtfmesh remesh scan.ply adapted.ply -n 10k --sizing curvature --max-edge 5%
  rtfmesh remesh points.xyz mesh.ply -n 10k
  rtfmesh remesh ct.nii.gz bone.ply -n 50k --iso 300
  rtfmesh remesh scan.ply --dry-run --ratio 0.1
  zcat scan.ply.gz | rtfmesh remesh - - --format glb --ratio 0.1 > out.glb";

/// Remesh a surface into well-shaped triangles with exactly N vertices.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = LONG_EXAMPLES, disable_help_flag = true)]
pub struct Args {
    /// Mesh, points or volume to read; - is standard input
    input: PathBuf,
    /// Mesh to write, such as out.ply, .obj, .stl or .glb; - is standard output
    #[arg(required_unless_present = "dry_run")]
    output: Option<PathBuf>,
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    attributes: AttributeArgs,
    #[command(flatten)]
    cloud: CloudArgs,
    #[command(flatten)]
    volume: VolumeArgs,
    #[command(flatten)]
    input_format: InputFormat,
    #[command(flatten)]
    out: OutputArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    progress: ProgressArgs,
    #[command(flatten)]
    research: ResearchArgs,
}

/// What is written and printed.
#[derive(clap::Args)]
#[command(next_help_heading = OUTPUT)]
struct OutputArgs {
    /// Output format, regardless of the extension
    ///
    /// One of obj, ply, stl, off, glb, mesh, vtp, vtu, vtk and 3mf, each also with .gz.
    #[arg(long, value_name = "FORMAT", hide_short_help = true)]
    format: Option<Encoding>,
    /// Write a JSON report: quality, distances, topology, timings
    ///
    /// It also contains the options and the device. Distances to the input are measured and kernels are
    /// timed, which takes a little time.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Write a web page with both meshes, charts and figures
    ///
    /// It is one file that needs no network. Distances to the input are measured.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// Write the cells of the vertices as polygons (.obj or .ply), coloured
    ///
    /// With the presets rtf, rpf and rvc these are the tangent faces of the sites, else the exact Voronoi
    /// cells of the vertices on the input: a group of polygons for each, one for each triangle that it lies
    /// in. PLY has the vertex of each polygon as `cell`, OBJ groups.
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    cells: Option<PathBuf>,
    /// With --cells: what the colours tell
    #[arg(long, value_enum, value_name = "WHAT", default_value_t = ColoursOfCells::Area, requires = "cells",
        hide_short_help = true)]
    cell_color: ColoursOfCells,
    /// Relative width of the reported Hausdorff intervals, 1e-6 to 0.5 [default: 0.01]
    ///
    /// Relative to the upper end. Gaps below 5e-7 of the diagonal always count as converged.
    #[arg(long, value_name = "FRACTION", hide_short_help = true)]
    accuracy: Option<f64>,
    /// Print the plan and write nothing; needs no device
    #[arg(long, hide_short_help = true)]
    dry_run: bool,
    /// Print only warnings
    #[arg(long, short, conflicts_with = "verbose")]
    quiet: bool,
    /// Print all figures of the result and of the run
    #[arg(long, short)]
    verbose: bool,
    /// Print help: -h the common options, --help all
    #[arg(long, short, action = ArgAction::Help)]
    help: Option<bool>,
}

/// What colours of cells tell.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum ColoursOfCells {
    /// Their areas: white for the mean, blue for half of it, red for double
    Area,
    /// The numbers of neighbours: white for six, blue for fewer, red for more
    Valence,
}

impl Args {
    /// Whether the input is wrapped first.
    pub fn wraps(&self) -> bool {
        self.method.wrap.detail().is_some()
    }

    /// Wraps the input first.
    pub fn wrap_at(&mut self, wrap: WrapArgs) {
        self.method.wrap = wrap;
    }
}

/// Reads, remeshes, writes. Nothing is written unless everything before succeeded. Returns the exit code.
pub fn run(args: &Args) -> Result<u8> {
    let size = args.size.size()?;
    // All other options are checked before anything is read.
    let wants_report = args.out.report.is_some() || args.out.html.is_some();
    let measures = match (wants_report, args.out.quiet) {
        (true, _) => MeasureDepth::Full,
        (false, false) => MeasureDepth::Intersections,
        (false, true) => MeasureDepth::Basic,
    };
    let mut options = args.method.options(&args.research, size, measures)?;
    if let Some(accuracy) = args.out.accuracy {
        if !wants_report {
            let problem = "--accuracy works only with --report and --html";
            return Err(Error::usage(problem, "remove it, or add one of them").into());
        }
        options.accuracy = accuracy;
        options.validate()?;
    }
    args.attributes.check(options.method)?;
    let target = args.output.as_deref().map(|path| Target::new(path, args.out.format)).transpose()?;
    refuse_overwriting(args)?;
    options.cells = args.out.cells.is_some();
    check_targets(&args.out)?;
    let mut run = RunProgress::new(&args.progress)?;
    args.method.read_files(&run, &mut options)?;
    let Some(target) = target.filter(|_| !args.out.dry_run) else {
        return dry_run(args, (size, options), run).map(|()| 0);
    };
    if let Some(output) = args.output.as_deref().filter(|_| !args.out.quiet)
        && same_file(output, &args.input)
        && !is_standard(output)
    {
        tell(&format!("note: {} will be replaced by the result\n", shown(output)));
    }
    if args.cloud.normals_only() {
        return write_normals(args, &target, &run).map(|()| 0);
    }
    let reading = begin_reading(args, &run);
    let device = args.device.open(wants_report);
    let (mut input, device) = (wait_for(args, reading)?, device?);
    if !args.out.quiet {
        run.show_bar();
    }
    let points = args.out.html.as_ref().and_then(|_| points_of(&input));
    let mut notes = notes(args, &mut input);
    options.format = Some(target.format());
    let mut job = RemeshJob::new(request(args, size, options), source(args, input)?, &mut notes, &mut run)?;
    let Finished { mut result, attributes, is_cut_short } = job.remesh(&device, &mut run)?;
    words::warnings(&mut result.summary.warnings);
    if !args.out.quiet {
        tell_notes(&args.input, &result.summary.remarks);
    }
    for warning in &result.summary.warnings {
        tell(&format!("warning: {warning}\n"));
    }
    let files = [&args.input, &args.output.clone().unwrap_or_default()].map(|p| p.display().to_string());
    let report = job.report(&device, &result.summary, &notes, files);
    let input = &job.loaded.mesh;
    let page = PageInput { report: &report, input, points: points.as_deref(), output: &result.mesh };
    let others = others(args, &page, result.cells.as_ref())?;
    // Standard output may wait for its reader for ever.
    let _whole = (!args.output.as_deref().is_some_and(is_standard)).then(begin_writing).transpose()?;
    target.write_all(&result.mesh, &attributes, &others, args.out.quiet)?;
    if !args.out.quiet {
        tell(&if args.out.verbose {
            table::run(&result.summary, device.info())
        } else {
            table::outcome(&result.summary)
        });
    }
    Ok(if is_cut_short { progress::CANCELLED } else { 0 })
}

fn begin_reading(args: &Args, run: &RunProgress) -> Reading<Input> {
    let (format, path) = (args.input_format.clone(), args.input.clone());
    let with_materials = args.attributes.wants_materials();
    run.begin_reading(move || format.load_any(&path, with_materials))
}

fn wait_for(args: &Args, reading: Reading<Input>) -> rtfmesh::Result<Input> {
    let input = reading.wait(input_name(&args.input))?;
    if !args.out.quiet {
        tell_notes(&args.input, input.notes());
    }
    Ok(input)
}

/// The points of what was read, if it has no faces.
fn points_of(input: &Input) -> Option<Vec<DVec3>> {
    match input {
        Input::Mesh(loaded) if loaded.mesh.triangles.is_empty() => Some(loaded.mesh.vertices.clone()),
        _ => None,
    }
}

/// What the surface is made from, of what was read.
fn source(args: &Args, input: Input) -> rtfmesh::Result<SurfaceSource<'_>> {
    match input {
        Input::Volume(volume) => {
            let closed = args.cloud.closes_volume(&args.input)?;
            args.volume.source(volume, &args.input, closed)
        }
        Input::Mesh(loaded) => {
            args.volume.refuse_mesh(&args.input)?;
            args.cloud.source(loaded, &args.input)
        }
    }
}

/// The notes, which begin with those of reading.
fn notes<'a>(args: &'a Args, input: &mut Input) -> Notes<'a> {
    let read = match input {
        Input::Mesh(loaded) => &mut loaded.notes,
        Input::Volume(volume) => &mut volume.notes,
    };
    Notes::new(std::mem::take(read), (!args.out.quiet).then_some(args.input.as_path()))
}

fn request(args: &Args, size: Size, options: Options) -> Request<'_> {
    Request {
        method: &args.method,
        attributes: &args.attributes,
        size,
        options,
        sizing: None,
        correspondence: CorrespondenceRequest::NONE,
        file: Some(input_name(&args.input)),
    }
}

/// Writes points with outward normals in place of a mesh.
fn write_normals(args: &Args, target: &Target, run: &RunProgress) -> Result<()> {
    let input = wait_for(args, begin_reading(args, run))?;
    let (points, attributes) = args.cloud.with_normals(input.mesh_or_points()?, &args.input)?;
    let _whole = (!args.output.as_deref().is_some_and(is_standard)).then(begin_writing).transpose()?;
    target.write(&points, &attributes, args.out.quiet)
}

/// Prints the plan.
fn dry_run(args: &Args, (size, options): (Size, Options), mut run: RunProgress) -> Result<()> {
    let mut input = wait_for(args, begin_reading(args, &run))?;
    let mut notes = notes(args, &mut input);
    let job = RemeshJob::new(request(args, size, options), source(args, input)?, &mut notes, &mut run)?;
    let plan = job.preview()?;
    let text = table::preview(&plan);
    // Whoever reads standard output for a mesh must not get a table.
    if args.output.as_deref().is_some_and(is_standard) {
        tell(&text);
        return Ok(());
    }
    print(&text)
}

/// Checks whether the files besides the mesh can be written.
fn check_targets(out: &OutputArgs) -> rtfmesh::Result<()> {
    out.cells.iter().try_for_each(|path| io::check_cells_target(path))?;
    [&out.report, &out.html].into_iter().flatten().try_for_each(io::check_text_target)
}

/// The files to write besides the mesh, with their paths.
fn others<'a>(
    args: &'a Args,
    about: &PageInput,
    cells: Option<&CellMesh>,
) -> Result<Vec<(&'a Path, Vec<u8>)>> {
    let mut texts = Vec::new();
    if let (Some(path), Some(cells)) = (&args.out.cells, cells) {
        let by = match args.out.cell_color {
            ColoursOfCells::Area => CellColours::Area,
            ColoursOfCells::Valence => CellColours::Valence,
        };
        texts.push((path.as_path(), io::encode_cells(path, cells, &cells.colours(by, about.output))?));
    }
    if let Some(path) = &args.out.report {
        texts.push((path.as_path(), about.report.to_json()?.into_bytes()));
    }
    if let Some(path) = &args.out.html {
        texts.push((path.as_path(), page(about)?.into_bytes()));
    }
    Ok(texts)
}

/// No file may be both read and written, except for the mesh itself, and none written twice.
fn refuse_overwriting(args: &Args) -> rtfmesh::Result<()> {
    let written = [
        ("--report", "report", &args.out.report),
        ("--html", "page", &args.out.html),
        ("--cells", "cells", &args.out.cells),
    ];
    let written = written.map(|(option, what, path)| path.as_ref().map(|path| (option, what, path)));
    let mut earlier: Vec<(&str, &Path)> = Vec::new();
    for (option, what, path) in written.into_iter().flatten() {
        let meshes = [args.output.as_ref(), Some(&args.input)].into_iter().flatten();
        let meshes = meshes.map(|mesh| ("mesh", mesh.as_path()));
        if let Some((other, _)) =
            meshes.chain(earlier.iter().copied()).find(|(_, other)| same_file(path, other))
        {
            let problem = format!("the {what} would overwrite the {other} in {}", shown(path));
            return Err(Error::usage(problem, format!("choose another file for {option}")));
        }
        earlier.push((what, path));
    }
    let read = [
        ("--features", "feature lines", args.method.features()),
        ("--points", "points", args.method.points()),
    ];
    for (option, what, path) in read {
        let texts = written.into_iter().flatten().map(|(_, _, path)| path);
        if let Some(read) =
            path.filter(|read| args.output.iter().chain(texts).any(|path| same_file(path, read)))
        {
            let problem = format!("the {what} in {} would be overwritten", shown(read));
            return Err(Error::usage(problem, format!("choose different files for {option} and the output")));
        }
    }
    Ok(())
}

/// Whether both names lead to one file, which need not exist yet.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    a == b || full_path(a).is_some_and(|a| full_path(b) == Some(a))
}

/// The one name of a file that all its names lead to; a file that does not exist yet keeps its own.
pub(super) fn full_path(path: &Path) -> Option<PathBuf> {
    std::fs::canonicalize(path).or_else(|_| std::path::absolute(path)).ok()
}
