//! How a long run is watched: what it tells while it works, and how it is asked to stop.

use crate::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often the callback is asked while work on the host goes on.
const PATIENCE: Duration = Duration::from_millis(100);

/// Part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Phase {
    /// Cleaning the input, finding its curves, and compiling kernels.
    #[default]
    Prepare,
    /// Relaxing and connecting fewer vertices than asked for.
    CoarseLevels,
    /// Relaxing and connecting all vertices; but for [`crate::Method::CoarseToFine`] the only level.
    LastLevel,
    /// Flips and relaxation of the mesh.
    Polish,
    /// Bringing its faces close to the surface.
    Fit,
    /// Bringing the places close that the fit leaves.
    Outliers,
    /// Looking for faces that run through others.
    Check,
    /// Measuring the result.
    Measure,
}

impl Phase {
    /// In a word or two, for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prepare => "prepare",
            Self::CoarseLevels => "coarse levels",
            Self::LastLevel => "last level",
            Self::Polish => "polish",
            Self::Fit => "fit",
            Self::Outliers => "spots",
            Self::Check => "check",
            Self::Measure => "measure",
        }
    }
}

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// What it does.
    pub phase: Phase,
    /// The random start, or count of vertices, that is tried; from 1.
    pub attempt: u32,
    /// Share of the attempt's work that is done, 0 to 1, by estimate. Within an attempt it never falls; the run ends with
    /// 1.
    pub fraction: f64,
    /// What would have to follow if the run were asked to [`Flow::Finish`] now, on the same scale.
    pub to_finish: f64,
    /// Iterations done, over all levels.
    pub iteration: u32,
    /// Most iterations, over all levels.
    pub iterations: u32,
    /// Root mean square step of the last iteration in spacings.
    pub step: f64,
}

/// What a run is to do next. A callback that gives nothing, `()`, lets it go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Flow {
    /// Go on.
    #[default]
    Continue,
    /// Come to an end with what there is: few further iterations, a short polish, a valid mesh with the exact count. The
    /// run remembers it.
    Finish,
    /// Stop with [`Error::Cancelled`].
    Cancel,
}

impl From<()> for Flow {
    fn from((): ()) -> Self {
        Self::Continue
    }
}

/// What connecting a level costs, in iterations; as measured on the CPU.
pub(crate) const CONNECT: f64 = 12.0;

/// Ends work of [`Watch::during`] that is to stop.
///
/// # Errors
/// [`Error::Cancelled`], which the run gives too.
pub(crate) fn heed(stop: &AtomicBool) -> Result<()> {
    if stop.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
}

/// A callback with what it was told, and what it answered.
pub(crate) struct Watch<'a> {
    ask: &'a mut dyn FnMut(Progress) -> Flow,
    /// The strongest answer so far.
    flow: Flow,
    now: Progress,
    /// The fractions between which the phase lies.
    range: (f64, f64),
    /// As [`Progress::to_finish`], from the end of the phase.
    after: f64,
    /// Iterations before those of the level, and the most of all levels.
    level: (u32, u32),
    /// Whether something was left out for [`Flow::Finish`].
    cut: bool,
}

impl<'a> Watch<'a> {
    pub fn new(ask: &'a mut dyn FnMut(Progress) -> Flow) -> Self {
        let now = Progress { attempt: 1, ..Progress::default() };
        Self { ask, flow: Flow::Continue, now, range: (0.0, 0.0), after: 0.0, level: (0, 0), cut: false }
    }

    /// An attempt begins.
    pub fn attempt(&mut self, attempt: u32) {
        self.now = Progress { attempt, ..Progress::default() };
    }

    /// A phase begins, which lasts until a fraction; `after` as [`Progress::to_finish`] at its end.
    ///
    /// # Errors
    /// As [`Watch::done`].
    pub fn phase(&mut self, phase: Phase, until: f64, after: f64) -> Result<()> {
        self.now.phase = phase;
        self.range = (self.now.fraction, until.max(self.now.fraction));
        self.after = after;
        self.done(0.0)
    }

