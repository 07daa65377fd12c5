//! Meshes of a batch: read one ahead, remeshed by one worker or several, logged as they end.

use super::inputs::Job;
use super::log::{Entry, Log, Stamp, Status};
use super::{Args, make_folder};
use crate::cli::files::Target;
use crate::cli::job::{Finished, Notes, RemeshJob, Request};
use crate::cli::progress::RunProgress;
use crate::cli::terminal::tell;
use crate::cli::{progress, words};
use crate::error::escaped;
use anyhow::Result;
use rtfmesh::io;
use rtfmesh::io::{Format, Loaded};
use rtfmesh::report::Settings;
use rtfmesh::{CellColours, CorrespondenceRequest, Device, Error, Options, Remeshed, Size};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::ScopedJoinHandle;
use std::time::Instant;

/// What all meshes of a batch share.
pub struct Batch<'a> {
    pub args: &'a Args,
    pub size: Size,
    pub options: Options,
    /// The digest of all this.
    pub asked: &'a str,
}

/// A mesh as it was read, how many seconds that took, and its file as it was before.
type Read = (rtfmesh::Result<Loaded>, f64, Option<Stamp>);

/// Meshes that are read and wait for a worker; `None` where the batch ends early.
type Queue<'j> = Mutex<Option<Receiver<(&'j Job, Read)>>>;

/// While this exists, the program does not stop.
type Writing = MutexGuard<'static, ()>;

/// Meshes that have ended.
struct Ended<'a> {
    log: &'a mut Log,
    done: usize,
    failed: usize,
    /// Meshes in all.
    of: usize,
}

impl Ended<'_> {
    fn add(&mut self, entry: &Entry, quiet: bool) -> rtfmesh::Result<()> {
        match entry.status {
            Status::Failed => self.failed += 1,
            _ => self.done += 1,
        }
        self.log.add(entry)?;
        self.set_cancel_message();
        if !quiet {
            tell(&line(entry, self.done + self.failed, self.of));
        }
        Ok(())
    }

    fn set_cancel_message(&self) {
        let Self { done, failed, of, .. } = self;
        let left = of - done - failed;
        progress::set_cancel_message(format!(
            "stopped: {done} done, {failed} failed, {left} left; --resume continues"
        ));
    }
}

/// Closes the queue when a worker ends. Where it cannot go on, however that comes, nothing more is read and
/// the others end, too; where there is nothing left, it makes no difference.
struct ClosedAtEnd<'a, 'j>(&'a Queue<'j>);

