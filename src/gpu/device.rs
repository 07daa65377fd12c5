//! The logical device: queue, memory allocator, pipeline cache.

use super::cache;
use super::errors::vk_error;
use super::forks;
use super::host_memory;
use super::instance::{Instance, open_all};
use super::kernel::Pipelines;
use super::options::DeviceOptions;
use super::rates::Rates;
use super::select::{Candidate, DeviceInfo, candidates, choose};
use super::selftest::{self, SelfTest, verdict};
use super::timer::{StageTime, Timings};
use super::transfers::Transfers;
use crate::{Error, Result};
use ash::{ext, khr, vk};
use gpu_allocator::AllocationSizes;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What the self-test has found while a device is being opened.
#[derive(Default)]
struct Known {
    /// By the device's index.
    verdicts: Vec<(usize, SelfTest)>,
    /// Why a self-test did not run to its end, the first time.
    error: Option<Error>,
}

impl Known {
    /// A device whose self-test ends in an error; another time it may not.
    fn refuse(&mut self, index: usize, error: Error) {
        self.verdicts.push((index, SelfTest::Failed(error.to_string())));
        self.error.get_or_insert(error);
    }

    /// Puts what is known in place of what was found earlier.
    fn apply(&self, all: &mut [Candidate], self_test: Option<bool>) {
        for info in all.iter_mut().map(|candidate| &mut candidate.info) {
            match self.verdicts.iter().find(|(index, _)| *index == info.index) {
                Some((_, verdict)) => info.self_test = verdict.clone(),
                None if self_test.is_some() => info.self_test = SelfTest::Untested,
                None => {}
            }
        }
    }
}

/// Minimum number of vertices of a mesh that a CPU polishes as a device, where starting a kernel takes some
/// 50 µs.
const LEAST_FOR_CPU: usize = 50_000;

/// Minimum number of vertices of a mesh with curves that a device fits: samples find the surface by walks,
/// which may end on the wrong side of details that are narrower than an edge.
const LEAST_WITH_CURVES: usize = 50_000;

/// Whether a device of this kind is to polish a mesh, or to fit one that has curves.
fn pays(kind: &str, vertices: usize, has_curves: bool) -> bool {
    (kind != "cpu" || vertices >= LEAST_FOR_CPU) && (!has_curves || vertices >= LEAST_WITH_CURVES)
}

/// Whether an instance stays until the process ends.
static KEEPS_DRIVER: AtomicBool = AtomicBool::new(false);

/// An open Vulkan device. Clones share it.
#[derive(Clone)]
pub struct Device {
    pub(super) shared: Arc<Shared>,
    /// The kernels compiled so far.
    pub(super) pipelines: Arc<Pipelines>,
    pub(super) transfers: Arc<Transfers>,
}

/// The Vulkan objects that buffers, pipelines and recorders keep alive.
pub(super) struct Shared {
    pub raw: ash::Device,
    pub queue: Mutex<vk::Queue>,
    pub queue_family: u32,
    pub pipeline_cache: vk::PipelineCache,
    /// The digest of what the pipeline cache began with.
    loaded_cache: u64,
    pub info: DeviceInfo,
    /// 0 without timestamps.
    pub timestamp_mask: u64,
    /// Whether all commands are timed.
    pub times_all: bool,
    /// `None` if dispatches may take as long as they need.
    pub rates: Option<Rates>,
    pub full_barriers: bool,
    pub reads_texels: bool,
    /// See [`DeviceOptions::memory_bytes`].
    pub memory_bytes: Option<u64>,
    warnings: Vec<String>,
    polish: Option<bool>,
    physical: vk::PhysicalDevice,
    reports_budget: bool,
    pub timings: Mutex<Timings>,
    /// How long the host has waited for submissions, and for what else was counted, in all.
    waited_nanoseconds: AtomicU64,
    allocated_bytes: AtomicU64,
    peak_bytes: AtomicU64,
    /// What was sent in all.
    pub submissions: AtomicU64,
    pub barriers: AtomicU64,
    names: Option<ext::debug_utils::Device>,
    /// See [`DeviceOptions::statistics`].
    pub statistics: Option<khr::pipeline_executable_properties::Device>,
    allocator: ManuallyDrop<Mutex<Allocator>>,
    next_id: AtomicU64,
    /// The process that opened it.
    process: u32,
    instance: ManuallyDrop<Instance>,
}

/// Size of the blocks that the allocator takes from the driver; small, because a mesh's buffers are. Those of
/// the host's memory begin smaller, since a GPU's driver clears and pins all of a block at once.
const BLOCK_BYTES: u64 = 32 << 20;
const FIRST_HOST_BLOCK_BYTES: u64 = 4 << 20;

