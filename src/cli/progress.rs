//! Progress of the program: its progress bar, Ctrl-C and the time limit.

use super::heading::DEVICE;
use super::terminal::tell;
use crate::gpu::end_process;
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use rtfmesh::io::Patience;
use rtfmesh::{Error, Flow, Phase, Progress, ProgressToken, Summary, WarningCode};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Exit code of a run that was stopped, as shells have it for Ctrl-C.
pub const CANCELLED: u8 = 130;
/// A cancelled program that has not ended by itself after this long, for instance since it still reads, is
/// ended.
const GRACE: Duration = Duration::from_millis(500);
/// The time that finishing early takes is an estimate; this many times that is set aside.
const SAFETY: f64 = 1.3;
/// The fraction of the time limit that a surface through points or in a volume may take.
const SURFACE: f64 = 0.5;
/// How often to look whether to wait for a file any longer.
const LOOK: Duration = Duration::from_millis(50);
/// Reading may go on for this long beyond the time limit: a pipe says itself who is late.
const LATE: Duration = Duration::from_millis(200);
/// Steps of the bar.
const STEPS: f64 = 10_000.0;

/// How often Ctrl-C was pressed.
static INTERRUPTS: AtomicU32 = AtomicU32::new(0);
/// Whether the first Ctrl-C makes the run finish early instead of cancelling it.
static KEEP_PARTIAL: AtomicBool = AtomicBool::new(false);
/// For work that a first Ctrl-C ends in any case, since there is nothing to keep: reading.
static READING: LazyLock<ProgressToken> = LazyLock::new(ProgressToken::default);
/// When the time limit ends.
static DEADLINE: Mutex<Option<Instant>> = Mutex::new(None);
/// Locked while files are written, so that none is left half-written.
static WRITING: Mutex<()> = Mutex::new(());
/// Who ends the program: one of the next two, or nobody yet.
static END: AtomicU8 = AtomicU8::new(0);
const BY_ITSELF: u8 = 1;
const BY_HANDLER: u8 = 2;
/// See [`set_cancel_message`].
static CANCEL_MESSAGE: Mutex<Option<String>> = Mutex::new(None);

/// Options that end a long run early.
#[derive(clap::Args)]
pub struct ProgressArgs {
    #[command(flatten)]
    time: TimeArgs,
    /// On Ctrl-C write the best mesh so far; a second Ctrl-C stops
    ///
    /// By default nothing is written. The exit code is 130 in both cases.
    #[arg(long, help_heading = DEVICE, hide_short_help = true)]
    keep_partial: bool,
}

/// How long a run may take.
#[derive(clap::Args)]
pub struct TimeArgs {
    /// Finish within about this time with the best mesh found by then [default: none]
    ///
    /// If not even the input is read by then, the run fails.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = DEVICE,
        hide_short_help = true)]
    pub time_limit: Option<Duration>,
}

pub(super) fn seconds(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || "give a number of seconds above 0".to_owned();
    let value: f64 = text.parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(value).ok().filter(|limit| !limit.is_zero()).ok_or_else(wrong)
}

/// Shows the progress of one run, and decides when it is cancelled or finishes early.
pub struct RunProgress<'a> {
    /// Whom the run also asks what to do next.
    caller: Option<Box<dyn FnMut(Progress) -> Flow + 'a>>,
    limit: Option<Duration>,
    begun: Instant,
    bar: ProgressBar,
    /// The current attempt, when its levels began, and at which fraction.
    since: Option<(u32, Instant, f64)>,
    out_of_time: bool,
}

impl<'a> RunProgress<'a> {
    /// Handles Ctrl-C and counts the time limit from here on.
    ///
    /// # Errors
    /// As [`handle_interrupts`].
    pub fn new(args: &ProgressArgs) -> Result<Self> {
        KEEP_PARTIAL.store(args.keep_partial, Ordering::SeqCst);
        handle_interrupts()?;
        Ok(Self::with_limit(args.time.time_limit))
    }

    /// Without a time limit, and leaves Ctrl-C to others.
    pub fn unlimited() -> Self {
        let (caller, limit, bar) = (None, None, ProgressBar::hidden());
        Self { caller, limit, begun: Instant::now(), bar, since: None, out_of_time: false }
    }

    /// Counts the time limit from here on, and leaves Ctrl-C to others.
    pub fn with_limit(limit: Option<Duration>) -> Self {
        let deadline = limit.and_then(|limit| Instant::now().checked_add(limit));
        *DEADLINE.lock().unwrap_or_else(PoisonError::into_inner) = deadline;
        Self { limit, ..Self::unlimited() }
    }

