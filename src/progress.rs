//! Progress of a long run: what it reports to its caller, and how the caller cancels it or makes it finish
//! early.

use crate::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// How often the callback is called while the host works.
const INTERVAL: Duration = Duration::from_millis(100);

/// A phase of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[non_exhaustive]
pub enum Phase {
    /// Building a surface through points.
    Surface,
    /// Cleaning the input, finding its features, and compiling kernels.
    #[default]
    Prepare,
    /// Relaxing and connecting the coarse levels, which have fewer vertices.
    CoarseLevels,
    /// Relaxing and connecting all vertices; the only level except with [`crate::Method::CoarseToFine`].
    LastLevel,
    /// Edge flips and relaxation of the mesh.
    Polish,
    /// Moving vertices so that the faces lie close to the surface.
    Fit,
    /// Editing the mesh where it is still far from the surface after the fit.
    Outliers,
    /// Checking for self-intersections.
    Check,
    /// Mending small angles.
    Mend,
    /// Measuring the result.
    Measure,
}

impl Phase {
    /// A name of one or two words for people to read.
    pub fn name(self) -> &'static str {
        match self {
            Self::Surface => "surface",
            Self::Prepare => "prepare",
            Self::CoarseLevels => "coarse levels",
            Self::LastLevel => "last level",
            Self::Polish => "polish",
            Self::Fit => "fit",
            Self::Outliers => "outliers",
            Self::Check => "check",
            Self::Mend => "mend",
            Self::Measure => "measure",
        }
    }
}

/// The progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Progress {
    /// The current phase.
    pub phase: Phase,
    /// The current attempt, from 1: each has another random start, vertex count or edge lengths.
    pub attempt: u32,
    /// Estimated fraction of the attempt's work that is done, 0 to 1. It never decreases within an attempt
    /// and is 1 at the end of the run.
    pub fraction: f64,
    /// Work that would remain, on the same scale, if the callback returned [`Flow::Finish`] now.
    pub to_finish: f64,
    /// Completed iterations, on all levels.
    pub iteration: u32,
    /// Maximum number of iterations, on all levels.
    pub iterations: u32,
    /// Root mean square step of the last iteration, in spacings.
    pub step: f64,
}

/// What a run does next, as decided by the callback. Returning `()` continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[non_exhaustive]
pub enum Flow {
    /// Continue.
    #[default]
    Continue,
    /// Finish early, with few further iterations and a short polish; the mesh is still valid and has the
    /// exact vertex count. This cannot be undone.
    Finish,
    /// Stop with [`Error::Cancelled`] and without a result.
    Cancel,
}

impl From<()> for Flow {
    fn from((): ()) -> Self {
        Self::Continue
    }
}

/// Cost of connecting a level, in iterations, as measured on the CPU.
pub(crate) const CONNECT: f64 = 12.0;

/// How many times as long as the preparation of the input its simplification takes, about, with what follows.
const SIMPLIFICATION: f64 = 8.0;

/// Connects a long computation with its caller. The computation reports the fraction of its work that is done
/// and polls whether to stop; any thread may cancel it or ask it to finish early.
///
/// Clones share their state. Pass `&ProgressToken::default()` if you neither watch nor stop the work.
#[derive(Debug, Clone)]
pub struct ProgressToken {
    state: Arc<State>,
    /// The part of the whole work that this token stands for, as shares of it.
    from: f64,
    to: f64,
    /// Whether the work is given up where it is to finish early.
    gives_up: bool,
}

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    finishing: AtomicBool,
    /// Whether work was skipped to finish early.
    shortened: AtomicBool,
    /// Bits of a number of 0 to 1; those of non-negative numbers are ordered as the numbers are.
    share: AtomicU64,
}

impl Default for ProgressToken {
    fn default() -> Self {
        Self { state: Arc::default(), from: 0.0, to: 1.0, gives_up: false }
    }
}

impl ProgressToken {
    /// Makes the work stop with [`Error::Cancelled`].
    pub fn cancel(&self) {
        self.state.cancelled.store(true, Ordering::Relaxed);
    }

    /// Makes the work skip everything that a valid result does not need.
    pub fn finish_early(&self) {
        self.state.finishing.store(true, Ordering::Relaxed);
    }