/// After which a GPU counts as hung.
const LONGEST_WAIT: Duration = Duration::from_secs(120);

impl Device {
    /// Opens the device that `options` name. The first time that a driver is used, it must pass a self-test;
    /// see [`DeviceInfo::self_test`].
    ///
    /// # Errors
    /// [`Error::Device`] if there is no Vulkan, no such device, it lacks a needed limit, or its driver fails
    /// the self-test and the device was not named.
    pub fn open(options: &DeviceOptions) -> Result<Self> {
        let mut known = Known::default();
        loop {
            let mut instances = open_all(options.validation)?;
            let mut all = candidates(&instances)?;
            known.apply(&mut all, options.self_test);
            let (candidate, warnings) = match choose(all, options.device.as_deref()) {
                Ok(choice) => choice,
                Err(error) => return Err(known.error.unwrap_or(error)),
            };
            let instance = instances.swap_remove(candidate.instance);
            let (index, identity) = (candidate.info.index, candidate.identity);
            let is_tested =
                candidate.info.self_test != SelfTest::Untested || options.self_test == Some(false);
            let device = Self::of_candidate(instance, candidate, options)?;
            let self_test = if is_tested { Ok(SelfTest::Passed) } else { selftest::run(&device) };
            if let (false, None, Ok(self_test)) = (is_tested, options.self_test, &self_test) {
                verdict::store(device.info(), identity, self_test);
            }
            match self_test {
                Ok(SelfTest::Passed) => return device.ready(warnings, !is_tested, options),
                Err(error) if options.device.is_some() => return Err(error),
                Err(error) => known.refuse(index, error),
                Ok(failed) => known.verdicts.push((index, failed)),
            }
        }
    }

    fn of_candidate(instance: Instance, mut candidate: Candidate, options: &DeviceOptions) -> Result<Self> {
        if options.least_limits {
            candidate.info.limits = candidate.info.limits.least();
            candidate.timestamp_bits = 0;
            candidate.reads_texels = false;
        }
        let largest = &mut candidate.info.limits.storage_buffer_bytes;
        *largest = options.buffer_bytes.unwrap_or(*largest).min(*largest);
        let shared = Arc::new(Shared::new(instance, candidate, options)?);
        Ok(Self { shared, pipelines: Arc::default(), transfers: Arc::default() })
    }

    /// The device as its user gets it: what the self-test has used does not count.
    fn ready(mut self, warnings: Vec<String>, has_passed: bool, options: &DeviceOptions) -> Result<Self> {
        self.pipelines = Arc::default();
        self.transfers = Arc::default();
        let shared = Arc::get_mut(&mut self.shared);
        let shared = shared.ok_or_else(|| Error::Internal("the self-test keeps the device".to_owned()))?;
        shared.warnings = warnings;
        shared.memory_bytes = options.memory_bytes;
        if has_passed {
            shared.info.self_test = SelfTest::Passed;
        }
        let Shared { peak_bytes, waited_nanoseconds, submissions, barriers, .. } = shared;
        for counter in [peak_bytes, waited_nanoseconds, submissions, barriers] {
            counter.store(0, Ordering::Relaxed);
        }
        shared.timings = Mutex::default();
        Ok(self)
    }

    /// What is unusual about the choice of the device: its driver, or that of a better one, fails the
    /// self-test. [`crate::Summary::warnings`] contains it.
    pub fn warnings(&self) -> &[String] {
        &self.shared.warnings
    }

    /// Name, driver and limits.
    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Whether it polishes, fits and checks whole meshes with this many vertices, as
    /// [`DeviceOptions::polish`] says.
    pub(crate) fn polishes(&self, vertices: usize) -> bool {
        self.shared.polish.unwrap_or_else(|| pays(self.shared.info.kind, vertices, false))
    }

    /// Whether it fits meshes with this many vertices, some of them on curves, as [`DeviceOptions::polish`]
    /// says.
    pub(crate) fn fits_along_curves(&self, vertices: usize) -> bool {
        self.shared.polish.unwrap_or_else(|| pays(self.shared.info.kind, vertices, true))
    }

    /// Messages of the validation layers since the last call; always empty without
    /// [`DeviceOptions::validation`].
    pub fn take_validation_messages(&self) -> Vec<String> {
        std::mem::take(&mut *lock(&self.shared.instance.messages))
    }

    /// The messages, including those about objects that still exist when the device is destroyed.
    #[cfg(test)]
    pub(super) fn messages(&self) -> Arc<Mutex<Vec<String>>> {
        Arc::clone(&self.shared.instance.messages)
    }