    /// Does work that is given up, with [`Error::Cancelled`], on Ctrl-C and at the time limit.
    ///
    /// # Errors
    /// Those of the work.
    pub fn work<T>(&self, work: impl FnOnce(&ProgressToken) -> rtfmesh::Result<T>) -> rtfmesh::Result<T> {
        let token = ProgressToken::default();
        // Hangs up once the work is done, after a panic as well.
        let (working, done) = channel::<()>();
        let (watched, end) = (token.clone(), self.limit.and_then(|limit| self.begun.checked_add(limit)));
        std::thread::scope(|scope| {
            scope.spawn(move || {
                while done.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                    if is_cancelled() || end.is_some_and(|end| Instant::now() > end) {
                        watched.cancel();
                    }
                }
            });
            let _working = working;
            work(&token)
        })
    }

    /// Begins to read something in a thread of its own, which goes on by itself if it is not waited for.
    pub fn begin_reading<T: Send + 'static>(
        &self,
        read: impl FnOnce() -> rtfmesh::Result<T> + Send + 'static,
    ) -> Reading<T> {
        let deadline = patience().deadline.and_then(|deadline| deadline.checked_add(LATE));
        let (ended, end) = channel();
        let thread = std::thread::spawn(move || {
            // Told by being dropped, after a panic as well.
            let _ended: Sender<()> = ended;
            read()
        });
        Reading { thread, end, deadline, limit: self.limit.unwrap_or_default(), cancelled: READING.clone() }
    }

    /// Also asks the caller of the library what to do next.
    pub fn with_caller(self, caller: impl FnMut(Progress) -> Flow + 'a) -> Self {
        Self { caller: Some(Box::new(caller)), ..self }
    }

    /// Shows a progress bar: on standard error, and only if that is a terminal.
    pub fn show_bar(&mut self) {
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {eta} left");
        let bar = ProgressBar::new(STEPS as u64);
        self.bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
    }

    /// Shows the progress and returns what the run is to do next.
    pub fn update(&mut self, now: Progress) -> Flow {
        let asked = self.caller.as_mut().map_or(Flow::Continue, |caller| caller(now));
        asked.max(self.own_flow(now))
    }

    fn own_flow(&mut self, now: Progress) -> Flow {
        self.draw(now);
        if is_cancelled() {
            return Flow::Cancel;
        }
        // A surface that was cut short leaves its time to the run.
        let is_time_up = self.is_time_up(now);
        self.out_of_time |= is_time_up && now.phase != Phase::Surface;
        if is_time_up || self.out_of_time || INTERRUPTS.load(Ordering::SeqCst) > 0 {
            Flow::Finish
        } else {
            Flow::Continue
        }
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

    /// Whether the rest of the time is needed to finish early.
    fn is_time_up(&self, now: Progress) -> bool {
        let Some(limit) = self.limit.map(|limit| limit.as_secs_f64()) else { return false };
        if now.phase == Phase::Surface {
            return self.begun.elapsed().as_secs_f64() > SURFACE * limit;
        }
        let whole = match self.since {
            Some((_, since, from)) if now.fraction > from => {
                since.elapsed().as_secs_f64() / (now.fraction - from)
            }
            _ => 0.0,
        };
        self.begun.elapsed().as_secs_f64() + SAFETY * now.to_finish * whole > limit
    }

    /// Whether the time limit has passed.
    pub fn is_over(&self) -> bool {
        self.limit.is_some_and(|limit| self.begun.elapsed() > limit)
    }

    /// Removes the progress bar at the end of the run.
    pub fn end(&self) {
        self.bar.finish_and_clear();
    }

    /// Adds a warning to the summary of a run that finished early; returns whether Ctrl-C cut it short.
    pub fn warn(&self, summary: &mut Summary) -> bool {
        if !summary.finished_early {
            return false;
        }
        let text = match self.limit.filter(|_| self.out_of_time) {
            Some(limit) => format!("the time limit of {} s ended the run early", limit.as_secs_f64()),
            None => "the run was ended early".to_owned(),
        };
        summary.warn(WarningCode::CutShort, format!("{text}: more time gives better triangles"));
        !self.out_of_time
    }
}

/// Something that a thread reads.
pub struct Reading<T> {
    thread: JoinHandle<rtfmesh::Result<T>>,
    /// Hangs up once the thread is done.
    end: Receiver<()>,
    deadline: Option<Instant>,
    limit: Duration,
    cancelled: ProgressToken,
}

