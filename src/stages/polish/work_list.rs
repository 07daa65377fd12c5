//! A list that kernels append to, and that others work on part by part, without the host.

use crate::Result;
use crate::gpu::kernels::polish::advance;
use crate::gpu::{Buffer, Device, Download, Kernel, Pipeline, Recorder, Threads};
use glam::UVec4;

/// Length of the list, begin and end of the current part, a number that kernels count up, and two for kernels
/// to keep what they like.
const COUNTERS: usize = 6;
/// The index of the counter that kernels count up.
const COUNTED: usize = 3;

/// The list with its counters.
pub(in crate::stages) struct WorkList {
    advance: Pipeline<advance::Shader>,
    most_groups: u32,
    /// What was appended, in any order.
    pub list: Buffer<u32>,
    /// As in `glsl/polish/advance.comp`; the last one is for kernels to count with.
    pub counters: Buffer<u32>,
    /// Workgroups for the current part.
    pub groups: Buffer<UVec4>,
}

impl WorkList {
    /// With space for `most` elements.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, name: &str, most: usize) -> Result<Self> {
        Ok(Self {
            advance: Pipeline::new(device, advance::Constants::default())?,
            most_groups: device.info().limits.workgroups,
            list: Buffer::new(device, &format!("polish.{name}.list"), most)?,
            counters: Buffer::zeros(device, &format!("polish.{name}.counters"), COUNTERS)?,
            groups: Buffer::new(device, &format!("polish.{name}.groups"), 1)?,
        })
    }

    /// Like [`WorkList::record_clear`], and sets the last two counters.
    ///
    /// # Errors
    /// As [`Recorder::upload`].
    pub fn record_clear_with(&self, recorder: &mut Recorder, kept: [u32; 2]) -> Result<()> {
        recorder.upload(&self.counters, &[0; COUNTED])?;
        recorder.upload(&self.counters.window(COUNTED + 1, kept.len())?, &kept)
    }

    /// Records emptying the list; what kernels have counted stays.
    ///
    /// # Errors
    /// As [`Recorder::upload`].
    pub fn record_clear(&self, recorder: &mut Recorder) -> Result<()> {
        recorder.upload(&self.counters, &[0; COUNTED])
    }

    /// Records that what was appended since is the part for the next dispatches of `pipeline` by `groups`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_advance<K: Kernel>(&self, recorder: &mut Recorder, pipeline: &Pipeline<K>) -> Result<()> {
        let push = advance::Push { workgroup: pipeline.workgroup(), most_groups: self.most_groups };
        let bindings = advance::Bindings { counters: &self.counters, groups: &self.groups };
        recorder.dispatch(&self.advance, Threads(1), &push, &bindings)
    }

    /// Records a copy of what kernels have counted in all, for [`crate::gpu::Submitted::first`].
    ///
    /// # Errors
    /// As [`Recorder::download`].
    pub fn download_count(&self, recorder: &mut Recorder) -> Result<Download<u32>> {
        recorder.download(&self.counters.window(COUNTED, 1)?)
    }
}