    /// All dispatches and copies since the last call, by name, with their time if [`DeviceOptions::timings`]
    /// asks for it.
    pub fn take_timings(&self) -> Vec<StageTime> {
        std::mem::take(&mut *lock(&self.shared.timings)).into_list()
    }

    /// Most invocations that an indirect dispatch should have, since it is not divided as others are; `None`
    /// if no dispatch is.
    pub(crate) fn indirect_threads(&self) -> Option<usize> {
        self.shared.rates.as_ref().map(Rates::most_indirect)
    }

    /// Counts time in which the caller had nothing to do but to wait for the driver.
    pub(crate) fn count_waited(&self, time: Duration) {
        self.shared.count_waited(time);
    }

    /// How long this program has waited for the device's work to end, and for its driver as far as that was
    /// counted, in all.
    pub(crate) fn time_waited(&self) -> Duration {
        Duration::from_nanos(self.shared.waited_nanoseconds.load(Ordering::Relaxed))
    }

    /// Bytes of device memory that this program can use: the minimum of its size, of what other programs
    /// leave of it according to the driver, and of [`DeviceOptions::memory_bytes`]. Memory that this program
    /// already uses counts as available. For a CPU it is the machine's memory, whatever its driver reports.
    pub fn available_bytes(&self) -> u64 {
        let Shared { info, memory_bytes, allocated_bytes, .. } = &*self.shared;
        let own = allocated_bytes.load(Ordering::Relaxed);
        let machine = (info.kind == "cpu").then(host_memory::available).flatten();
        let size = machine.map_or_else(
            || self.shared.budget().min(info.limits.memory_bytes),
            |free| free.saturating_add(own),
        );
        size.min(memory_bytes.unwrap_or(u64::MAX))
    }

    /// Whether [`DeviceOptions::memory_bytes`] limits the memory.
    pub(crate) fn has_memory_limit(&self) -> bool {
        self.shared.memory_bytes.is_some()
    }

    /// Peak of the allocated buffer sizes, in bytes.
    pub fn peak_bytes(&self) -> u64 {
        self.shared.peak_bytes.load(Ordering::Relaxed)
    }
}

/// Locks a mutex even if it is poisoned: the guarded values are valid after every single operation.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What divides blocks of the device's memory among buffers.
fn allocator(
    instance: &Instance,
    device: &ash::Device,
    physical: vk::PhysicalDevice,
) -> gpu_allocator::Result<Allocator> {
    Allocator::new(&AllocatorCreateDesc {
        instance: instance.raw.clone(),
        device: device.clone(),
        physical_device: physical,
        debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
        buffer_device_address: false,
        allocation_sizes: AllocationSizes::new(BLOCK_BYTES, FIRST_HOST_BLOCK_BYTES)
            .with_max_host_memblock_size(BLOCK_BYTES),
    })
}

/// A cache of compiled kernels that begins with what was kept. It only saves time: a damaged file is ignored,
/// and the null handle means no cache.
fn pipeline_cache(device: &ash::Device, kept: &[u8]) -> vk::PipelineCache {
    let with = vk::PipelineCacheCreateInfo::default().initial_data(kept);
    let without = vk::PipelineCacheCreateInfo::default();
    // SAFETY: the device is alive; the driver checks the data's header and ignores foreign data.
    unsafe {
        let made = device.create_pipeline_cache(&with, None);
        made.or_else(|_| device.create_pipeline_cache(&without, None)).unwrap_or_default()
    }
}