impl Drop for ClosedAtEnd<'_, '_> {
    fn drop(&mut self) {
        drop(lock(self.0).take());
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Batch<'_> {
    /// Works on the jobs, begun in their order, with this many workers; returns how many failed.
    pub fn run(&self, jobs: &[Job], workers: usize, log: &mut Log) -> Result<usize> {
        if jobs.is_empty() {
            return Ok(0);
        }
        let ended = Ended { log, done: 0, failed: 0, of: jobs.len() };
        ended.set_cancel_message();
        let ended = Mutex::new(ended);
        // A channel without room: one more mesh waits than are worked on.
        let (sender, receiver) = sync_channel(0);
        let queue = Mutex::new(Some(receiver));
        let outcomes: Vec<Result<()>> = std::thread::scope(|scope| {
            scope.spawn(move || self.read_all(jobs, &sender));
            let (queue, ended) = (&queue, &ended);
            let work = move || {
                let _closed = ClosedAtEnd(queue);
                self.work(queue, ended)
            };
            let workers: Vec<_> = (0..workers.min(jobs.len())).map(|_| scope.spawn(work)).collect();
            let join = |worker: ScopedJoinHandle<Result<()>>| {
                worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            workers.into_iter().map(join).collect()
        });
        outcomes.into_iter().collect::<Result<()>>()?;
        let ended = ended.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(ended.failed)
    }

    fn read_all<'j>(&self, jobs: &'j [Job], sender: &SyncSender<(&'j Job, Read)>) {
        for job in jobs {
            let (begin, stamp) = (Instant::now(), Stamp::of(&job.input));
            let format = &self.args.input_format;
            let input = format.load_any(&job.input, self.args.attributes.wants_materials());
            let loaded = input.and_then(|input| input.mesh_or_points().map_err(|e| e.in_file(&job.input)));
            // Nobody receives when the batch has ended early.
            if sender.send((job, (loaded, begin.elapsed().as_secs_f64(), stamp))).is_err() {
                return;
            }
        }
    }

    /// Works on jobs until there are none left, or the batch has ended.
    fn work(&self, queue: &Queue, ended: &Mutex<Ended>) -> Result<()> {
        let mut device = self.args.device.open(false)?;
        loop {
            let next = lock(queue).as_ref().and_then(|receiver| receiver.recv().ok());
            let Some((job, read)) = next else { return Ok(()) };
            let mut entry = Entry::new(job, Status::Done, self.asked);
            // Holds the guard, so that no stop comes between a result and its line.
            let outcome = self.one(&device, job, read, &mut entry);
            if let Err(error) = &outcome {
                if progress::is_cancelled() {
                    return Err(progress::cancelled().into());
                }
                entry.status = Status::Failed;
                entry.error = Some(words::line(error));
            }
            lock(ended).add(&entry, self.args.output.quiet)?;
            // A lost device stays lost; the other meshes get a new one.
            let error = outcome.err().and_then(|error| error.downcast().ok());
            if let Some(Error::DeviceLost(_)) = error {
                device = self.args.device.open(false)?;
            }
        }
    }

    fn request<'b>(&'b self, job: &'b Job, format: Format) -> Request<'b> {
        Request {
            method: &self.args.method,
            attributes: &self.args.attributes,
            size: self.size,
            options: self.options.clone().format(format),
            sizing: None,
            correspondence: CorrespondenceRequest::NONE,
            file: Some(&job.input),
        }
    }

    /// The file of a result's cells, if they are wanted.
    fn cells(&self, job: &Job, result: &Remeshed) -> rtfmesh::Result<Option<(PathBuf, Vec<u8>)>> {
        let wanted = self.args.output.cells_of(&job.output).zip(result.cells.as_ref());
        let Some((path, cells)) = wanted else { return Ok(None) };
        let colours = cells.colours(CellColours::Area, &result.mesh);
        let bytes = io::encode_cells(&path, cells, &colours)?;
        Ok(Some((path, bytes)))
    }

    /// Remeshes and writes, and fills in `entry`. While the caller holds the guard, Ctrl-C waits.
    fn one(&self, device: &Device, job: &Job, read: Read, entry: &mut Entry) -> Result<Writing> {
        let begin = Instant::now();
        let (loaded, reading, stamp) = read;
        entry.input_stamp = stamp;
        let outcome = loaded.map_err(Into::into).and_then(|mut loaded| {
            make_folder(job.output.parent().unwrap_or(&job.output))?;
            let target = Target::new(&job.output, Some(self.args.output.format))?;
            let mut notes = Notes::new(std::mem::take(&mut loaded.notes), None);
            let mut run = RunProgress::unlimited();
            let request = self.request(job, target.format());
            let prepared = RemeshJob::new(request, self.args.holes.source(loaded), &mut notes, &mut run);
            entry.notes = notes.list;
            let mut prepared = prepared?;
            entry.options = Some(Settings::of(&prepared.options));
            let Finished { result, attributes, .. } = prepared.remesh(device, &mut run)?;
            let (path, bytes) = self.cells(job, &result)?.unzip();
            let others: Vec<(&Path, Vec<u8>)> = path.as_deref().zip(bytes).into_iter().collect();
            let writing = progress::begin_writing()?;
            target.write_all(&result.mesh, &attributes, &others, true)?;
            entry.output_stamp = Stamp::of(&job.output);
            entry.notes.extend(target.notes(&result.mesh, &attributes));
            entry.tell_of(result);
            words::warnings(&mut entry.warnings);
            Ok(writing)
        });
        entry.seconds = reading + begin.elapsed().as_secs_f64();
        outcome
    }
}

/// The line about a mesh for people.
fn line(entry: &Entry, place: usize, of: usize) -> String {
    let (seconds, input, output) = (entry.seconds, escaped(&entry.input), escaped(&entry.output));
    let mut line = match (&entry.error, entry.vertices) {
        // Some errors begin with the file's name, others have none.
        (Some(error), _) => {
            let error = error.strip_prefix(&format!("{input}: ")).unwrap_or(error);
            format!("{place}/{of} {input} failed: {error}")
        }
        (None, vertices) => format!(
            "{place}/{of} {} -> {}: {} vertices, quality {:.4}, smallest angle {:.2}°, {seconds:.2} s",
            input,
            output,
            vertices.unwrap_or_default(),
            entry.mean_quality.unwrap_or_default(),
            entry.min_angle.unwrap_or_default(),
        ),
    };
    for warning in &entry.warnings {
        line += &format!("; warning: {}", escaped(warning));
    }
    line + "\n"
}
