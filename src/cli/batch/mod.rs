//! `rtfmesh batch`.

mod inputs;
mod log;

use super::all_at_once::ResearchArgs;
use super::attributes::{AttributeArgs, carried};
use super::files::{InputFormat, Target};
use super::heading::OUTPUT;
use super::method::{DeviceArgs, MethodArgs, refuse_messages};
use super::remesh::{full_path, same_file};
use super::target_count::{SizeArgs, count};
use super::terminal::tell;
use super::{progress, words};
use anyhow::Result;
use clap::ArgAction;
use inputs::{Job, Shard};
use log::{Entry, Log, Status};
use rtfmesh::io;
use rtfmesh::io::{Encoding, Format, Loaded};
use rtfmesh::report::Settings;
use rtfmesh::{Device, Error, Flow, MeasureDepth, Options, Size, remesh_repaired};
use std::path::{Path, PathBuf};
use std::sync::MutexGuard;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Instant;

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
/// The next mesh is read while one is worked on, and one that fails does not stop the others. The log has a
/// JSON line for each: input, output, status (done, failed, skipped), vertices, q_avg, theta_min, rms and
/// hausdorff with --distances, options and a digest of them (asked), warnings, notes, seconds, error. The
/// exit code is 1 if any failed. After Ctrl-C finished meshes remain, and --resume continues.
#[derive(clap::Args)]
#[command(after_help = SHORT_EXAMPLES, after_long_help = EXAMPLES, disable_help_flag = true)]
pub struct Args {
    /// Mesh files, folders of them, or @LIST with a path on each line
    ///
    /// Folders in folders are searched, too; results keep their structure.
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    attributes: AttributeArgs,
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
    /// Format: obj, ply, stl, off, glb or mesh, each also with .gz
    #[arg(long, value_name = "FORMAT", default_value_t = Encoding { format: Format::Ply, gzip: false })]
    format: Encoding,
    /// Log to append to [default: DIR/batch.jsonl]
    #[arg(long, value_name = "FILE.jsonl", hide_short_help = true)]
    log: Option<PathBuf>,
    /// Skip inputs that the log has as done with the same options
    ///
    /// Their results must exist. The device does not count.
    #[arg(long)]
    resume: bool,
    /// Take every n-th of the sorted inputs, beginning with the i-th
    ///
    /// For n jobs side by side, each with a log of its own or all with one.
    #[arg(long, value_name = "i/n", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// The same as --shard, counted from 0: this process among --world-size
    #[arg(long, value_name = "R", requires = "world_size", conflicts_with = "shard", hide_short_help = true)]
    rank: Option<usize>,
    /// How many processes share the inputs
    #[arg(long, value_name = "W", requires = "rank", hide_short_help = true)]
    world_size: Option<usize>,
    /// Measure the distances between each result and its input
    #[arg(long, hide_short_help = true)]
    distances: bool,
    /// How closely to bound the Hausdorff distances: gap between the ends, relative to the upper end
    /// [default: 0.01]
    ///
    /// 1e-6 to 0.5. Gaps below 5e-7 of the diagonal are small enough in any case.
    #[arg(long, value_name = "SHARE", requires = "distances", hide_short_help = true)]
    accuracy: Option<f64>,
    /// Print no line for each mesh; the log has them
    #[arg(long, short)]
    quiet: bool,
    /// Print this help; --help has all options
    #[arg(long, short, action = ArgAction::Help)]
    help: Option<bool>,
}

impl OutputArgs {
    /// The part of the inputs that was asked for in either way.
    fn shard(&self) -> rtfmesh::Result<Option<Shard>> {
        match (self.rank, self.world_size) {
            (Some(rank), Some(size)) => Shard::of_rank(rank, size).map(Some),
            _ => Ok(self.shard),
        }
    }
}

/// What all meshes of a batch share.
struct Batch<'a> {
    args: &'a Args,
    size: Size,
    options: Options,
    asked: &'a str,
}

