//! The log of a batch: a JSON line for each mesh, added as it ends.

use super::inputs::Job;
use rtfmesh::report::Settings;
use rtfmesh::{Error, Remeshed, WarningCode};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// How a mesh ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The result is written.
    Done,
    /// Nothing is written; the entry says why.
    Failed,
    /// It was done before.
    Skipped,
}

/// What a file is known again by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    bytes: u64,
    /// Nanoseconds from 1970 to the last change.
    modified: u128,
}

impl Stamp {
    /// Of a regular file; `None` for anything else.
    pub fn of(path: &Path) -> Option<Self> {
        let known = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
        let modified = known.modified().ok()?.duration_since(UNIX_EPOCH).ok()?.as_nanos();
        Some(Self { bytes: known.len(), modified })
    }
}

/// A line; `null` stands for what was not measured, or does not exist.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// The mesh that was read, as it was named.
    pub input: String,
    /// The mesh that was written.
    pub output: String,
    /// How it ended.
    pub status: Status,
    /// The input as it was read, and the result as it was written.
    pub input_stamp: Option<Stamp>,
    pub output_stamp: Option<Stamp>,
    /// Vertices of the result.
    pub vertices: Option<usize>,
    /// Mean quality of its triangles, 0..=1.
    pub mean_quality: Option<f64>,
    /// Its smallest angle in degrees.
    pub min_angle: Option<f64>,
    /// Distance to the input, both ways, in percent of the input's diagonal: the root mean square of samples.
    pub rms: Option<f64>,
    /// Hausdorff distance between result and input, in the same unit: the upper end of its interval.
    pub hausdorff: Option<f64>,
    /// How it was made, as in the report of a single mesh.
    pub options: Option<Settings>,
    /// A digest of all that was asked for: with another one a mesh is done again.
    pub asked: String,
    /// What could not be done.
    pub warnings: Vec<String>,
    /// A code for each of these.
    pub warning_codes: Vec<WarningCode>,
    /// What reading left out, what was repaired, and what writing dropped.
    pub notes: Vec<String>,
    /// Reading, remeshing and writing.
    pub seconds: f64,
    /// Why it failed.
    pub error: Option<String>,
}

impl Entry {
    /// An entry without a result.
    pub fn new(job: &Job, status: Status, asked: &str) -> Self {
        Self {
            input: job.input.display().to_string(),
            output: job.output.display().to_string(),
            status,
            input_stamp: None,
            output_stamp: None,
            vertices: None,
            mean_quality: None,
            min_angle: None,
            rms: None,
            hausdorff: None,
            options: None,
            asked: asked.to_owned(),
            warnings: Vec::new(),
            warning_codes: Vec::new(),
            notes: Vec::new(),
            seconds: 0.0,
            error: None,
        }
    }

    /// Takes over the figures of a result.
    pub fn tell_of(&mut self, result: Remeshed) {
        let measures = result.summary.output;
        self.vertices = Some(measures.vertices);
        self.mean_quality = Some(measures.quality.mean_quality);
        self.min_angle = Some(measures.quality.min_angle);
        self.rms = measures.distances.as_ref().map(|distances| distances.rms);
        self.hausdorff = measures.distances.as_ref().map(|distances| distances.hausdorff);
        self.notes.extend(result.summary.remarks);
        self.warnings = result.summary.warnings;
        self.warning_codes = result.summary.warning_codes;
    }
}

/// What is read of earlier lines.
#[derive(Deserialize)]
struct Earlier {
    input: String,
    output: String,
    status: Status,
    asked: Option<String>,
    input_stamp: Option<Stamp>,
    output_stamp: Option<Stamp>,
}

/// What was asked for, and the input and the result at that time.
type Known = (Option<String>, [Option<Stamp>; 2]);

/// A log to add to.
pub struct Log {
    path: PathBuf,
    file: File,
    /// What is known of each input and output that was done last time.
    done: HashMap<(String, String), Known>,
}

impl Log {
    /// Opens the log, or begins one, and reads its entries. Lines that are not entries, such as the last one
    /// of a batch that was killed, are ignored.
    ///
    /// # Errors
    /// [`Error::Output`] if it cannot be read or written.
    pub fn open(path: &Path) -> rtfmesh::Result<Self> {
        if path == Path::new("-") {
            let error = std::io::Error::other("- is standard output, but the log must be readable");
            return Err(unusable(path, error));
        }
        // A device might never end, and a pipe never begin.
        if std::fs::metadata(path).is_ok_and(|known| !known.is_file()) {
            return Err(unusable(path, std::io::Error::other("this is not a regular file")));
        }
        let opened = OpenOptions::new().read(true).append(true).create(true).open(path);
        let mut file = opened.map_err(|error| unusable(path, error))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(|error| unusable(path, error))?;
        if bytes.last().is_some_and(|last| *last != b'\n') {
            file.write_all(b"\n").map_err(|error| unusable(path, error))?;
        }
        let mut done = HashMap::new();
        for line in String::from_utf8_lossy(&bytes).lines() {
            let Ok(earlier) = serde_json::from_str::<Earlier>(line) else { continue };
            let key = (earlier.input, earlier.output);
            match earlier.status {
                Status::Done => {
                    done.insert(key, (earlier.asked, [earlier.input_stamp, earlier.output_stamp]));
                }
                Status::Failed => {
                    done.remove(&key);
                }
                Status::Skipped => {}
            }
        }
        Ok(Self { path: path.to_owned(), file, done })
    }

    /// Whether this was done as it is `asked` for now, and neither its input nor its result has changed.
    pub fn has(&self, job: &Job, asked: &str) -> bool {
        let key = (job.input.display().to_string(), job.output.display().to_string());
        let stamps = [Stamp::of(&job.input), Stamp::of(&job.output)];
        self.done.get(&key).is_some_and(|(before, known)| {
            before.as_deref() == Some(asked) && stamps.iter().all(Option::is_some) && *known == stamps
        })
    }

    /// Adds a line, in one piece, so that several programs may share a log.
    ///
    /// # Errors
    /// [`Error::Output`] if it cannot be written.
    pub fn add(&mut self, entry: &Entry) -> rtfmesh::Result<()> {
        let mut line = serde_json::to_string(entry).map_err(|error| Error::Internal(error.to_string()))?;
        line.push('\n');
        self.file.write_all(line.as_bytes()).map_err(|error| unusable(&self.path, error))
    }
}

/// The error for a log that fails.
pub fn unusable(path: &Path, error: std::io::Error) -> Error {
    let problem = format!("the log cannot be read or written ({error})");
    Error::output(path, problem, "choose another file for --log").caused_by(error)
}
