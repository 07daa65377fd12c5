//! `rtfmesh batch`.

mod inputs;
mod log;

use super::attributes::{AttributeArgs, carried};
use super::files::{InputFormat, Target};
use super::method::{DeviceArgs, MethodArgs, refuse_messages};
use super::remesh::{full_path, same_file};
use super::target_count::{SizeArgs, count};
use super::{progress, tell, words};
use anyhow::Result;
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
  rtfmesh batch scans --out remeshed -n 10000
  rtfmesh batch a.stl b.obj parts --out remeshed --edge-length 1% --format obj
  rtfmesh batch @all.txt --out remeshed --ratio 0.1 --best-effort --resume
  rtfmesh batch scans --out remeshed -n 10000 --shard 3/16 --log logs/3.jsonl";

/// Remesh many files with the same options, on one device: the next one is read while this one is worked on.
///
/// A mesh that fails does not stop the others. The log has a JSON line for each: input, output, status (done, failed,
/// skipped), vertices, q_avg, theta_min, rms and hausdorff with --distances, options, warnings, notes, seconds, error. The
/// exit code is 1 if any failed. Ctrl-C leaves what is done whole, and --resume goes on from there.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Mesh files, folders (the mesh files in them, by their extensions), or @LIST with such a path on each line
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Folder for the results, made if missing; each is named as its input
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    input_format: InputFormat,
    /// Format to write: obj, ply, stl, off, glb or mesh, each also with .gz
    #[arg(long, value_name = "FORMAT", default_value_t = Encoding { format: Format::Ply, gzip: false })]
    format: Encoding,
    /// Log to add to [default: DIR/batch.jsonl]
    #[arg(long, value_name = "FILE.jsonl")]
    log: Option<PathBuf>,
    /// Leave out inputs that the log has as done and whose results are there, whatever the options were
    #[arg(long)]
    resume: bool,
    /// Of the sorted inputs take every n-th, beginning with the i-th: for n jobs side by side
    #[arg(long, value_name = "i/n", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Measure the distances between each result and its input
    #[arg(long)]
    distances: bool,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    attributes: AttributeArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// No line for each mesh; the log has them
    #[arg(long, short)]
    quiet: bool,
}

/// What all meshes of a batch have in common.
struct Batch<'a> {
    args: &'a Args,
    size: Size,
    options: Options,
}

/// Reads, remeshes and writes one mesh after another.
pub fn run(args: &Args) -> Result<()> {
    let begin = Instant::now();
    let size = args.size.size()?;
    let measures = if args.distances { MeasureDepth::Full } else { MeasureDepth::Basic };
    let mut options = args.method.options(size, measures)?;
    args.attributes.check(options.method)?;
    io::target_encoding(Path::new(&format!("result.{}", args.format)))?;
    let jobs = inputs::jobs(&args.inputs, &args.out, args.format)?;
    let log_path = args.log.clone().unwrap_or_else(|| args.out.join("batch.jsonl"));
    refuse_overwriting(args, &jobs, &log_path)?;
    options.coarse_to_fine.features = args.method.read_features()?;
    let jobs = match args.shard {
        Some(shard) => shard.of(jobs),
        None => jobs,
    };
    std::fs::create_dir_all(&args.out).map_err(|error| {
        let problem = format!("the folder cannot be made ({error})");
        Error::output(&args.out, problem, "name another one after --out").caused_by(error)
    })?;
    let mut log = Log::open(&log_path)?;
    let (skipped, left): (Vec<Job>, Vec<Job>) = jobs.into_iter().partition(|job| args.resume && log.has(job));
    for job in &skipped {
        log.add(&Entry::new(job, Status::Skipped))?;
    }
    let failed = Batch { args, size, options }.run(&left, &mut log)?;
    let (done, skipped) = (left.len() - failed, skipped.len());
    let seconds = begin.elapsed().as_secs_f64();
    let summary = format!("{done} done, {failed} failed, {skipped} skipped in {seconds:.1} s");
    let log = log_path.display();
    if failed > 0 {
        anyhow::bail!("{summary}; {log} says why, and --resume tries only those again");
    }
    if !args.quiet {
        tell(&format!("{summary}; see {log}\n"));
    }
    Ok(())
}

/// Files that are read, or written for another reason, must not be written.
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

/// While this is there, the program does not stop.
type Writing = MutexGuard<'static, ()>;

impl Batch<'_> {
    /// Works on the jobs in their order; gives how many failed.
    fn run(&self, jobs: &[Job], log: &mut Log) -> Result<usize> {
        if jobs.is_empty() {
            return Ok(0);
        }
        progress::heed()?;
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
                progress::set_story(format!(
                    "stopped: {done} done, {failed} failed, {left} left; --resume goes on"
                ));
                let mut entry = Entry::new(job, Status::Done);
                // Nobody stops between a result and its line.
                let outcome = self.one(&device, job, read, &mut entry);
                if let Err(error) = &outcome {
                    if progress::is_cancelled() {
                        return Err(progress::stopped().into());
                    }
                    failed += 1;
                    entry.status = Status::Failed;
                    entry.error = Some(words::line(error));
                }
                log.add(&entry)?;
                if !self.args.quiet {
                    tell(&line(&entry, place + 1, jobs.len()));
                }
                // What is lost stays lost; the others get a new one.
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

    /// Remeshes and writes; `entry` learns what there is to tell of it. Whoever asks to stop waits for the guard.
    fn one(&self, device: &Device, job: &Job, read: Read, entry: &mut Entry) -> Result<Writing> {
        let begin = Instant::now();
        let (loaded, reading) = read;
        let outcome = loaded.map_err(Into::into).and_then(|loaded| {
            entry.notes.clone_from(&loaded.notes);
            let target = Target::new(&job.output, Some(self.args.format))?;
            let mut options = self.options.clone();
            let repaired = count(self.size, &job.input, &loaded.mesh, &mut options, true)?;
            entry.notes.extend(self.args.attributes.ask(&loaded, Some(target.format()), &mut options));
            let read = self.args.method.read_attributes(&loaded.attributes, &mut options);
            read.map_err(|error| error.in_file(&job.input))?;
            entry.options = Some(Settings::of(&options));
            let mut progress = |_| match progress::is_cancelled() {
                true => Flow::Cancel,
                false => Flow::Continue,
            };
            let result = remesh_repaired(device, &loaded.mesh, repaired, &options, &mut progress);
            let result = result.map_err(|error| error.in_file(&job.input))?;
            refuse_messages(device)?;
            let attributes = carried(&loaded.mesh, &loaded.attributes, &result);
            let writing = progress::begin_writing()?;
            target.write(&result.mesh, &attributes, true)?;
            entry.notes.extend(target.notes(&result.mesh, &attributes));
            entry.tell_of(result);
            Ok(writing)
        });
        entry.seconds = reading + begin.elapsed().as_secs_f64();
        outcome
    }
}

/// What people see of a mesh.
fn line(entry: &Entry, place: usize, of: usize) -> String {
    let seconds = entry.seconds;
    let mut line = match (&entry.error, entry.vertices) {
        (Some(error), _) => format!("{place}/{of} failed: {error}"),
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
