//! `rtfmesh remesh`.

use super::files::{InputFormat, Target, input_name, is_standard, tell_notes};
use super::method::{DeviceArgs, MethodArgs, refuse_messages};
use super::size::{SizeArgs, count};
use super::watch::{Watch, WatchArgs};
use super::{print, table, tell};
use anyhow::Result;
use rtfmesh::mesh::io::{self, Encoding, Loaded};
use rtfmesh::report::Report;
use rtfmesh::{Device, Error, MeasureDepth, Options, Size, Summary, preview, remesh};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  rtfmesh remesh kitten.ply kitten-10k.ply -n 10000 --report kitten.json
  rtfmesh remesh part.stl part.ply --edge-length 1% --feature-angle 30
  zcat scan.ply.gz | rtfmesh remesh - - --format glb --ratio 0.1 > out.glb";

/// Turn a triangle mesh into one of well-shaped triangles with exactly N vertices.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Mesh to read; - is standard input
    input: PathBuf,
    /// Mesh to write; - is standard output
    #[arg(required_unless_present = "dry_run")]
    output: Option<PathBuf>,
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    input_format: InputFormat,
    /// Format to write, whatever the extension: obj, ply, stl, off, glb or mesh, each also with .gz
    #[arg(long, value_name = "FORMAT")]
    format: Option<Encoding>,
    /// Print what would be done, and write nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Write a JSON report: options, device, topology, measures, timings
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    /// No progress bar, notes or table; warnings about the result remain
    #[arg(long, short)]
    quiet: bool,
}

/// Reads, remeshes, writes. Nothing is written unless everything before it went well.
pub fn run(args: &Args) -> Result<()> {
    let size = args.size.size()?;
    // All other options are checked before anything is read.
    let measures = match (&args.report, args.quiet) {
        (Some(_), _) => MeasureDepth::Full,
        (None, false) => MeasureDepth::Intersections,
        (None, true) => MeasureDepth::Basic,
    };
    let mut options = args.method.options(size, measures)?;
    let target = args.output.as_deref().map(|path| Target::new(path, args.format)).transpose()?;
    refuse_overwriting(args)?;
    if let Some(report) = &args.report {
        io::check_text_target(report)?;
    }
    options.features = args.method.read_features()?;
    let Some(target) = target.filter(|_| !args.dry_run) else { return dry_run(args, size, options) };
    let mut watch = Watch::new(&args.watch)?;
    let (loaded, device) = rayon::join(|| load(args), || args.device.open());
    let loaded = loaded?;
    options.vertices = count(size, &args.input, &loaded.mesh, args.quiet)?;
    let device = device?;
    if !args.quiet {
        watch.show_bar();
    }
    let result = remesh(&device, &loaded.mesh, &options, &mut |now| watch.progress(now));
    watch.end();
    let mut result = result.map_err(|e| e.in_file(input_name(&args.input)))?;
    refuse_messages(&device)?;
    watch.warn(&mut result.summary);
    if !args.quiet {
        tell_notes(&args.input, &result.summary.remarks);
    }
    for warning in &result.summary.warnings {
        tell(&format!("warning: {warning}\n"));
    }
    // Standard output may wait for its reader for ever.
    let _whole =
        (!args.output.as_deref().is_some_and(is_standard)).then(|| watch.begin_writing()).transpose()?;
    target.write(&result.mesh, args.quiet)?;
    write_report(args, &options, &loaded, &device, &result.summary)?;
    if !args.quiet {
        tell(&table::run(&result.summary, device.info()));
    }
    Ok(())
}

fn load(args: &Args) -> rtfmesh::Result<Loaded> {
    let loaded = args.input_format.load(&args.input)?;
    if !args.quiet {
        tell_notes(&args.input, &loaded.notes);
    }
    Ok(loaded)
}

/// Prints what would be done.
fn dry_run(args: &Args, size: Size, mut options: Options) -> Result<()> {
    let loaded = load(args)?;
    options.vertices = count(size, &args.input, &loaded.mesh, args.quiet)?;
    let plan = preview(&loaded.mesh, &options).map_err(|e| e.in_file(input_name(&args.input)))?;
    let text = table::preview(&plan);
    // Whoever reads standard output for a mesh must not get a table.
    if args.output.as_deref().is_some_and(is_standard) {
        tell(&text);
        return Ok(());
    }
    print(&text)
}

fn write_report(
    args: &Args,
    options: &Options,
    loaded: &Loaded,
    device: &Device,
    summary: &Summary,
) -> Result<()> {
    let (Some(path), Some(output)) = (&args.report, &args.output) else { return Ok(()) };
    let report = Report {
        program: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        input_file: args.input.display().to_string(),
        output_file: output.display().to_string(),
        notes: &loaded.notes,
        options,
        device: device.info(),
        summary,
    };
    Ok(io::write_text(path, &report.to_json()?)?)
}

/// Files that are read must not be written.
fn refuse_overwriting(args: &Args) -> rtfmesh::Result<()> {
    if let Some(report) = &args.report
        && [args.output.as_ref(), Some(&args.input)].into_iter().flatten().any(|path| same_file(report, path))
    {
        let problem = format!("the report would overwrite the mesh in {}", report.display());
        return Err(Error::usage(problem, "name another file after --report"));
    }
    let Some(features) = args.method.features() else { return Ok(()) };
    if [args.output.as_ref(), args.report.as_ref()]
        .into_iter()
        .flatten()
        .any(|path| same_file(path, features))
    {
        let problem = format!("the lines in {} would be overwritten", features.display());
        return Err(Error::usage(problem, "name another file after --features"));
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
