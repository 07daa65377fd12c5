//! Programs that read a mesh file and write another: rtfmesh and those of bench/peers.

use crate::process;
use crate::search::Search;
use anyhow::{Context as _, Result, bail};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The runner, relative to the package's root, where cargo starts benches.
const FOLDER: &str = "bench/peers";

/// What `run_peer.py --list` says about a method.
#[derive(Debug, Deserialize)]
pub struct Fact {
    /// Why it cannot run.
    pub missing: Option<String>,
    takes_edge: bool,
}

/// A program to compare.
#[derive(Clone)]
pub struct Contestant {
    /// Name in tables.
    pub name: String,
    kind: Kind,
}

#[derive(Clone)]
enum Kind {
    /// rtfmesh with these arguments.
    Ours { arguments: Vec<String>, device: Option<String> },
    /// A method of the runner, and whether it takes an edge length.
    Peer { python: PathBuf, takes_edge: bool },
}

/// The task that all programs get.
pub struct Task {
    /// Input, binary PLY.
    pub input: PathBuf,
    /// Folder for results and logs.
    pub folder: PathBuf,
    /// Vertices.
    pub vertices: usize,
    /// Degrees from which an edge is a feature that programs are to keep, if they can.
    pub features: Option<f64>,
}

/// One run.
pub struct Round {
    /// Seconds inside the call.
    pub call: f64,
    /// Seconds of the whole process.
    pub process: f64,
}

/// What the runner prints.
#[derive(Deserialize)]
struct Said {
    seconds: f64,
    vertices: usize,
    edge: Option<f64>,
}

/// The virtual environment's Python, else that on PATH.
pub fn python() -> PathBuf {
    let own = Path::new(FOLDER).join(".venv/bin/python");
    if own.exists() { own } else { PathBuf::from("python3") }
}

/// What the runner says about every method.
///
/// # Errors
/// If there is no Python, or it fails.
pub fn facts(python: &Path, folder: &Path) -> Result<BTreeMap<String, Fact>> {
    let ended = process::run(Command::new(python).arg(runner()).arg("--list"), folder)?;
    serde_json::from_str(&ended.output).context("what run_peer.py --list printed")
}

/// The time in seconds that rtfmesh reports, without reading, writing and opening the device.
fn wall_time(messages: &str) -> Result<f64> {
    let row = messages.lines().find_map(|line| line.trim().strip_prefix("wall time"));
    let seconds = row.and_then(|row| row.trim().strip_suffix(" s"));
    seconds.and_then(|seconds| seconds.parse().ok()).context("the program did not print its wall time")
}

fn runner() -> PathBuf {
    Path::new(FOLDER).join("run_peer.py")
}

impl Contestant {
    /// rtfmesh.
    pub fn ours(name: &str, arguments: &[&str], device: Option<&str>) -> Self {
        let arguments = arguments.iter().map(|a| (*a).to_owned()).collect();
        Self { name: name.to_owned(), kind: Kind::Ours { arguments, device: device.map(str::to_owned) } }
    }

    /// A method of the runner.
    pub fn peer(name: &str, fact: &Fact, python: &Path) -> Self {
        let kind = Kind::Peer { python: python.to_owned(), takes_edge: fact.takes_edge };
        Self { name: name.to_owned(), kind }
    }

    /// The file with its result.
    pub fn result(&self, task: &Task) -> PathBuf {
        task.folder.join(format!("{}.ply", self.name.replace(' ', "-")))
    }

    /// The edge length that gives the wanted count, and how many runs it took to find; none for programs that
    /// take a count.
    ///
    /// # Errors
    /// If the program fails.
    pub fn edge(&self, task: &Task) -> Result<(Option<f64>, usize)> {
        if !matches!(self.kind, Kind::Peer { takes_edge: true, .. }) {
            return Ok((None, 0));
        }
        let mut search = Search::new(task.vertices);
        let (mut edge, mut best) = (None, None::<(usize, f64)>);
        let mut runs = 0;
        loop {
            let (said, _) = self.ask(task, edge)?;
            runs += 1;
            let used = said.edge.context("the runner did not say which edge length it took")?;
            let off = said.vertices.abs_diff(task.vertices);
            if best.is_none_or(|(least, _)| off < least) {
                best = Some((off, used));
            }
            edge = search.next(used, said.vertices);
            if edge.is_none() {
                return Ok((best.map(|(_, length)| length), runs));
            }
        }
    }

    /// Runs it once.
    ///
    /// # Errors
    /// If it fails.
    pub fn round(&self, task: &Task, edge: Option<f64>) -> Result<Round> {
        let Kind::Ours { arguments, device } = &self.kind else {
            let (said, process) = self.ask(task, edge)?;
            return Ok(Round { call: said.seconds, process });
        };
        let mut command = Command::new(env!("CARGO_BIN_EXE_rtfmesh"));
        command.args(["remesh", "--verbose", "-n", &task.vertices.to_string()]).args(arguments);
        command.arg(&task.input).arg(self.result(task));
        if let Some(device) = device {
            command.args(["--device", device]);
        }
        let ended = process::run(&mut command, &task.folder)?;
        Ok(Round { call: wall_time(&ended.messages)?, process: ended.seconds })
    }

    fn ask(&self, task: &Task, edge: Option<f64>) -> Result<(Said, f64)> {
        let Kind::Peer { python, .. } = &self.kind else {
            bail!("{} is not a method of the runner", self.name)
        };
        let mut command = Command::new(python);
        command.arg(runner()).arg(&self.name).arg(&task.input).arg(self.result(task));
        command.arg(task.vertices.to_string());
        if let Some(angle) = task.features {
            command.arg("--features").arg(angle.to_string());
        }
        if let Some(edge) = edge {
            command.arg("--edge").arg(edge.to_string());
        }
        let ended = process::run(&mut command, &task.folder)?;
        // Libraries may print something before.
        let last = ended.output.lines().rev().find(|line| line.starts_with('{'));
        let said = serde_json::from_str(last.context("the runner printed no figures")?)?;
        Ok((said, ended.seconds))
    }
}
