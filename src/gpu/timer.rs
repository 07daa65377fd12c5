//! Device time by stage, from timestamps around every dispatch and copy.

use serde::Serialize;
use std::collections::BTreeMap;

/// Time of one kind of dispatch.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct StageTime {
    /// Name of the kernel or copy.
    pub name: String,
    /// Number of dispatches.
    pub calls: u64,
    /// Their total time on the device in milliseconds; `None` if the device has no timestamps, or
    /// timings were not asked for.
    pub milliseconds: Option<f64>,
}

/// The time of all dispatches and copies, by name.
#[derive(Debug, Default)]
pub(super) struct Timings {
    by_name: BTreeMap<&'static str, (u64, f64, bool)>,
}

impl Timings {
    /// Adds one dispatch; `nanoseconds` is `None` if it was not timed.
    pub fn add(&mut self, name: &'static str, nanoseconds: Option<f64>) {
        let (calls, sum, timed) = self.by_name.entry(name).or_insert((0, 0.0, true));
        *calls += 1;
        *sum += nanoseconds.unwrap_or(0.0);
        *timed &= nanoseconds.is_some();
    }

    pub fn into_list(self) -> Vec<StageTime> {
        self.by_name
            .into_iter()
            .map(|(name, (calls, ns, timed))| StageTime {
                name: name.to_owned(),
                calls,
                milliseconds: timed.then_some(ns * 1e-6),
            })
            .collect()
    }
}