    /// Fraction of the whole work that is done, 0 to 1.
    pub fn fraction(&self) -> f64 {
        f64::from_bits(self.state.share.load(Ordering::Relaxed))
    }

    /// Whether work was left out to finish early.
    pub fn is_shortened(&self) -> bool {
        self.state.shortened.load(Ordering::Relaxed)
    }

    /// Long work must call this several times a second.
    ///
    /// # Errors
    /// [`Error::Cancelled`] once the work is cancelled.
    pub(crate) fn poll(&self) -> Result<()> {
        let is_given_up = self.gives_up && self.is_finishing();
        if self.is_cancelled() || is_given_up { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Reports the fraction of this token's work that is done, 0 to 1, and polls.
    ///
    /// # Errors
    /// As [`ProgressToken::poll`].
    pub(crate) fn done(&self, share: f64) -> Result<()> {
        let share = self.from + (self.to - self.from) * share.clamp(0.0, 1.0);
        self.state.share.fetch_max(share.to_bits(), Ordering::Relaxed);
        self.poll()
    }

    /// The token for a part of this one's work, between two fractions of it.
    #[must_use]
    pub(crate) fn part(&self, from: f64, to: f64) -> Self {
        let at = |share: f64| self.from + (self.to - self.from) * share.clamp(0.0, 1.0);
        Self { state: Arc::clone(&self.state), from: at(from), to: at(to), ..*self }
    }

    /// A token for work whose fraction of the whole is unknown; its reports are ignored.
    #[must_use]
    pub(crate) fn silent(&self) -> Self {
        self.part(0.0, 0.0)
    }

    /// The result of `work`; or that of `rough`, which takes little time, if the work is to finish early
    /// before it is done.
    ///
    /// # Errors
    /// As [`ProgressToken::poll`], and those of the work.
    pub(crate) fn or_rough<T>(
        &self,
        work: impl FnOnce(&Self) -> Result<T>,
        rough: impl FnOnce(&Self) -> Result<T>,
    ) -> Result<T> {
        match work(&Self { gives_up: true, ..self.clone() }) {
            Err(Error::Cancelled) if self.leave_out() && !self.is_cancelled() => rough(self),
            done => done,
        }
    }

    /// Whether the work is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.state.cancelled.load(Ordering::Relaxed)
    }

    /// Whether the work is to finish early.
    pub fn is_finishing(&self) -> bool {
        self.state.finishing.load(Ordering::Relaxed)
    }

    /// Whether to skip work that a valid result does not need. If so, [`ProgressToken::is_shortened`] is true
    /// from now on.
    pub(crate) fn leave_out(&self) -> bool {
        let finishing = self.is_finishing();
        if finishing {
            self.state.shortened.store(true, Ordering::Relaxed);
        }
        finishing
    }

    /// `count`, or at most `few` if the work is to finish early.
    pub(crate) fn at_most(&self, few: u32, count: u32) -> u32 {
        if count > few && self.leave_out() { few } else { count }
    }

    /// Begins another whole.
    fn restart(&self) {
        self.state.share.store(0, Ordering::Relaxed);
    }
}

/// Reports a run's progress to the caller's callback, and passes the answers on to a [`ProgressToken`].
pub(crate) struct ProgressReporter<'a> {
    callback: &'a mut dyn FnMut(Progress) -> Flow,
    token: ProgressToken,
    now: Progress,
    /// The fractions at which the phase begins and ends.
    range: (f64, f64),
    /// Iterations of the levels before this one, and the largest number on all levels.
    level: (u32, u32),
    begun: Instant,
    /// What the first preparation took.
    preparation: Option<Duration>,
    /// When, and at which fraction, the attempt's preparation ended.
    prepared: Option<(Instant, f64)>,
    /// Whether the run would end with a simplified input if it were to finish now.
    would_simplify: bool,
}

impl<'a> ProgressReporter<'a> {
    pub fn new(callback: &'a mut dyn FnMut(Progress) -> Flow) -> Self {
        Self {
            callback,
            token: ProgressToken::default(),
            now: Progress { attempt: 1, ..Progress::default() },
            range: (0.0, 0.0),
            level: (0, 0),
            begun: Instant::now(),
            preparation: None,
            prepared: None,
            would_simplify: false,
        }
    }

    /// Begins an attempt.
    pub fn attempt(&mut self, attempt: u32) {
        self.now = Progress { attempt, ..Progress::default() };
        self.range = (0.0, 0.0);
        (self.prepared, self.would_simplify) = (None, false);
        self.token.restart();
    }