impl Shared {
    fn new(instance: Instance, candidate: Candidate, options: &DeviceOptions) -> Result<Self> {
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(candidate.queue_family)
            .queue_priorities(&priorities)];
        // SAFETY: the handle comes from this instance; the call only reads.
        let extensions = unsafe { instance.raw.enumerate_device_extension_properties(candidate.handle) }
            .map_err(|e| vk_error("listing the device extensions", e))?;
        let subset = khr::portability_subset::NAME;
        let mut enabled = Vec::new();
        let has = |name| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        if has(subset) {
            // Vulkan requires this one to be enabled where it exists (MoltenVK).
            enabled.push(subset.as_ptr());
        }
        let mut features = vk::PhysicalDeviceVulkan12Features::default().subgroup_broadcast_dynamic_id(true);
        let mut telling = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
            .pipeline_executable_info(true);
        let statistics = khr::pipeline_executable_properties::NAME;
        let tells = options.statistics && has(statistics);
        if tells {
            enabled.push(statistics.as_ptr());
            features.p_next = (&raw mut telling).cast();
        }
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&enabled)
            .push_next(&mut features);
        // SAFETY: all pointers in `info` outlive the call.
        let raw = unsafe { instance.raw.create_device(candidate.handle, &info, None) }
            .map_err(|e| vk_error(&format!("opening device '{}'", candidate.info.name), e))?;
        let allocator = allocator(&instance, &raw, candidate.handle).map_err(|e| {
            // SAFETY: nothing was made from the device yet.
            unsafe { raw.destroy_device(None) };
            Error::device(format!("preparing the device's memory failed: {e}"), "choose another `device`")
                .caused_by(e)
        })?;
        let cached = cache::load(&candidate.info, cache::PIPELINES);
        let pipeline_cache = pipeline_cache(&raw, &cached);
        let timestamp_mask = u64::MAX.checked_shr(64 - candidate.timestamp_bits).unwrap_or(0);
        let is_limited = candidate.info.kind != "cpu" || options.dispatch_threads.is_some();
        // SAFETY: the queue was asked for above.
        let queue = unsafe { raw.get_device_queue(candidate.queue_family, 0) };
        let statistics = tells.then(|| khr::pipeline_executable_properties::Device::new(&instance.raw, &raw));
        let names = instance.names_objects().then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        Ok(Self {
            queue: Mutex::new(queue),
            queue_family: candidate.queue_family,
            pipeline_cache,
            loaded_cache: cache::digest(&cached),
            timestamp_mask,
            times_all: options.timings && timestamp_mask != 0,
            rates: is_limited.then(|| Rates::new(options.dispatch_threads)),
            polish: options.polish,
            info: candidate.info,
            full_barriers: options.full_barriers,
            reads_texels: candidate.reads_texels,
            // The self-test needs little, and must not fail for want of it.
            memory_bytes: None,
            warnings: Vec::new(),
            physical: candidate.handle,
            reports_budget: has(ext::memory_budget::NAME),
            timings: Mutex::default(),
            waited_nanoseconds: AtomicU64::new(0),
            allocated_bytes: AtomicU64::new(0),
            peak_bytes: AtomicU64::new(0),
            submissions: AtomicU64::new(0),
            barriers: AtomicU64::new(0),
            names,
            statistics,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            next_id: AtomicU64::new(0),
            process: std::process::id(),
            raw,
            instance: ManuallyDrop::new(instance),
        })
    }

    /// Whether this process opened the device, and was not forked from the one that did. If not, no function
    /// of Vulkan may be called: drivers wait for threads that only the other process has.
    pub fn is_own(&self) -> bool {
        self.process == std::process::id()
    }

    /// Refuses the work of a forked process.
    pub fn require_own(&self) -> Result<()> {
        if self.is_own() { Ok(()) } else { Err(forks::foreign_device(&self.info.name)) }
    }

    /// Whether its instance is to stay until the process ends: that of the first GPU, since a driver that is
    /// unloaded may not load again. NVIDIA's needs memory for threads' own variables, of which the C library
    /// has little.
    fn keeps_driver(&self) -> bool {
        self.info.kind != "cpu" && !KEEPS_DRIVER.swap(true, Ordering::Relaxed)
    }

    /// An id that no other buffer of this device has had.
    pub fn new_id(&self) -> u64 {
        self.next_id.fetch_add(1, Ordering::Relaxed)
    }

    pub fn allocator(&self) -> MutexGuard<'_, Allocator> {
        lock(&self.allocator)
    }

    /// How long the host waits for a submission at most. On a GPU none takes minutes, because dispatches are
    /// divided by time; a CPU takes as long as it needs.
    pub fn longest_wait(&self) -> Option<Duration> {
        self.rates.as_ref().map(|_| LONGEST_WAIT)
    }

    /// The driver's budget for this program in the largest device-local heap; `u64::MAX` if it reports none,
    /// or may not be asked.
    fn budget(&self) -> u64 {
        if !self.reports_budget || !self.is_own() {
            return u64::MAX;
        }
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut memory = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
        // SAFETY: the handle comes from this instance, the device has the extension; the call only reads.
        unsafe { self.instance.raw.get_physical_device_memory_properties2(self.physical, &mut memory) };
        let heaps = memory.memory_properties;
        device_local_budget(heaps.memory_heaps_as_slice(), &budget.heap_budget)
    }

    /// Whether this many more bytes are within [`DeviceOptions::memory_bytes`].
    pub fn may_allocate(&self, bytes: u64) -> bool {
        let now = self.allocated_bytes.load(Ordering::Relaxed);
        self.memory_bytes.is_none_or(|most| now.saturating_add(bytes) <= most)
    }

    pub fn count_waited(&self, time: Duration) {
        self.waited_nanoseconds.fetch_add(time.as_nanos() as u64, Ordering::Relaxed);
    }

    pub fn count_allocated(&self, bytes: u64) {
        let now = self.allocated_bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.peak_bytes.fetch_max(now, Ordering::Relaxed);
    }

    pub fn count_freed(&self, bytes: u64) {
        self.allocated_bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Names an object for validation messages and debuggers; does nothing without validation.
    pub fn name_object<H: vk::Handle>(&self, handle: H, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, std::ffi::CString::new(name)) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is alive and belongs to this device. A failure only leaves the object unnamed.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }
}

