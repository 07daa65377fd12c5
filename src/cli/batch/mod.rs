//! `rtfmesh batch`.

pub(super) mod inputs;
mod log;
mod table;
mod workers;

use super::all_at_once::ResearchArgs;
use super::attributes::AttributeArgs;
use super::cloud::HoleArgs;
use super::files::InputFormat;
use super::heading::OUTPUT;
use super::method::{DeviceArgs, MethodArgs};
use super::progress;
use super::progress::RunProgress;
use super::remesh::{full_path, same_file};
use super::target_count::SizeArgs;
use super::terminal::tell;
use crate::error::shown;
use anyhow::Result;
use clap::{ArgAction, value_parser};
use inputs::{Job, Shard};
use log::{Entry, Log, Status};
use rtfmesh::io;
use rtfmesh::io::{Encoding, Format};
use rtfmesh::{Error, MeasureDepth, Options, Size};
use std::path::{Path, PathBuf};
use std::time::Instant;
use workers::Batch;

const EXAMPLES: &str = "Examples:
  rtfmesh batch scans --out remeshed -n 10k
  rtfmesh batch a.stl b.obj parts --out remeshed --edge-length 1% --format obj
  rtfmesh batch @all.txt --out remeshed --ratio 0.1 --resume
  rtfmesh batch scans --out remeshed -n 10k --shard 3/16 --log logs/3.jsonl";

const SHORT_EXAMPLES: &str = "Examples:
  rtfmesh batch scans --out remeshed -n 10k
  rtfmesh batch @all.txt --out remeshed --ratio 0.1 --resume";

/// Remesh many files with the same options on one device
///
/// The log gets a JSON line for each mesh: input, output, status (done, failed, skipped), input_stamp and
/// output_stamp (sizes and times), vertices, mean_quality, min_angle, rms and hausdorff (with --distances),
/// options, asked (a digest of the options), warnings, notes, seconds, error. A mesh that fails does not stop
/// the others; the exit code is then 1. After Ctrl-C finished meshes remain, and --resume continues.
#[derive(clap::Args)]
#[command(after_help = SHORT_EXAMPLES, after_long_help = EXAMPLES, disable_help_flag = true)]
pub struct Args {
    /// Files of meshes or points, folders, or @LIST with a path on each line
    ///
    /// Folders are searched recursively; results keep their structure. Files that end in .txt, .csv or .asc
    /// are read as points only if they are named directly or in a list.
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    attributes: AttributeArgs,
    #[command(flatten)]
    holes: HoleArgs,
    #[command(flatten)]
    input_format: InputFormat,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    research: ResearchArgs,
}

