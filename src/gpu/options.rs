//! How a device is opened.

/// How to open a device.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceOptions {
    /// An index, `cpu`, `gpu`, `uuid:4f3f9d26-...` or `pci:0000:41:00.0` as [`super::DeviceInfo`] has them,
    /// or a part of the name; `None` takes the best one that is usable and passes the self-test, discrete
    /// before integrated before virtual before CPU. A device that is named here may fail the self-test; see
    /// [`super::Device::warnings`].
    pub device: Option<String>,
    /// Turns on core and synchronization validation; see [`super::Device::take_validation_messages`].
    pub validation: bool,
    /// Maximum number of bytes of all buffers together; at least 1. `None` sets no limit.
    pub memory_bytes: Option<u64>,
    /// Puts a full barrier before every command. If that changes the result, a barrier is missing.
    pub full_barriers: bool,
    /// Times every kernel and copy, for [`super::StageTime::milliseconds`]. This slows the device down: on
    /// lavapipe by about 70 µs each, so that a run of 2,000 vertices takes 1.5 times as long.
    pub timings: bool,
    /// Limits the device to what Vulkan guarantees: 16 KiB of shared memory, 128 invocations per workgroup,
    /// 128 MiB per buffer, no timestamps. For tests.
    pub(crate) least_limits: bool,
    /// Maximum number of bytes of one buffer; larger data is divided into several buffers. `None` uses the
    /// device's limit. For tests of large meshes.
    pub(crate) buffer_bytes: Option<u64>,
    /// Most invocations of one dispatch; what is larger is divided. `None`: on a GPU as many as take a fifth
    /// of a second, by measured time, since a system may reset one that does not answer for longer; no limit
    /// on a CPU. Indirect dispatches are not divided; most are short. For tests of large meshes.
    pub(crate) dispatch_threads: Option<usize>,
    /// Whether the device (`true`) or host code (`false`) polishes, fits and checks whole meshes. `None`: the
    /// device, unless it is a CPU and the mesh is so small that starting kernels would take longer; the host
    /// polishes along curves, and fits small meshes with curves. Results differ by rounding and by the order
    /// of flips.
    pub polish: Option<bool>,
    /// Whether the self-test runs (`true`), whatever is known, or does not (`false`); the result is not kept.
    /// `None`: the first time that a driver is used.
    pub(crate) self_test: Option<bool>,
    /// Whether the driver keeps what its compiler knows of each kernel, if it can.
    pub(crate) statistics: bool,
}

impl DeviceOptions {
    /// Options from the environment: `RTFMESH_DEVICE`; `RTFMESH_VALIDATION`, `RTFMESH_FULL_BARRIERS`,
    /// `RTFMESH_LEAST_LIMITS` and `RTFMESH_SELF_TEST`, which 1 turns on; `RTFMESH_DEVICE_POLISH`, 1 or 0.
    /// Timings are off.
    pub fn from_env() -> Self {
        let on = |name| std::env::var_os(name).is_some_and(|v| v == "1");
        Self {
            device: std::env::var("RTFMESH_DEVICE").ok().filter(|d| !d.is_empty()),
            validation: on("RTFMESH_VALIDATION"),
            memory_bytes: None,
            full_barriers: on("RTFMESH_FULL_BARRIERS"),
            timings: false,
            least_limits: on("RTFMESH_LEAST_LIMITS"),
            buffer_bytes: None,
            dispatch_threads: None,
            polish: std::env::var_os("RTFMESH_DEVICE_POLISH").map(|v| v == "1"),
            statistics: false,
            self_test: on("RTFMESH_SELF_TEST").then_some(true),
        }
    }

    /// Sets [`DeviceOptions::device`].
    #[must_use]
    pub fn device(self, device: impl Into<Option<String>>) -> Self {
        Self { device: device.into(), ..self }
    }

    /// Sets [`DeviceOptions::validation`].
    #[must_use]
    pub fn validation(self, validation: bool) -> Self {
        Self { validation, ..self }
    }

    /// Sets [`DeviceOptions::memory_bytes`].
    #[must_use]
    pub fn memory_bytes(self, memory_bytes: impl Into<Option<u64>>) -> Self {
        Self { memory_bytes: memory_bytes.into(), ..self }
    }

    /// Sets [`DeviceOptions::full_barriers`].
    #[must_use]
    pub fn full_barriers(self, full_barriers: bool) -> Self {
        Self { full_barriers, ..self }
    }

    /// Sets [`DeviceOptions::timings`].
    #[must_use]
    pub fn timings(self, timings: bool) -> Self {
        Self { timings, ..self }
    }

    /// Sets [`DeviceOptions::polish`].
    #[must_use]
    pub fn polish(self, polish: impl Into<Option<bool>>) -> Self {
        Self { polish: polish.into(), ..self }
    }
}

/// What tests set.
#[cfg(feature = "internals")]
impl DeviceOptions {
    /// Sets [`DeviceOptions::least_limits`].
    #[must_use]
    pub fn least_limits(self, least_limits: bool) -> Self {
        Self { least_limits, ..self }
    }

    /// Sets [`DeviceOptions::buffer_bytes`].
    #[must_use]
    pub fn buffer_bytes(self, buffer_bytes: impl Into<Option<u64>>) -> Self {
        Self { buffer_bytes: buffer_bytes.into(), ..self }
    }

    /// Sets [`DeviceOptions::dispatch_threads`].
    #[must_use]
    pub fn dispatch_threads(self, dispatch_threads: impl Into<Option<usize>>) -> Self {
        Self { dispatch_threads: dispatch_threads.into(), ..self }
    }

    /// Sets [`DeviceOptions::statistics`].
    #[must_use]
    pub fn statistics(self, statistics: bool) -> Self {
        Self { statistics, ..self }
    }

    /// Sets [`DeviceOptions::self_test`].
    #[must_use]
    pub fn self_test(self, self_test: impl Into<Option<bool>>) -> Self {
        Self { self_test: self_test.into(), ..self }
    }
}