    /// Says whether the run would end with a simplified input if it were to finish now.
    pub fn would_simplify(&mut self, would: bool) {
        self.would_simplify = would;
    }

    /// What simplifying the input would take, on the scale of fractions: the costs of phases say little about
    /// it, since cells on a surface of many triangles take long.
    fn simplification(&self) -> f64 {
        let (Some(preparation), Some((since, from))) = (self.preparation, self.prepared) else { return 0.0 };
        if !self.would_simplify {
            return 0.0;
        }
        let per_second = (self.now.fraction - from) / since.elapsed().as_secs_f64().max(f64::MIN_POSITIVE);
        SIMPLIFICATION * preparation.as_secs_f64() * per_second
    }

    /// Begins a phase that ends at the fraction `until`. `to_finish` is what [`Progress::to_finish`] reports
    /// during it.
    ///
    /// # Errors
    /// As [`ProgressReporter::poll`].
    pub fn phase(&mut self, phase: Phase, until: f64, to_finish: f64) -> Result<()> {
        self.range = (self.now.fraction, until.max(self.now.fraction));
        self.now = Progress { phase, to_finish, ..self.now };
        if phase > Phase::Prepare && self.prepared.is_none() {
            self.prepared = Some((Instant::now(), self.now.fraction));
            self.preparation.get_or_insert(self.begun.elapsed());
        }
        self.token.restart();
        self.poll()
    }

    /// Begins a level: `before` iterations were done on others, of at most `most` on all.
    pub fn level(&mut self, before: u32, most: u32) {
        self.level = (before, most);
    }

    /// Reports that `done` of the level's `of` iterations are done, with the step of the last one.
    ///
    /// # Errors
    /// As [`ProgressReporter::poll`].
    pub fn iterated(&mut self, done: u32, of: u32, step: f64) -> Result<()> {
        let (before, most) = self.level;
        (self.now.iteration, self.now.iterations, self.now.step) = (before + done, most, step);
        self.done(f64::from(done) / (f64::from(of) + CONNECT))
    }

    /// Reports the share of the phase that is done.
    ///
    /// # Errors
    /// As [`ProgressReporter::poll`].
    pub fn done(&mut self, share: f64) -> Result<()> {
        self.token.done(share)?;
        self.poll()
    }

    /// Calls the callback.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if it asks for that, now or earlier.
    pub fn poll(&mut self) -> Result<()> {
        // Once it has cancelled, it is not called again.
        self.token.poll()?;
        let (from, until) = self.range;
        let fraction = from + (until - from) * self.token.fraction();
        self.now.fraction = fraction.clamp(self.now.fraction, 1.0);
        let to_finish = self.now.to_finish + self.simplification();
        match (self.callback)(Progress { to_finish, ..self.now }) {
            Flow::Continue => {}
            Flow::Finish => self.token.finish_early(),
            Flow::Cancel => self.token.cancel(),
        }
        self.token.poll()
    }

