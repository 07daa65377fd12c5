//! The number of iterations in a submission, few enough that a run can be stopped within a second; and the
//! check that they moved anything.

use crate::gpu::{Device, Recorder};
use crate::{Error, Result};
use std::time::Instant;

/// Largest duration of a submission, in seconds.
const PATIENCE: f64 = 0.3;
/// Largest product of sites and iterations of the first submission.
const FIRST: usize = 150_000;

/// Iterations for each submission, adapted to the measured time; results do not depend on it.
pub(crate) struct Pace {
    pub iterations: u32,
    most: u32,
    begun: Instant,
}

impl Pace {
    /// For this many sites, with at most this many iterations.
    pub fn new(sites: usize, most: u32) -> Self {
        let most = most.max(1);
        let first = u32::try_from(FIRST / sites.max(1)).unwrap_or(most);
        Self { iterations: first.clamp(1, most), most, begun: Instant::now() }
    }

    /// Begins a submission.
    pub fn begin(&mut self) {
        self.begun = Instant::now();
    }

    /// Ends a submission that had this many iterations.
    pub fn end(&mut self, iterations: u32) {
        let seconds = self.begun.elapsed().as_secs_f64().max(1e-6);
        self.iterations = ((f64::from(iterations) * PATIENCE / seconds) as u32).clamp(1, self.most);
    }
}

/// Rounds of work that are recorded into as few submissions as [`Pace`] allows.
pub(crate) struct Submissions<'a> {
    device: &'a Device,
    recorder: Recorder,
    pace: Pace,
    rounds: u32,
}

impl<'a> Submissions<'a> {
    /// For this many sites or vertices, with at most this many rounds each.
    ///
    /// # Errors
    /// As [`Recorder::new`].
    pub fn new(device: &'a Device, sites: usize, most: u32) -> Result<Self> {
        Ok(Self { device, recorder: Recorder::new(device)?, pace: Pace::new(sites, most), rounds: 0 })
    }

    /// What the next round is recorded into; submits the rounds before, if they are enough for a submission.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn next_round(&mut self) -> Result<&mut Recorder> {
        if self.rounds == self.pace.iterations {
            let full = std::mem::replace(&mut self.recorder, Recorder::new(self.device)?);
            self.pace.begin();
            full.submit()?;
            self.pace.end(self.rounds);
            self.rounds = 0;
        }
        self.rounds += 1;
        Ok(&mut self.recorder)
    }

    /// Submits what the round has so far, where a round is long enough for a submission.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn divide(&mut self) -> Result<&mut Recorder> {
        if self.pace.iterations == 1 {
            let half = std::mem::replace(&mut self.recorder, Recorder::new(self.device)?);
            half.submit()?;
        }
        Ok(&mut self.recorder)
    }

    /// The last rounds, not submitted, for the downloads that follow.
    pub fn into_last(self) -> Recorder {
        self.recorder
    }
}

/// Refuses the work of a device that computes nothing: sites at random places do not rest in all iterations.
///
/// # Errors
/// [`Error::Device`] if there are steps and all are 0.
pub(crate) fn require_moves(device: &Device, steps: &[f64]) -> Result<()> {
    if steps.is_empty() || steps.iter().any(|step| *step != 0.0) {
        return Ok(());
    }
    let name = &device.info().name;
    Err(Error::device(
        format!("no vertex moved in {} iterations: device '{name}' computes nothing", steps.len()),
        "see `rtfmesh devices`, update its driver, or choose another `device`",
    ))
}
