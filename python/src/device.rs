//! Vulkan devices.

use crate::work::work;
use pyo3::prelude::*;
use rtfmesh::device::tested_devices;
use rtfmesh::report::to_json;
use rtfmesh::{DeviceOptions, list_devices};

/// An open device, with what was compiled for it.
#[pyclass(frozen, module = "rtfmesh._native")]
pub struct Device(pub rtfmesh::Device);

#[pymethods]
impl Device {
    /// `memory` is in MiB.
    #[new]
    fn open(py: Python<'_>, device: Option<String>, memory: Option<u64>, timings: bool) -> PyResult<Self> {
        let mut wish = DeviceOptions::from_env().timings(timings);
        wish.device = device.or(wish.device);
        wish.memory_bytes = memory.map(|mebibytes| mebibytes << 20);
        work(py, || rtfmesh::Device::open(&wish)).map(Self)
    }

    /// As one of `devices`.
    fn info(&self, py: Python<'_>) -> PyResult<String> {
        work(py, || to_json(self.0.info()))
    }
}

/// The devices of this machine as JSON; `test` runs the self-test of those that were never used.
#[pyfunction]
pub fn devices(py: Python<'_>, test: bool) -> PyResult<String> {
    work(py, || to_json(&if test { tested_devices()? } else { list_devices()? }))
}
