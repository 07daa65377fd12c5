//! How long kernels take, so that no dispatch keeps a device busy for long: where a display hangs on it,
//! the system resets a device that does not answer for some two seconds.

use super::device::lock;
use std::collections::HashMap;
use std::sync::Mutex;

/// Longest that a dispatch should take, in nanoseconds.
const LONGEST: f64 = 0.2e9;
/// What an invocation of a kernel is taken to need that was not measured yet, in nanoseconds: as much as the
/// slowest of a default run, the neighbour lists, on two cores of a CPU.
const UNMEASURED: f64 = 1e3;
/// Most invocations of an indirect dispatch, whose number the host does not know: about half a second on a
/// device as slow as that.
const INDIRECT: usize = 1 << 19;
/// Fewer invocations than this are neither measured, since timestamps take time, too, nor divided by time.
const FEW: usize = 1 << 16;

/// How many invocations a dispatch may have, by measured time or by number.
pub(super) struct Rates {
    /// [`super::DeviceOptions::dispatch_threads`].
    most: Option<usize>,
    /// Nanoseconds an invocation.
    measured: Mutex<HashMap<&'static str, f64>>,
}

impl Rates {
    /// Of a device on which no dispatch may have more than this many invocations, or take longer than
    /// [`LONGEST`].
    pub fn new(most: Option<usize>) -> Self {
        Self { most, measured: Mutex::default() }
    }

    /// Most invocations of a kernel in one dispatch.
    pub fn most(&self, kernel: &str) -> usize {
        let by_time = || {
            let each = lock(&self.measured).get(kernel).copied().unwrap_or(UNMEASURED);
            ((LONGEST / each) as usize).max(FEW)
        };
        self.most.unwrap_or_else(by_time)
    }

    /// Most invocations that an indirect dispatch should have.
    pub fn most_indirect(&self) -> usize {
        self.most.unwrap_or(INDIRECT)
    }

    /// Whether a dispatch of this many invocations is to be measured.
    pub fn wants(&self, threads: usize) -> bool {
        self.most.is_none() && threads >= FEW
    }

    /// Records how long this many invocations of a kernel took.
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
        assert_eq!(rates.most("a"), 200_000);
        rates.measure("a", 100_000, 1e6);
        assert_eq!((rates.most("a"), rates.most("b")), (20_000_000, 200_000));
        // The last one counts, since work may become more; what is measured once can be measured again.
        rates.measure("a", 100_000, 2e8);
        assert_eq!(rates.most("a"), 100_000);
        rates.measure("a", 100_000, 2e9);
        assert!(rates.most("a") == FEW && rates.wants(FEW));
        // Too few to tell, or a clock that stood still.
        rates.measure("b", 1000, 1.0);
        rates.measure("b", 100_000, 0.0);
        assert_eq!(rates.most("b"), 200_000);
        let by_number = Rates::new(Some(4096));
        by_number.measure("a", 100_000, 1e6);
        assert!(!by_number.wants(100_000) && by_number.most("a") == 4096);
        assert_eq!([&rates, &by_number].map(Rates::most_indirect), [INDIRECT, 4096]);
    }
}