    /// Iterations before those of the level that begins, and the most of all levels.
    pub fn level(&mut self, before: u32, most: u32) {
        self.level = (before, most);
    }

    /// Iterations of the level that are done, of how many, and the last step.
    ///
    /// # Errors
    /// As [`Watch::done`].
    pub fn iterated(&mut self, done: u32, of: u32, step: f64) -> Result<()> {
        let (before, most) = self.level;
        (self.now.iteration, self.now.iterations, self.now.step) = (before + done, most, step);
        self.done(f64::from(done) / (f64::from(of) + CONNECT))
    }

    /// Tells which share of the phase is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if it was asked for.
    pub fn done(&mut self, share: f64) -> Result<()> {
        let (from, until) = self.range;
        let fraction = from + (until - from) * share.clamp(0.0, 1.0);
        self.now.fraction = fraction.clamp(self.now.fraction, 1.0);
        self.now.to_finish = self.after;
        self.look()
    }

    /// Materials whether to stop, within the phase.
    ///
    /// # Errors
    /// As [`Watch::done`].
    pub fn look(&mut self) -> Result<()> {
        // Whoever has cancelled is not asked again.
        if self.flow != Flow::Cancel {
            self.flow = (self.ask)(self.now).max(self.flow);
        }
        if self.flow == Flow::Cancel { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Does work on the host that takes long, and looks meanwhile; once it is to stop, `work` is told so and what it gives
    /// is dropped. On a thread of a pool, which must not wait for the pool, there is no look.
    ///
    /// # Errors
    /// As [`Watch::done`].
    pub fn during<T: Send>(&mut self, work: impl FnOnce(&AtomicBool) -> T + Send) -> Result<T> {
        let stop = AtomicBool::new(false);
        if rayon::current_thread_index().is_some() {
            return Ok(work(&stop));
        }
        let (sender, receiver) = channel();
        rayon::in_place_scope(|scope| {
            let stop = &stop;
            // Nobody receives once the run is cancelled.
            scope.spawn(move |_| drop(sender.send(work(stop))));
            loop {
                match receiver.recv_timeout(PATIENCE) {
                    Ok(done) => return Ok(done),
                    Err(RecvTimeoutError::Timeout) => {
                        self.look().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
                    }
                    // Its panic comes out of the scope.
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(Error::Internal("work on the host ended without a result".to_owned()));
                    }
                }
            }
        })
    }

    /// Whether the run is to come to an end.
    pub fn finishing(&self) -> bool {
        self.flow >= Flow::Finish
    }

    /// At most `few` of something, if the run is to come to an end.
    pub fn shortened(&mut self, count: u32, few: u32) -> u32 {
        if !self.finishing() || count <= few {
            return count;
        }
        self.cut = true;
        few
    }

    /// Whether to leave out what is left of a phase.
    pub fn leave_out(&mut self) -> bool {
        self.cut |= self.finishing();
        self.finishing()
    }

    /// Whether anything was left out.
    pub fn is_cut(&self) -> bool {
        self.cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_on_the_host_is_watched_and_stopped() {
        let mut asked = 0;
        let mut ask = |_| {
            asked += 1;
            if asked == 3 { Flow::Cancel } else { Flow::Continue }
        };
        let mut watch = Watch::new(&mut ask);
        assert_eq!(watch.during(|_| 7), Ok(7));
        let endless = |stop: &AtomicBool| {
            while !stop.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        assert_eq!(watch.during(endless), Err(Error::Cancelled));
        assert_eq!(asked, 3);
    }

    #[test]
    fn a_thread_of_a_pool_does_not_wait_for_itself() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let sum = pool.install(|| Watch::new(&mut |_| Flow::Continue).during(|_| rayon::join(|| 1, || 2)));
        assert_eq!(sum, Ok((1, 2)));
    }
}
