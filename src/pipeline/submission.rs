//! How many iterations go into one submission: few enough that a run can be stopped within a second.

use std::time::Instant;

/// Seconds that a submission should take at most.
const PATIENCE: f64 = 0.3;
/// Sites times iterations of the first submission at most.
const FIRST: usize = 100_000;

/// Iterations a submission; does not change what they do.
pub(crate) struct Pace {
    pub iterations: u32,
    most: u32,
    begun: Instant,
}

impl Pace {
    /// For so many sites, with at most so many iterations.
    pub fn new(sites: usize, most: u32) -> Self {
        let first = u32::try_from(FIRST / sites.max(1)).unwrap_or(most);
        Self { iterations: first.clamp(1, most), most, begun: Instant::now() }
    }

    /// A submission begins.
    pub fn begin(&mut self) {
        self.begun = Instant::now();
    }

    /// It had so many iterations.
    pub fn end(&mut self, iterations: u32) {
        let seconds = self.begun.elapsed().as_secs_f64().max(1e-6);
        self.iterations = ((f64::from(iterations) * PATIENCE / seconds) as u32).clamp(1, self.most);
    }
}
