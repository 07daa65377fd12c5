//! How long kernels take, so that no dispatch keeps a device busy for long: where a display hangs on it,
//! the system resets a device that does not answer for some two seconds.

use super::device::lock;
use std::collections::HashMap;
use std::sync::Mutex;

/// Longest that a dispatch should take, in nanoseconds.
const LONGEST: f64 = 0.2e9;
/// What an invocation of a kernel takes that was not measured yet, in nanoseconds: as much as that of a slow
/// kernel on two cores of a CPU.
const UNMEASURED: f64 = 1e3;
/// Fewer invocations are not measured, since timestamps take time, too.
const FEW: usize = 1 << 16;

/// The share of the longest time that invocations take, by measured time or by number.
pub(super) struct Rates {
    /// [`super::DeviceOptions::dispatch_threads`].
    most: Option<usize>,
    /// Nanoseconds an invocation.
    measured: Mutex<HashMap<&'static str, f64>>,
}

impl Rates {
    /// Of a device on which no dispatch may have more than so many invocations, or take longer than
    /// [`LONGEST`].
    pub fn new(most: Option<usize>) -> Self {
        Self { most, measured: Mutex::default() }
    }

    /// The share of the longest time that an invocation of a kernel takes.
    pub fn share(&self, kernel: &str) -> f64 {
        match self.most {
            Some(most) => 1.0 / most.max(1) as f64,
            None => lock(&self.measured).get(kernel).copied().unwrap_or(UNMEASURED) / LONGEST,
        }
    }

    /// Whether a dispatch of so many invocations is to be measured.
    pub fn wants(&self, threads: usize) -> bool {
        self.most.is_none() && threads >= FEW
    }

    /// Takes what so many invocations of a kernel took.
    pub fn measure(&self, kernel: &'static str, threads: usize, nanoseconds: f64) {
        if self.wants(threads) && nanoseconds > 0.0 {
            lock(&self.measured).insert(kernel, nanoseconds / threads as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dispatches_are_as_large_as_time_allows() {
        let rates = Rates::new(None);
        let most = |kernel| (1.0 / rates.share(kernel)).round() as usize;
        assert_eq!(most("a"), 200_000);
        rates.measure("a", 100_000, 1e6);
        assert_eq!((most("a"), most("b")), (20_000_000, 200_000));
        // The last one counts, since work may become more.
        rates.measure("a", 100_000, 1e8);
        assert_eq!(most("a"), 200_000);
        // Too few to tell, or a clock that stood still.
        rates.measure("b", 1000, 1.0);
        rates.measure("b", 100_000, 0.0);
        assert_eq!(most("b"), 200_000);
        let by_number = Rates::new(Some(4096));
        by_number.measure("a", 100_000, 1e6);
        assert!(!by_number.wants(100_000) && (1.0 / by_number.share("a")).round() as usize == 4096);
    }
}