impl<T> Reading<T> {
    /// What was read from this file.
    ///
    /// # Errors
    /// Those of reading, [`Error::Input`] if it takes longer than the time limit, [`Error::Cancelled`] on
    /// Ctrl-C.
    pub fn wait(self, path: &Path) -> rtfmesh::Result<T> {
        while self.end.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
            if self.cancelled.is_cancelled() {
                return Err(Error::Cancelled);
            }
            if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                let problem = format!("reading takes longer than --time-limit {}", self.limit.as_secs_f64());
                let remedy = "allow more time, or give a smaller file";
                return Err(Error::input(None, problem, remedy).in_file(path));
            }
        }
        self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

/// Ends the program in an orderly way on Ctrl-C from here on.
///
/// # Errors
/// If the system allows no handler for Ctrl-C.
pub fn handle_interrupts() -> Result<()> {
    Ok(ctrlc::set_handler(interrupted)?)
}

/// How long reading waits for a pipe: until Ctrl-C or the time limit.
pub fn patience() -> Patience {
    let deadline = *DEADLINE.lock().unwrap_or_else(PoisonError::into_inner);
    Patience { token: READING.clone(), deadline }
}

/// Locks out Ctrl-C while files are written.
///
/// # Errors
/// [`Error::Cancelled`] if it was pressed before.
pub fn begin_writing() -> rtfmesh::Result<MutexGuard<'static, ()>> {
    let writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    if is_cancelled() { Err(Error::Cancelled) } else { Ok(writing) }
}

/// Sets the message of a program that is cancelled from now on, in place of that of [`Error::Cancelled`].
pub fn set_cancel_message(text: String) {
    *CANCEL_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner) = Some(text);
}

/// The error of a program that was cancelled.
pub fn cancelled() -> CancelledByUser {
    let message = CANCEL_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner).clone();
    CancelledByUser(message.unwrap_or_else(|| Error::Cancelled.to_string()))
}

/// The user cancelled the program with Ctrl-C; holds the message.
#[derive(Debug)]
pub struct CancelledByUser(String);

impl std::fmt::Display for CancelledByUser {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.write_str(&self.0)
    }
}

impl std::error::Error for CancelledByUser {}

/// Keeps the handler of Ctrl-C from ending the program, which is about to end by itself. Where the handler is
/// doing so already, this does not return.
pub fn end_by_itself() {
    while END.compare_exchange(0, BY_ITSELF, Ordering::SeqCst, Ordering::SeqCst) == Err(BY_HANDLER) {
        std::thread::park();
    }
}

/// Whether the program is cancelled.
pub fn is_cancelled() -> bool {
    INTERRUPTS.load(Ordering::SeqCst) > u32::from(KEEP_PARTIAL.load(Ordering::SeqCst))
}

/// Handles Ctrl-C, in a thread of its own.
fn interrupted() {
    INTERRUPTS.fetch_add(1, Ordering::SeqCst);
    READING.cancel();
    if !is_cancelled() {
        tell("finishing with the best mesh so far; press Ctrl-C again to stop\n");
        return;
    }
    std::thread::sleep(GRACE);
    let _nothing_half_written = WRITING.lock();
    if END.compare_exchange(0, BY_HANDLER, Ordering::SeqCst, Ordering::SeqCst).is_ok() {
        tell(&format!("error: {}\n", cancelled()));
        end_process(CANCELLED);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads something for as long as the sender that comes with it is not dropped.
    fn endless(deadline: Option<Instant>) -> (Reading<u32>, Sender<()>) {
        let (wait, ended) = channel::<()>();
        let run = RunProgress { limit: Some(Duration::from_secs(2)), ..RunProgress::unlimited() };
        let reading = run.begin_reading(move || {
            let _hung_up = ended.recv();
            Ok(7)
        });
        (Reading { deadline, cancelled: ProgressToken::default(), ..reading }, wait)
    }

    #[test]
    fn work_is_given_up_at_the_time_limit() {
        let late = RunProgress { limit: Some(Duration::from_nanos(1)), ..RunProgress::unlimited() };
        let given_up = late.work(|token| {
            while !token.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
            }
            Err::<(), _>(Error::Cancelled)
        });
        assert!(given_up.is_err());
        assert_eq!(RunProgress::unlimited().work(|_| Ok(7)).unwrap(), 7);
    }

    #[test]
    fn reading_ends_at_the_time_limit_and_on_ctrl_c() {
        let path = Path::new("large.obj");
        let (late, _wait) = endless(Some(Instant::now()));
        let told = late.wait(path).unwrap_err().to_string();
        assert!(told.contains("large.obj") && told.contains("longer than --time-limit 2"), "{told}");
        let (stopped, _wait) = endless(None);
        stopped.cancelled.cancel();
        assert!(matches!(stopped.wait(path), Err(Error::Cancelled)));
        let (read, wait) = endless(None);
        drop(wait);
        assert_eq!(read.wait(path).unwrap(), 7);
    }
}
