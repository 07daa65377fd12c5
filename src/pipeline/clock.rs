//! Wall time of a run by phase.

use super::result::{PhaseTime, RunTimings};
use crate::gpu::Device;
use std::time::Instant;

/// Measures the phases of a run, one after another.
pub(crate) struct Clock {
    last: Instant,
    phases: Vec<PhaseTime>,
}

impl Clock {
    /// The times of all phases, and of the kernels on the device.
    pub fn timings(self, device: &Device) -> RunTimings {
        RunTimings {
            stages: device.take_timings(),
            wall_milliseconds: self.phases.iter().map(|p| p.milliseconds).sum(),
            phases: self.phases,
            peak_device_bytes: device.peak_bytes(),
        }
    }

    /// Starts with the first phase.
    pub fn new() -> Self {
        Self { last: Instant::now(), phases: Vec::new() }
    }

    /// Ends the current phase under this name.
    pub fn phase(&mut self, name: &'static str) {
        let now = Instant::now();
        let milliseconds = (now - self.last).as_secs_f64() * 1e3;
        match self.phases.last_mut().filter(|p| p.name == name) {
            // Levels of the same kind count together.
            Some(phase) => phase.milliseconds += milliseconds,
            None => self.phases.push(PhaseTime { name, milliseconds }),
        }
        self.last = now;
    }
}