/// What is taken and written.
#[derive(clap::Args)]
#[command(next_help_heading = OUTPUT)]
struct OutputArgs {
    /// Folder for the results, created if missing; each is named after its input
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Format of the results, such as obj or ply.gz
    ///
    /// One of obj, ply, stl, off, glb, mesh, vtp, vtu, vtk and 3mf, each also with .gz.
    #[arg(long, value_name = "FORMAT", default_value_t = Encoding { format: Format::Ply, gzip: false })]
    format: Encoding,
    /// Log to append to [default: DIR/batch.jsonl]
    #[arg(long, value_name = "FILE.jsonl", hide_short_help = true)]
    log: Option<PathBuf>,
    /// Finally write the log of these meshes as a table with a row for each
    ///
    /// The columns are those of the log without options and stamps, the rows are in the order of the inputs.
    /// Meshes that --resume skips have the figures of the run that made them.
    #[arg(long, value_name = "FILE.csv", hide_short_help = true)]
    table: Option<PathBuf>,
    /// Skip inputs that are done with the same options, according to the log
    ///
    /// Sizes and times of the input and its result must be those in the log. The device may differ.
    #[arg(long)]
    resume: bool,
    /// Take every n-th of the sorted inputs, starting with the i-th
    ///
    /// For n jobs in parallel, with one log or several.
    #[arg(long, value_name = "i/n", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Same as --shard, counted from 0: the rank of this process
    #[arg(long, value_name = "R", requires = "world_size", conflicts_with = "shard", hide_short_help = true)]
    rank: Option<usize>,
    /// With --rank: the number of processes that share the inputs
    #[arg(long, value_name = "W", requires = "rank", hide_short_help = true)]
    world_size: Option<usize>,
    /// Number of meshes in work at the same time, 1 to 64 [default: 1]
    ///
    /// Several small meshes keep a GPU or many cores busier than one. Each needs its own device memory. The
    /// log lists them in the order in which they finish.
    #[arg(long, value_name = "J", value_parser = value_parser!(u8).range(1..=64), hide_short_help = true)]
    jobs: Option<u8>,
    /// Measure the distances between each result and its input
    #[arg(long, hide_short_help = true)]
    distances: bool,
    /// Also write the cells of each result as polygons: those of scan.ply to scan.cells.ply or .obj
    ///
    /// They are coloured by their areas; see `rtfmesh remesh --cells`.
    #[arg(long, value_enum, value_name = "FORMAT", hide_short_help = true)]
    cells: Option<CellFormat>,
    /// Relative width of the Hausdorff intervals, 1e-6 to 0.5 [default: 0.01]
    ///
    /// Relative to the upper end. Gaps below 5e-7 of the diagonal always count as converged.
    #[arg(long, value_name = "FRACTION", requires = "distances", hide_short_help = true)]
    accuracy: Option<f64>,
    /// Do not print a line for each mesh
    #[arg(long, short)]
    quiet: bool,
    /// Print help: -h the common options, --help all
    #[arg(long, short, action = ArgAction::Help)]
    help: Option<bool>,
}

/// The format of cells.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum CellFormat {
    /// A face for each polygon, with the number of its cell
    Ply,
    /// A group for each cell
    Obj,
}

impl OutputArgs {
    /// The file of a result's cells, if they are wanted.
    fn cells_of(&self, output: &Path) -> Option<PathBuf> {
        let format = match self.cells? {
            CellFormat::Ply => "ply",
            CellFormat::Obj => "obj",
        };
        // A packed result has two extensions.
        let plain = if self.format.gzip { output.with_extension("") } else { output.to_owned() };
        Some(plain.with_extension(format!("cells.{format}")))
    }

    /// The part of the inputs that was asked for in either way.
    fn shard(&self) -> rtfmesh::Result<Option<Shard>> {
        match (self.rank, self.world_size) {
            (Some(rank), Some(size)) => Shard::of_rank(rank, size).map(Some),
            _ => Ok(self.shard),
        }
    }
}

/// A digest of all that is asked for but the device, 16 hexadecimal digits: FNV-1a of 64 bits (Fowler, Noll
/// and Vo), which is the same on every machine and with every compiler.
fn digest(args: &Args, size: Size, options: &Options) -> rtfmesh::Result<String> {
    let options = serde_json::to_string(options).map_err(|error| Error::Internal(error.to_string()))?;
    let (attributes, from, to) = (&args.attributes, &args.input_format, args.output.format);
    let asked = format!("{size:?} {attributes:?} {from:?} {to:?} {:?} {options}", args.holes);
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    Ok(format!("{:016x}", asked.bytes().fold(0xcbf2_9ce4_8422_2325, step)))
}

