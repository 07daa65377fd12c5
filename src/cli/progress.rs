//! How the program watches a run: its progress bar, Ctrl-C and the time limit.

use super::heading::DEVICE;
use super::tell;
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use rtfmesh::{Error, Flow, Phase, Progress, Summary};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Exit code of a run that was stopped, as shells have it for Ctrl-C.
pub const CANCELLED: u8 = 130;
/// A run that has not stopped by itself after this long, such as one that still reads, is ended.
const PATIENCE: Duration = Duration::from_millis(500);
/// The time that finishing will take is an estimate; this many times that is set aside.
const CAUTION: f64 = 1.3;
/// Steps of the bar.
const STEPS: f64 = 10_000.0;

/// How often somebody asked to stop.
static ASKED: AtomicU32 = AtomicU32::new(0);
/// Whether the first of them wants what there is.
static KEEP: AtomicBool = AtomicBool::new(false);
/// Held while files are written, which is not to end half-way.
static WRITING: Mutex<()> = Mutex::new(());
/// See [`set_story`].
static STORY: Mutex<Option<String>> = Mutex::new(None);

/// What is done about a long run.
#[derive(clap::Args)]
pub struct WatchArgs {
    /// Finish within about this time, with the best mesh there is by then [default: none]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = DEVICE, hide_short_help = true)]
    time_limit: Option<Duration>,
    /// On Ctrl-C write the best mesh so far, with a warning; a second Ctrl-C stops. By default nothing is written
    #[arg(long, help_heading = DEVICE, hide_short_help = true)]
    keep_partial: bool,
}

fn seconds(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || "it must be a number of seconds above 0".to_owned();
    let value: f64 = text.parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(value).ok().filter(|limit| !limit.is_zero()).ok_or_else(wrong)
}

/// Watches one run.
pub struct Watch<'a> {
    args: &'a WatchArgs,
    begun: Instant,
    bar: ProgressBar,
    /// When the levels of an attempt began, and at which fraction.
    since: Option<(u32, Instant, f64)>,
    out_of_time: bool,
}

impl<'a> Watch<'a> {
    /// From here on Ctrl-C stops the program in an orderly way, and the time counts.
    ///
    /// # Errors
    /// If the system refuses to tell of Ctrl-C.
    pub fn new(args: &'a WatchArgs) -> Result<Self> {
        KEEP.store(args.keep_partial, Ordering::SeqCst);
        heed()?;
        let bar = ProgressBar::hidden();
        Ok(Self { args, begun: Instant::now(), bar, since: None, out_of_time: false })
    }

    /// Shows a progress bar: on standard error, and only if that is a terminal.
    pub fn show_bar(&mut self) {
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {eta} left");
        let bar = ProgressBar::new(STEPS as u64);
        self.bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
    }

    /// What the run is to do.
    pub fn progress(&mut self, now: Progress) -> Flow {
        self.draw(now);
        if is_cancelled() {
            return Flow::Cancel;
        }
        self.out_of_time |= self.is_time_up(now);
        if self.out_of_time || ASKED.load(Ordering::SeqCst) > 0 { Flow::Finish } else { Flow::Continue }
    }

    fn draw(&mut self, now: Progress) {
        let levels = matches!(now.phase, Phase::CoarseLevels | Phase::LastLevel);
        let mut text = now.phase.name().to_owned();
        if levels && now.iteration > 0 {
            text += &format!(", iteration {}/{}, step {:.5}", now.iteration, now.iterations, now.step);
        }
        if now.attempt > 1 {
            text = format!("attempt {}: {text}", now.attempt);
        }
        self.bar.set_message(text);
        self.bar.set_position((now.fraction * STEPS) as u64);
        if now.phase > Phase::Prepare && self.since.is_none_or(|(attempt, ..)| attempt != now.attempt) {
            self.since = Some((now.attempt, Instant::now(), now.fraction));
            self.bar.reset_eta();
        }
    }

    /// Whether what is left of the time is needed to finish.
    fn is_time_up(&self, now: Progress) -> bool {
        let Some(limit) = self.args.time_limit else { return false };
        let whole = match self.since {
            Some((_, since, from)) if now.fraction > from => {
                since.elapsed().as_secs_f64() / (now.fraction - from)
            }
            _ => 0.0,
        };
        self.begun.elapsed().as_secs_f64() + CAUTION * now.to_finish * whole > limit.as_secs_f64()
    }

    /// The run is over, well or not.
    pub fn end(&self) {
        self.bar.finish_and_clear();
    }

    /// Adds a warning to that of a run which was cut short.
    pub fn warn(&self, summary: &mut Summary) {
        if !summary.finished_early {
            return;
        }
        let text = match self.args.time_limit.filter(|_| self.out_of_time) {
            Some(limit) => format!("the time limit of {} s cut the run short", limit.as_secs_f64()),
            None => "the run was cut short".to_owned(),
        };
        summary.warnings.push(format!("{text}: more time makes better triangles"));
    }
}

/// From here on Ctrl-C stops the program in an orderly way.
///
/// # Errors
/// If the system refuses to tell of Ctrl-C.
pub fn heed() -> Result<()> {
    Ok(ctrlc::set_handler(asked_to_stop)?)
}

/// From here on files are written, and whoever asks to stop comes too late.
///
/// # Errors
/// [`Error::Cancelled`] for who comes before.
pub fn begin_writing() -> rtfmesh::Result<MutexGuard<'static, ()>> {
    let writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    if is_cancelled() { Err(Error::Cancelled) } else { Ok(writing) }
}

/// Sets what is told if the program is stopped from now on, in place of [`Error::Cancelled`].
pub fn set_story(text: String) {
    *STORY.lock().unwrap_or_else(PoisonError::into_inner) = Some(text);
}

/// The error of a program that was stopped, with its story.
pub fn stopped() -> Stopped {
    let story = STORY.lock().unwrap_or_else(PoisonError::into_inner).clone();
    Stopped(story.unwrap_or_else(|| Error::Cancelled.to_string()))
}

/// Somebody stopped the program.
#[derive(Debug)]
pub struct Stopped(String);

impl std::fmt::Display for Stopped {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.write_str(&self.0)
    }
}

impl std::error::Error for Stopped {}

/// Whether the program is to stop.
pub fn is_cancelled() -> bool {
    ASKED.load(Ordering::SeqCst) > u32::from(KEEP.load(Ordering::SeqCst))
}

/// Runs in a thread of its own.
fn asked_to_stop() {
    ASKED.fetch_add(1, Ordering::SeqCst);
    if !is_cancelled() {
        tell("coming to an end with what there is; press Ctrl-C again to stop\n");
        return;
    }
    std::thread::sleep(PATIENCE);
    let _nothing_half_written = WRITING.lock();
    tell(&format!("error: {}\n", stopped()));
    std::process::exit(i32::from(CANCELLED));
}