/// A digest of all that is asked for but the device, 16 hexadecimal digits: FNV-1a of 64 bits (Fowler, Noll
/// and Vo), which is the same on every machine and with every compiler.
fn digest(args: &Args, size: Size, options: &Options) -> rtfmesh::Result<String> {
    let options = serde_json::to_string(options).map_err(|error| Error::Internal(error.to_string()))?;
    let (attributes, from, to) = (&args.attributes, &args.input_format, args.output.format);
    let asked = format!("{size:?} {attributes:?} {from:?} {to:?} {options}");
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
    options.validate()?;
    args.attributes.check(options.method)?;
    io::target_encoding(Path::new(&format!("result.{}", args.output.format)))?;
    let jobs = inputs::jobs(&args.inputs, &args.output.out, args.output.format)?;
    let log_path = args.output.log.clone().unwrap_or_else(|| args.output.out.join("batch.jsonl"));
    refuse_overwriting(args, &jobs, &log_path)?;
    options.coarse_to_fine.features = args.method.read_features()?;
    let jobs = match args.output.shard()? {
        Some(shard) => shard.of(jobs),
        None => jobs,
    };
    make_folder(&args.output.out)?;
    let mut log = Log::open(&log_path)?;
    let asked = &digest(args, size, &options)?;
    let (skipped, left): (Vec<Job>, Vec<Job>) =
        jobs.into_iter().partition(|job| args.output.resume && log.has(job, asked));
    for job in &skipped {
        log.add(&Entry::new(job, Status::Skipped, asked))?;
    }
    let failed = Batch { args, size, options, asked }.run(&left, &mut log)?;
    let (done, skipped) = (left.len() - failed, skipped.len());
    let seconds = begin.elapsed().as_secs_f64();
    let summary = format!("{done} done, {failed} failed, {skipped} skipped in {seconds:.1} s");
    let log = log_path.display();
    if failed > 0 {
        anyhow::bail!("{summary}; {log} says why, and --resume tries only those again");
    }
    if !args.output.quiet {
        tell(&format!("{summary}; see {log}\n"));
    }
    Ok(())
}

/// Makes a folder with those that it is in.
fn make_folder(folder: &Path) -> rtfmesh::Result<()> {
    std::fs::create_dir_all(folder).map_err(|error| {
        let problem = format!("the folder cannot be created ({error})");
        Error::output(folder, problem, "name another one after --out").caused_by(error)
    })
}

/// No file may be both read and written, or written twice.
fn refuse_overwriting(args: &Args, jobs: &[Job], log: &Path) -> rtfmesh::Result<()> {
    let inputs = || jobs.iter().map(|job| &job.input);
    let outputs = || jobs.iter().map(|job| &job.output);
    if among(log, inputs().chain(outputs())) {
        let problem = format!("the log {} would be written into a mesh", log.display());
        return Err(Error::usage(problem, "name another file after --log"));
    }
    let Some(features) = args.method.features() else { return Ok(()) };
    if among(features, outputs()) || same_file(features, log) {
        let problem = format!("the lines in {} would be overwritten", features.display());
        return Err(Error::usage(problem, "name other files after --features, --log or --out"));
    }
    Ok(())
}

/// Whether the path leads to one of the meshes.
fn among<'a>(path: &Path, mut meshes: impl Iterator<Item = &'a PathBuf>) -> bool {
    let full = full_path(path);
    meshes.any(|mesh| full == full_path(mesh))
}

/// A mesh as it was read, and how many seconds that took.
type Read = (rtfmesh::Result<Loaded>, f64);

/// While this exists, the program does not stop.
type Writing = MutexGuard<'static, ()>;