/// Reads, remeshes and writes one mesh after another.
pub fn run(args: &Args) -> Result<()> {
    let begin = Instant::now();
    let size = args.size.size()?;
    let measures = if args.output.distances { MeasureDepth::Full } else { MeasureDepth::Basic };
    let mut options = args.method.options(&args.research, size, measures)?;
    options.accuracy = args.output.accuracy.unwrap_or(options.accuracy);
    options.cells = args.output.cells.is_some();
    options.validate()?;
    args.attributes.check(options.method)?;
    io::target_encoding(Path::new(&format!("result.{}", args.output.format)))?;
    let jobs = inputs::jobs(&args.inputs, &args.output.out, args.output.format)?;
    let log_path = args.output.log.clone().unwrap_or_else(|| args.output.out.join("batch.jsonl"));
    refuse_overwriting(args, &jobs, &log_path)?;
    progress::handle_interrupts()?;
    args.method.read_files(&RunProgress::unlimited(), &mut options)?;
    let jobs = match args.output.shard()? {
        Some(shard) => shard.select(jobs),
        None => jobs,
    };
    make_folder(&args.output.out)?;
    if let Some(table) = &args.output.table {
        io::check_text_target(table)?;
    }
    let mut log = Log::open(&log_path)?;
    let asked = &digest(args, size, &options)?;
    let (skipped, left): (Vec<Job>, Vec<Job>) =
        jobs.iter().cloned().partition(|job| args.output.resume && log.has(job, asked));
    for job in &skipped {
        log.add(&Entry::new(job, Status::Skipped, asked))?;
    }
    let workers = usize::from(args.output.jobs.unwrap_or(1));
    let failed = Batch { args, size, options, asked }.run(&left, workers, &mut log)?;
    if let Some(table) = &args.output.table {
        table::write(table, &jobs, &log_path)?;
    }
    let (done, skipped) = (left.len() - failed, skipped.len());
    let seconds = begin.elapsed().as_secs_f64();
    let summary = format!("{done} done, {failed} failed, {skipped} skipped in {seconds:.1} s");
    let log = shown(&log_path);
    if failed > 0 {
        anyhow::bail!("{summary}; {log} says why, and --resume tries only those again");
    }
    if !args.output.quiet {
        tell(&format!("{summary}; see {log}\n"));
    }
    Ok(())
}

/// Makes a folder with those that it is in.
pub(super) fn make_folder(folder: &Path) -> rtfmesh::Result<()> {
    std::fs::create_dir_all(folder).map_err(|error| {
        let problem = format!("the folder cannot be created ({error})");
        Error::output(folder, problem, "choose another folder for --out").caused_by(error)
    })
}

/// No file may be both read and written, or written twice.
fn refuse_overwriting(args: &Args, jobs: &[Job], log: &Path) -> rtfmesh::Result<()> {
    let inputs = || jobs.iter().map(|job| &job.input);
    let outputs = || jobs.iter().map(|job| &job.output);
    if among(log, inputs().chain(outputs())) {
        let problem = format!("the log {} would overwrite a mesh", shown(log));
        return Err(Error::usage(problem, "choose another file for --log"));
    }
    let cells = jobs.iter().filter_map(|job| args.output.cells_of(&job.output));
    if let Some(cells) = cells.into_iter().find(|cells| among(cells, inputs().chain(outputs()))) {
        let problem = format!("the cells {} would overwrite a mesh", shown(&cells));
        return Err(Error::usage(problem, "rename that mesh, or choose another format for --cells"));
    }
    let table = args.output.table.as_deref();
    if let Some(table) = table {
        if table.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("csv")) {
            let problem = format!("--table {} does not end in .csv", shown(table));
            return Err(Error::usage(problem, "choose a .csv file"));
        }
        if among(table, inputs().chain(outputs())) || full_path(table) == full_path(log) {
            let problem = format!("the table {} would overwrite a mesh or the log", shown(table));
            return Err(Error::usage(problem, "choose another file for --table"));
        }
    }
    let read = [
        ("--features", "feature lines", args.method.features()),
        ("--points", "points", args.method.points()),
    ];
    for (option, what, path) in read {
        let Some(path) = path else { continue };
        let same = |other| same_file(path, other);
        if among(path, outputs()) || same(log) || table.is_some_and(same) {
            let problem = format!("the {what} in {} would be overwritten", shown(path));
            let remedy = format!("choose different files for {option}, --log, --table and --out");
            return Err(Error::usage(problem, remedy));
        }
    }
    Ok(())
}

/// Whether the path leads to one of the meshes.
fn among<'a>(path: &Path, mut meshes: impl Iterator<Item = &'a PathBuf>) -> bool {
    let full = full_path(path);
    meshes.any(|mesh| full == full_path(mesh))
}