/// The budget of the largest device-local heap.
fn device_local_budget(heaps: &[vk::MemoryHeap], budgets: &[u64]) -> u64 {
    let device_local =
        heaps.iter().zip(budgets).filter(|(heap, _)| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    let largest = device_local.max_by_key(|(heap, _)| heap.size).map_or(0, |(_, budget)| *budget);
    // Some drivers report 0 for an unknown budget.
    if largest == 0 { u64::MAX } else { largest }
}

impl Drop for Shared {
    fn drop(&mut self) {
        if !self.is_own() {
            // Allocator and instance stay, too.
            return;
        }
        // SAFETY: the last user is gone (Arc), submissions are waited for by their recorders; the allocator
        // must go before its device, the device before its instance, and neither is touched again.
        unsafe {
            if self.pipeline_cache != vk::PipelineCache::null() {
                let data = self.raw.get_pipeline_cache_data(self.pipeline_cache);
                if let Some(data) = data.ok().filter(|data| cache::digest(data) != self.loaded_cache) {
                    cache::store(&self.info, cache::PIPELINES, &data);
                }
                self.raw.destroy_pipeline_cache(self.pipeline_cache, None);
            }
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
            if !self.keeps_driver() {
                ManuallyDrop::drop(&mut self.instance);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Recorder;

    #[test]
    fn the_budget_is_that_of_the_largest_heap_of_its_own() {
        let heap = |size, own: bool| {
            let flags = if own { vk::MemoryHeapFlags::DEVICE_LOCAL } else { vk::MemoryHeapFlags::empty() };
            vk::MemoryHeap::default().size(size).flags(flags)
        };
        let heaps = [heap(100, true), heap(900, false), heap(300, true)];
        assert_eq!(device_local_budget(&heaps, &[90, 800, 250, 7]), 250);
        assert_eq!(device_local_budget(&heaps, &[90, 800, 0, 7]), u64::MAX);
        assert_eq!(device_local_budget(&heaps[1..2], &[800]), u64::MAX);
    }

    #[test]
    fn small_meshes_are_left_to_the_host_by_a_cpu_and_with_curves() {
        assert!(pays("discrete", 100, false) && pays("discrete", 50_000, true) && pays("cpu", 50_000, true));
        assert!(!pays("discrete", 49_999, true) && !pays("cpu", 49_999, false));
    }

    /// The canary: if validation were off or its messages lost, every GPU test would pass in silence.
    #[test]
    fn a_wrong_call_is_reported() {
        let options = DeviceOptions { validation: true, ..DeviceOptions::from_env() };
        let device = Device::open(&options).unwrap();
        assert_eq!(device.take_validation_messages(), Vec::<String>::new());
        let empty = vk::BufferCreateInfo::default().size(0).usage(vk::BufferUsageFlags::STORAGE_BUFFER);
        // SAFETY: a buffer of no bytes breaks a rule of Vulkan that the validation layer reports; drivers
        // here accept or refuse it, and both are handled.
        unsafe {
            if let Ok(buffer) = device.shared.raw.create_buffer(&empty, None) {
                device.shared.raw.destroy_buffer(buffer, None);
            }
        }
        let messages = device.take_validation_messages();
        assert!(messages.iter().any(|m| m.contains("VUID-VkBufferCreateInfo-size")), "{messages:?}");
    }

    /// Synchronization validation in particular: two dispatches that write one buffer without a barrier.
    #[test]
    fn a_missing_barrier_is_reported() {
        let options = DeviceOptions { validation: true, ..DeviceOptions::from_env() };
        let device = Device::open(&options).unwrap();
        let target = crate::gpu::Buffer::<u32>::new(&device, "test.target", 64).unwrap();
        let mut recorder = Recorder::new(&device).unwrap();
        recorder.upload(&target, &[1; 64]).unwrap();
        recorder.forget_hazards();
        recorder.upload(&target, &[2; 64]).unwrap();
        recorder.submit().unwrap();
        let messages = device.take_validation_messages();
        assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-WRITE-AFTER-WRITE")), "{messages:?}");
    }
}
