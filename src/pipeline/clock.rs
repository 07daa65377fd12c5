//! Wall time of a run by phase, and how much of it is waiting for the device.

use super::result::{PhaseTime, RunTimings};
use crate::gpu::Device;
use std::time::{Duration, Instant};

/// Measures the phases of a run, one after another.
pub(crate) struct Clock {
    device: Device,
    last: Instant,
    /// How long the device had been waited for then.
    last_waited: Duration,
    phases: Vec<PhaseTime>,
}

impl Clock {
    /// Starts with the first phase.
    pub fn new(device: &Device) -> Self {
        let device = device.clone();
        Self { last: Instant::now(), last_waited: device.time_waited(), device, phases: Vec::new() }
    }

    /// The times of all phases, and of the kernels on the device.
    pub fn timings(self) -> RunTimings {
        RunTimings {
            stages: self.device.take_timings(),
            wall_milliseconds: self.phases.iter().map(|p| p.milliseconds).sum(),
            waiting_milliseconds: self.phases.iter().map(|p| p.waiting_milliseconds).sum(),
            phases: self.phases,
            peak_device_bytes: self.device.peak_bytes(),
        }
    }

    /// Ends the current phase under this name.
    pub fn end_phase(&mut self, name: &'static str) {
        let (now, waited) = (Instant::now(), self.device.time_waited());
        let milliseconds = (now - self.last).as_secs_f64() * 1e3;
        let waiting_milliseconds = (waited - self.last_waited).as_secs_f64() * 1e3;
        match self.phases.last_mut().filter(|p| p.name == name) {
            // Levels of the same kind count together.
            Some(phase) => {
                phase.milliseconds += milliseconds;
                phase.waiting_milliseconds += waiting_milliseconds;
            }
            None => self.phases.push(PhaseTime { name, milliseconds, waiting_milliseconds }),
        }
        (self.last, self.last_waited) = (now, waited);
    }
}
