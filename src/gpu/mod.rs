//! The Vulkan layer: device, memory, kernels, recording. The only module with `unsafe` code.
//!
//! Its contract: a caller that binds every buffer once per dispatch and waits for a submission before reading
//! gets what the kernels wrote. Errors are only those that a caller cannot foresee (memory, device lost).
#![allow(unsafe_code)]

mod barriers;
mod buffer;
mod cache;
mod copies;
mod device;
mod driver;
mod errors;
mod exit;
#[cfg(test)]
mod faults;
mod forks;
mod host_memory;
mod instance;
mod kernel;
pub mod kernels;
mod manifests;
mod options;
mod rates;
mod recorder;
mod select;
mod selftest;
#[cfg(feature = "internals")]
mod statistics;
mod submit;
mod submitted;
mod timer;
mod transfers;

pub use buffer::{Bound, Buffer, RawBuffer};
pub use device::Device;
pub(crate) use exit::end_process;
pub use kernel::{
    Access, BindingInfo, BindingSet, Kernel, KernelInfo, Pipeline, SpecializationConstants, Texels,
};
pub use options::DeviceOptions;
pub use recorder::{Recorder, Threads};
pub(crate) use select::no_device;
pub use select::{DeviceInfo, Limits, list_devices, tested_devices};
pub use selftest::SelfTest;
#[cfg(feature = "internals")]
pub use statistics::{CompiledKernel, SentWork};
pub use submitted::{Download, Submitted};
pub use timer::StageTime;