    /// Does long work on the host in the thread pool, and calls the callback meanwhile. On a thread of a
    /// pool, which must not wait for the pool, the work is done in place, and the callback is called after
    /// it.
    ///
    /// # Errors
    /// As [`ProgressReporter::poll`], and those of `work`.
    pub fn during<T: Send>(&mut self, work: impl FnOnce(&ProgressToken) -> Result<T> + Send) -> Result<T> {
        let token = self.token.clone();
        if rayon::current_thread_index().is_some() {
            let done = work(&token)?;
            return self.poll().map(|()| done);
        }
        let (sender, receiver) = channel();
        rayon::in_place_scope(|scope| {
            let token = &token;
            // Nobody receives once the run is cancelled.
            scope.spawn(move |_| drop(sender.send(work(token))));
            loop {
                match receiver.recv_timeout(INTERVAL) {
                    Ok(done) => return done,
                    Err(RecvTimeoutError::Timeout) => self.poll()?,
                    // The scope passes the panic of the work on.
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(Error::Internal("work on the host ended without a result".to_owned()));
                    }
                }
            }
        })
    }

    /// Same as [`ProgressToken::at_most`].
    pub fn at_most(&self, few: u32, count: u32) -> u32 {
        self.token.at_most(few, count)
    }

    /// Same as [`ProgressToken::leave_out`].
    pub fn leave_out(&self) -> bool {
        self.token.leave_out()
    }

    /// Whether work was left out to finish early.
    pub fn is_shortened(&self) -> bool {
        self.token.is_shortened()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_on_the_host_is_reported_and_cancelled() {
        let mut told = Vec::new();
        let mut callback = |now: Progress| {
            told.push(now.fraction);
            if told.len() == 3 { Flow::Cancel } else { Flow::Continue }
        };
        let mut progress = ProgressReporter::new(&mut callback);
        progress.phase(Phase::Polish, 0.8, 0.0).unwrap();
        assert_eq!(progress.during(|_| Ok(7)), Ok(7));
        let endless = |token: &ProgressToken| -> Result<()> {
            loop {
                token.done(0.5)?;
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        assert_eq!(progress.during(endless), Err(Error::Cancelled));
        assert_eq!((told.len(), told[0], told[2]), (3, 0.0, 0.4));
    }

    #[test]
    fn work_is_given_up_for_rough_work_where_it_is_to_finish_early() {
        let run = |finish: bool, cancel: bool| {
            let token = ProgressToken::default();
            let work = |token: &ProgressToken| {
                if finish {
                    token.finish_early();
                }
                if cancel {
                    token.cancel();
                }
                token.part(0.0, 0.5).poll().map(|()| "whole")
            };
            let done = token.or_rough(work, |token| token.poll().map(|()| "rough"));
            (done, token.is_shortened())
        };
        assert_eq!(run(false, false), (Ok("whole"), false));
        assert_eq!(run(true, false), (Ok("rough"), true));
        assert_eq!(run(true, true).0, Err(Error::Cancelled));
        assert_eq!(run(false, true).0, Err(Error::Cancelled));
    }

    #[test]
    fn simplification_counts_as_work_to_finish_while_it_would_be_needed() {
        let mut told = Vec::new();
        let mut callback = |now: Progress| {
            told.push(now.to_finish);
            Flow::Continue
        };
        let mut progress = ProgressReporter::new(&mut callback);
        std::thread::sleep(Duration::from_millis(20));
        progress.phase(Phase::LastLevel, 0.5, 0.25).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        progress.done(0.5).unwrap();
        progress.would_simplify(true);
        progress.poll().unwrap();
        std::thread::sleep(Duration::from_millis(20));
        progress.poll().unwrap();
        progress.would_simplify(false);
        progress.poll().unwrap();
        progress.would_simplify(true);
        progress.attempt(2);
        progress.poll().unwrap();
        // The same time is a smaller share of an attempt that takes longer than was thought.
        assert!(told[2] > told[3] && told[3] > 0.25, "{told:?}");
        assert_eq!([told[0], told[1], told[4], told[5]], [0.25, 0.25, 0.25, 0.0]);
    }

    #[test]
    fn a_thread_of_a_pool_does_not_wait_for_itself() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let mut calls = 0;
        let mut callback = |_| {
            calls += 1;
            Flow::Continue
        };
        let work = |_: &ProgressToken| Ok(rayon::join(|| 1, || 2));
        // The callback need not be `Send`, so the reporter is made in the pool.
        let sum = pool.install(|| ProgressReporter::new(&mut callback).during(work));
        assert_eq!((sum, calls), (Ok((1, 2)), 1));
    }

    #[test]
    fn parts_report_shares_of_the_whole_that_never_fall() {
        let token = ProgressToken::default();
        let half = token.part(0.5, 1.0);
        half.part(0.2, 0.4).done(1.0).unwrap();
        assert_eq!(token.fraction(), 0.7);
        half.done(0.0).unwrap();
        half.silent().done(1.0).unwrap();
        assert_eq!(token.fraction(), 0.7);
        half.done(2.0).unwrap();
        assert_eq!(token.fraction(), 1.0);
    }

    #[test]
    fn work_is_left_out_only_to_finish_early() {
        let token = ProgressToken::default();
        assert!(!token.leave_out() && token.at_most(4, 30) == 30);
        token.finish_early();
        assert!(token.at_most(4, 3) == 3 && !token.is_shortened());
        assert!(token.part(0.0, 0.5).at_most(4, 30) == 4 && token.is_shortened());
        assert_eq!(token.poll(), Ok(()));
    }
}
