//! The Vulkan layer: device, memory, kernels, recording. The only module with `unsafe` code.
//!
//! Its contract: a caller that names every buffer once per dispatch and waits for a submission before reading
//! gets what the kernels wrote; errors are only those that a caller cannot foresee (memory, device lost).
#![allow(unsafe_code)]

mod barriers;
mod buffer;
mod cache;
mod device;
#[cfg(test)]
mod faults;
mod instance;
mod kernel;
pub mod kernels;
mod recorder;
mod select;
mod timer;

pub use buffer::{Buffer, RawBuffer};
pub use device::{Device, DeviceOptions};
pub use kernel::{Access, BindingInfo, BindingSet, Kernel, KernelInfo, Pipeline, SpecializationConstants};
pub use recorder::{Download, Recorder, Submitted, Threads};
pub use select::{DeviceInfo, Limits, list_devices};
pub use timer::StageTime;

use crate::Error;
use ash::vk;

/// A failed Vulkan call as an [`Error`], with what was being done.
fn vk_error(what: &str, result: vk::Result) -> Error {
    let (problem, remedy) = match result {
        vk::Result::ERROR_DEVICE_LOST => return Error::DeviceLost(what.to_owned()),
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            (format!("out of memory during {what}"), "close other programs, or ask for fewer vertices")
        }
        other => (format!("{what} failed: {other}"), "update the Vulkan driver, or try another `device`"),
    };
    Error::device(problem, remedy).caused_by(result)
}