impl Batch<'_> {
    /// Works on the jobs in their order; returns how many failed.
    fn run(&self, jobs: &[Job], log: &mut Log) -> Result<usize> {
        if jobs.is_empty() {
            return Ok(0);
        }
        progress::handle_interrupts()?;
        let mut device = self.args.device.open(false)?;
        // A channel without room: one mesh is worked on, and one more waits.
        let (sender, receiver) = sync_channel(0);
        std::thread::scope(|scope| {
            // Inside, so that the reader ends with this function, however it ends.
            let receiver = receiver;
            scope.spawn(move || self.read_all(jobs, &sender));
            let mut failed = 0;
            for (place, (job, read)) in jobs.iter().zip(receiver.iter()).enumerate() {
                let (done, left) = (place - failed, jobs.len() - place);
                progress::set_cancel_message(format!(
                    "stopped: {done} done, {failed} failed, {left} left; --resume goes on"
                ));
                let mut entry = Entry::new(job, Status::Done, self.asked);
                // Holds the guard, so that no stop comes between a result and its line.
                let outcome = self.one(&device, job, read, &mut entry);
                if let Err(error) = &outcome {
                    if progress::is_cancelled() {
                        return Err(progress::cancelled().into());
                    }
                    failed += 1;
                    entry.status = Status::Failed;
                    entry.error = Some(words::line(error));
                }
                log.add(&entry)?;
                if !self.args.output.quiet {
                    tell(&line(&entry, place + 1, jobs.len()));
                }
                // A lost device stays lost; the other meshes get a new one.
                let error = outcome.err().and_then(|error| error.downcast().ok());
                if let Some(Error::DeviceLost(_)) = error {
                    device = self.args.device.open(false)?;
                }
            }
            Ok(failed)
        })
    }

    fn read_all(&self, jobs: &[Job], sender: &SyncSender<Read>) {
        for job in jobs {
            let begin = Instant::now();
            let loaded = self.args.input_format.load_with(&job.input, self.args.attributes.wants_materials());
            // Nobody receives when the batch has ended early.
            if sender.send((loaded, begin.elapsed().as_secs_f64())).is_err() {
                return;
            }
        }
    }

    /// Remeshes and writes, and fills in `entry`. While the caller holds the guard, Ctrl-C waits.
    fn one(&self, device: &Device, job: &Job, read: Read, entry: &mut Entry) -> Result<Writing> {
        let begin = Instant::now();
        let (loaded, reading) = read;
        let outcome = loaded.map_err(Into::into).and_then(|loaded| {
            entry.notes.clone_from(&loaded.notes);
            make_folder(job.output.parent().unwrap_or(&job.output))?;
            let target = Target::new(&job.output, Some(self.args.output.format))?;
            let mut options = self.options.clone();
            let in_file = |error: Error| error.in_file(&job.input);
            let repaired = count(self.size, &loaded.mesh, &mut options, None).map_err(in_file)?;
            options.format = Some(target.format());
            let attributes = &self.args.attributes;
            let repaired = attributes.request(&loaded, repaired, &mut options, &mut entry.notes);
            let repaired = repaired.map_err(in_file)?;
            let read = self.args.method.read_attributes(&loaded.attributes, &mut options);
            read.map_err(in_file)?;
            entry.options = Some(Settings::of(&options));
            let flow = |_| if progress::is_cancelled() { Flow::Cancel } else { Flow::Continue };
            let result = remesh_repaired(device, &loaded.mesh, repaired, &options, flow);
            let result = result.map_err(in_file)?;
            refuse_messages(device)?;
            let attributes = carried(&loaded.mesh, &loaded.attributes, &result);
            let writing = progress::begin_writing()?;
            target.write(&result.mesh, &attributes, true)?;
            entry.notes.extend(target.notes(&result.mesh, &attributes));
            entry.tell_of(result);
            words::warnings(&mut entry.warnings);
            entry.warnings.extend(self.args.attributes.texture_warning(&loaded, target.format()));
            Ok(writing)
        });
        entry.seconds = reading + begin.elapsed().as_secs_f64();
        outcome
    }
}

/// The line about a mesh for people.
fn line(entry: &Entry, place: usize, of: usize) -> String {
    let (seconds, input) = (entry.seconds, &entry.input);
    let mut line = match (&entry.error, entry.vertices) {
        // Some errors begin with the file's name, others have none.
        (Some(error), _) => {
            let error = error.strip_prefix(&format!("{input}: ")).unwrap_or(error);
            format!("{place}/{of} {input} failed: {error}")
        }
        (None, vertices) => format!(
            "{place}/{of} {} -> {}: {} vertices, Q {:.4}, smallest angle {:.2}°, {seconds:.2} s",
            entry.input,
            entry.output,
            vertices.unwrap_or_default(),
            entry.q_avg.unwrap_or_default(),
            entry.theta_min.unwrap_or_default(),
        ),
    };
    for warning in &entry.warnings {
        line += &format!("; warning: {warning}");
    }
    line + "\n"
}
