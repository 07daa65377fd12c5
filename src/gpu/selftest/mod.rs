//! The self-test of a driver: small kernels of `glsl/selftest`, whose results the host knows.
//!
//! A driver that computes nothing, or one operation wrong, may still end a run without an error, because the
//! host repairs what it gets. So each driver runs these kernels once, in one submission, before it is used;
//! [`verdict`] keeps what came of it.

mod expected;
mod inputs;
mod parts;
pub(super) mod verdict;

use super::device::Device;
use super::kernel::KernelInfo;
use super::kernels::selftest::{arithmetic, atomics, indirect, loops, shared, subgroups};
use super::recorder::Recorder;
use super::{Kernel, Submitted};
use crate::Result;
use inputs::Inputs;
use parts::Parts;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What the self-test of a device's driver found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SelfTest {
    /// The device was not opened since its driver was installed.
    Untested,
    /// All kernels compute what they should.
    Passed,
    /// The kernels that do not, or why they did not run.
    Failed(String),
}

impl fmt::Display for SelfTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Untested => f.write_str("not run"),
            Self::Passed => f.write_str("passed"),
            Self::Failed(what) => write!(f, "failed: {what}"),
        }
    }
}

/// The kernels.
pub(super) const KERNELS: [&KernelInfo; 6] = [
    arithmetic::Shader::INFO,
    loops::Shader::INFO,
    subgroups::Shader::INFO,
    shared::Shader::INFO,
    atomics::Shader::INFO,
    indirect::Shader::INFO,
];

/// How many results of a kernel are wrong, of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Tally {
    wrong: usize,
    all: usize,
}

impl Tally {
    /// Of results, each with whether it is right.
    fn of(results: impl IntoIterator<Item = bool>) -> Self {
        results.into_iter().fold(Self { wrong: 0, all: 0 }, |tally, right| Self {
            wrong: tally.wrong + usize::from(!right),
            all: tally.all + 1,
        })
    }
}

/// What compares a kernel's results with the host's.
type Check<'a> = (&'static str, Box<dyn FnOnce(&Submitted) -> Result<Tally> + 'a>);

/// Runs all kernels and compares their results with the host's.
///
/// # Errors
/// Those of the device.
pub(super) fn run(device: &Device) -> Result<SelfTest> {
    let inputs = Inputs::new();
    let parts = Parts::new(device, &inputs)?;
    let mut recorder = Recorder::new(device)?;
    parts.record_inputs(&mut recorder)?;
    let checks: Vec<Check> = vec![
        parts.arithmetic(&mut recorder)?,
        parts.loops(&mut recorder)?,
        parts.subgroups(&mut recorder)?,
        parts.shared(&mut recorder)?,
        parts.atomics(&mut recorder)?,
        parts.indirect(&mut recorder)?,
    ];
    let done = recorder.submit()?;
    let mut wrong = Vec::new();
    for (kernel, check) in checks {
        let tally = check(&done)?;
        if tally.wrong > 0 {
            wrong.push(format!("{kernel} ({} of {} results)", tally.wrong, tally.all));
        }
    }
    let kernels = if wrong.len() == 1 { "kernel" } else { "kernels" };
    Ok(match wrong.is_empty() {
        true => SelfTest::Passed,
        false => SelfTest::Failed(format!("wrong results of {kernels} {}", wrong.join(", "))),
    })
}
