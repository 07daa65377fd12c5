//! `rtfmesh remesh`.

use super::attributes::{AttributeArgs, carried};
use super::files::{InputFormat, Target, input_name, is_standard, tell_notes};
use super::method::{DeviceArgs, MethodArgs, refuse_messages};
use super::progress::{Watch, WatchArgs, begin_writing};
use super::target_count::{SizeArgs, count};
use super::{print, table, tell};
use anyhow::Result;
use rtfmesh::io;
use rtfmesh::io::{Encoding, Format, Loaded};
use rtfmesh::report::Report;
use rtfmesh::report::html::{PageInput, page};
use rtfmesh::{Device, Error, MeasureDepth, Options, Remeshed, Size, preview_repaired, remesh_repaired};
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
    /// Mesh to write; - is standard output. Needed but for --dry-run
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
    attributes: AttributeArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Write a JSON report: options, device, topology, measures, timings; timing every kernel takes time itself
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Write a page for a browser: both meshes side by side to turn, charts, figures, timings
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
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
    let wants_report = args.report.is_some() || args.html.is_some();
    let measures = match (wants_report, args.quiet) {
        (true, _) => MeasureDepth::Full,
        (false, false) => MeasureDepth::Intersections,
        (false, true) => MeasureDepth::Basic,
    };
    let mut options = args.method.options(size, measures)?;
    args.attributes.check(options.method)?;
    let target = args.output.as_deref().map(|path| Target::new(path, args.format)).transpose()?;
    refuse_overwriting(args)?;
    for path in [&args.report, &args.html].into_iter().flatten() {
        io::check_text_target(path)?;
    }
    options.coarse_to_fine.features = args.method.read_features()?;
    let Some(target) = target.filter(|_| !args.dry_run) else { return dry_run(args, size, options) };
    let mut watch = Watch::new(&args.watch)?;
    let (loaded, device) = rayon::join(|| load(args), || args.device.open(wants_report));
    let loaded = loaded?;
    let repaired = count(size, &args.input, &loaded.mesh, &mut options, args.quiet)?;
    ask(args, &loaded, Some(target.format()), &mut options)?;
    let device = device?;
    if !args.quiet {
        watch.show_bar();
    }
    let mut progress = |now| watch.progress(now);
    let result = remesh_repaired(&device, &loaded.mesh, repaired, &options, &mut progress);
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
    let texts = texts(args, &options, &loaded, &device, &result)?;
    // Standard output may wait for its reader for ever.
    let _whole = (!args.output.as_deref().is_some_and(is_standard)).then(begin_writing).transpose()?;
    let attributes = carried(&loaded.mesh, &loaded.attributes, &result);
    target.write(&result.mesh, &attributes, args.quiet)?;
    for (path, text) in texts {
        io::write_text(path, &text)?;
    }
    if !args.quiet {
        tell(&table::run(&result.summary, device.info()));
    }
    Ok(())
}

fn load(args: &Args) -> rtfmesh::Result<Loaded> {
    let loaded = args.input_format.load_with(&args.input, args.attributes.wants_materials())?;
    if !args.quiet {
        tell_notes(&args.input, &loaded.notes);
    }
    Ok(loaded)
}

/// Asks for what carrying attributes over takes, and takes what options want of them.
fn ask(args: &Args, loaded: &Loaded, format: Option<Format>, options: &mut Options) -> rtfmesh::Result<()> {
    let notes = args.attributes.ask(loaded, format, options);
    if !args.quiet {
        tell_notes(&args.input, &notes);
    }
    let read = args.method.read_attributes(&loaded.attributes, options);
    read.map_err(|e| e.in_file(input_name(&args.input)))
}

/// Prints what would be done.
fn dry_run(args: &Args, size: Size, mut options: Options) -> Result<()> {
    let loaded = load(args)?;
    let repaired = count(size, &args.input, &loaded.mesh, &mut options, args.quiet)?;
    ask(args, &loaded, None, &mut options)?;
    let plan = preview_repaired(&loaded.mesh, repaired, &options);
    let plan = plan.map_err(|e| e.in_file(input_name(&args.input)))?;
    let text = table::preview(&plan);
    // Whoever reads standard output for a mesh must not get a table.
    if args.output.as_deref().is_some_and(is_standard) {
        tell(&text);
        return Ok(());
    }
    print(&text)
}

/// What is to be written besides the mesh, and where.
fn texts<'a>(
    args: &'a Args,
    options: &Options,
    loaded: &Loaded,
    device: &Device,
    result: &Remeshed,
) -> Result<Vec<(&'a Path, String)>> {
    let Some(output) = &args.output else { return Ok(Vec::new()) };
    let report = Report {
        program: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        input_file: args.input.display().to_string(),
        output_file: output.display().to_string(),
        notes: &loaded.notes,
        options,
        device: device.info(),
        summary: &result.summary,
    };
    let mut texts = Vec::new();
    if let Some(path) = &args.report {
        texts.push((path.as_path(), report.to_json()?));
    }
    if let Some(path) = &args.html {
        let input = PageInput { report: &report, input: &loaded.mesh, output: &result.mesh };
        texts.push((path.as_path(), page(&input)?));
    }
    Ok(texts)
}

/// Files that are read must not be written, nor one written twice.
fn refuse_overwriting(args: &Args) -> rtfmesh::Result<()> {
    let written = [("--report", "report", &args.report), ("--html", "page", &args.html)];
    let written = written.map(|(option, what, path)| path.as_ref().map(|path| (option, what, path)));
    for (option, what, path) in written.into_iter().flatten() {
        if [args.output.as_ref(), Some(&args.input)].into_iter().flatten().any(|mesh| same_file(path, mesh)) {
            let problem = format!("the {what} would overwrite the mesh in {}", path.display());
            return Err(Error::usage(problem, format!("name another file after {option}")));
        }
    }
    if let [Some((_, _, report)), Some((_, _, page))] = written
        && same_file(report, page)
    {
        let problem = format!("the page would overwrite the report in {}", report.display());
        return Err(Error::usage(problem, "name another file after --html"));
    }
    let Some(features) = args.method.features() else { return Ok(()) };
    let texts = written.into_iter().flatten().map(|(_, _, path)| path);
    if args.output.iter().chain(texts).any(|path| same_file(path, features)) {
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
