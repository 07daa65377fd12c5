//! Other programs, timed as a whole.

use anyhow::{Context as _, Result, bail};
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A program that takes longer is killed.
const PATIENCE: Duration = Duration::from_secs(300);
/// Time between checks whether a program has ended.
const LOOK: Duration = Duration::from_millis(2);

/// The outcome of a program.
pub struct Ended {
    /// Wall time from its start to its end.
    pub seconds: f64,
    /// Its standard output.
    pub output: String,
    /// Its standard error.
    pub messages: String,
}

/// Runs a program until it ends; its outputs go through files in `folder`.
///
/// # Errors
/// If it cannot be started, takes too long, or fails; in the last case with the last line that it wrote.
pub fn run(command: &mut Command, folder: &Path) -> Result<Ended> {
    let name = command.get_program().to_string_lossy().into_owned();
    let paths = [folder.join("stdout"), folder.join("stderr")];
    let begin = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(File::create(&paths[0])?)
        .stderr(File::create(&paths[1])?)
        .spawn()
        .with_context(|| format!("starting {name}"))?;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if begin.elapsed() > PATIENCE {
            child.kill()?;
            child.wait()?;
            bail!("{name} took more than {} s", PATIENCE.as_secs());
        }
        std::thread::sleep(LOOK);
    };
    let seconds = begin.elapsed().as_secs_f64();
    let read =
        |path: &Path| Ok::<_, anyhow::Error>(String::from_utf8_lossy(&std::fs::read(path)?).into_owned());
    let messages = read(&paths[1])?;
    if !status.success() {
        let last = messages.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no message");
        bail!("{status}: {}", last.trim());
    }
    Ok(Ended { seconds, output: read(&paths[0])?, messages })
}
