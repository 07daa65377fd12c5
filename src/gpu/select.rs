//! Lists the devices, checks which are usable, and chooses one.

use super::device::Device;
use super::errors::INSTALL_DRIVER;
use super::forks;
use super::instance::{Instance, open_all};
use super::options::DeviceOptions;
use super::selftest::{SelfTest, verdict};
use crate::{Error, Result};
use ash::{ext, vk};
use serde::Serialize;

/// The limits that the kernels depend on, in bytes or counts.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Limits {
    /// Maximum size of a storage buffer.
    pub storage_buffer_bytes: u64,
    /// Shared memory of a workgroup.
    pub shared_memory_bytes: u32,
    /// Push constants.
    pub push_constant_bytes: u32,
    /// Storage buffers of one kernel.
    pub storage_buffers: u32,
    /// Invocations of one workgroup.
    pub workgroup_invocations: u32,
    /// Workgroups of one dispatch along x.
    pub workgroups: u32,
    /// Nanoseconds per timestamp tick; 0 where the device has no timestamps.
    pub timestamp_ns: f32,
    /// Largest heap of the device's own memory.
    pub memory_bytes: u64,
    /// Number of invocations that run in lockstep (subgroup size).
    pub subgroup_size: u32,
}

impl Limits {
    /// No more than a device that this library can use may have; see
    /// [`crate::DeviceOptions::least_limits`].
    pub(super) fn least(&self) -> Self {
        Self {
            storage_buffer_bytes: self.storage_buffer_bytes.min(LEAST_STORAGE_BUFFER),
            shared_memory_bytes: self.shared_memory_bytes.min(MIN_SHARED),
            push_constant_bytes: self.push_constant_bytes.min(MIN_PUSH),
            storage_buffers: self.storage_buffers.min(MIN_BUFFERS),
            workgroup_invocations: self.workgroup_invocations.min(MIN_INVOCATIONS),
            workgroups: self.workgroups.min(LEAST_WORKGROUPS),
            timestamp_ns: 0.0,
            ..*self
        }
    }
}

/// One Vulkan device of this machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct DeviceInfo {
    /// Position in the list, for [`crate::DeviceOptions::device`].
    pub index: usize,
    /// The driver's name for the device.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub kind: &'static str,
    /// Driver name and version.
    pub driver: String,
    /// Vulkan version, as `1.3.230`.
    pub api: String,
    /// The limits that rtfmesh depends on.
    pub limits: Limits,
    /// The device's own number as hexadecimal digits in groups, the same in CUDA and `nvidia-smi -L`, for
    /// example `4f3f9d26-...`.
    pub uuid: String,
    /// PCI address, such as `0000:41:00.0`; `None` for a CPU or if the driver does not report it.
    pub pci: Option<String>,
    /// What the device lacks; empty if it can be used.
    pub missing: Vec<String>,
    /// Whether its driver computes what it should. A device that fails is only used if it is named.
    pub self_test: SelfTest,
}

/// The last major version of lavapipe's Mesa on which kernels read vectors from texel buffers.
const TEXEL_MESA: u32 = 22;
/// Bytes of a vector of two numbers.
const SMALLEST_TEXEL: u64 = 8;
/// Windows of buffers begin at multiples of this many bytes.
const WINDOW_ALIGNMENT: u64 = 256;

/// A device together with its handle.
pub(super) struct Candidate {
    /// Which of the instances has it.
    pub instance: usize,
    pub handle: vk::PhysicalDevice,
    pub queue_family: u32,
    pub timestamp_bits: u32,
    /// Whether kernels read vectors from texel buffers; see [`super::KernelInfo::texel_spirv`].
    pub reads_texels: bool,
    /// See [`verdict::identity`].
    pub identity: u64,
    pub info: DeviceInfo,
}

const MIN_SHARED: u32 = 16 << 10;
const MIN_PUSH: u32 = 128;
const MIN_BUFFERS: u32 = 8;
const MIN_INVOCATIONS: u32 = 128;
/// Limits that Vulkan guarantees, and with which anything runs.
const LEAST_STORAGE_BUFFER: u64 = 128 << 20;
const LEAST_WORKGROUPS: u32 = 65535;

/// Lists the Vulkan devices of this machine in the loader's order. Without a loader, or where it finds none,
/// they are those of the drivers whose manifests are where a loader would look for them. None is opened, so
/// [`DeviceInfo::self_test`] is what earlier runs have found.
///
/// # Errors
/// [`Error::Device`] without any Vulkan driver. Drivers without devices give an empty list.
pub fn list_devices() -> Result<Vec<DeviceInfo>> {
    Ok(candidates(&open_all(false)?)?.into_iter().map(|c| c.info).collect())
}

/// Like [`list_devices`], and runs the self-test of all usable devices that have not been tested.
///
/// # Errors
/// As [`list_devices`].
pub fn tested_devices() -> Result<Vec<DeviceInfo>> {
    let mut list = list_devices()?;
    let is_open = |info: &&mut DeviceInfo| info.missing.is_empty() && info.self_test == SelfTest::Untested;
    for info in list.iter_mut().filter(is_open) {
        let options = DeviceOptions::default().device(Some(info.index.to_string()));
        info.self_test = match Device::open(&options) {
            Ok(device) => device.info().self_test.clone(),
            Err(error) => SelfTest::Failed(error.to_string()),
        };
    }
    Ok(list)
}

pub(super) fn candidates(instances: &[Instance]) -> Result<Vec<Candidate>> {
    let mut all = Vec::new();
    for (k, instance) in instances.iter().enumerate() {
        for handle in instance.physical_devices()? {
            let found = inspect_device(instance, all.len(), handle);
            all.push(Candidate { instance: k, ..found });
        }
    }
    forks::remember(all.iter().any(|candidate| candidate.info.kind != "cpu"));
    Ok(all)
}

/// Chooses the device that `wanted` names as [`crate::DeviceOptions::device`] says; the beginning of a UUID
/// will do. Without a name the first usable one that does not fail the self-test, discrete before integrated
/// before virtual before CPU. Returns warnings of better devices that fail, or of the chosen one if it does.
pub(super) fn choose(mut all: Vec<Candidate>, wanted: Option<&str>) -> Result<(Candidate, Vec<String>)> {
    if all.is_empty() {
        return Err(no_device());
    }
    let names =
        all.iter().map(|c| format!("{} {}", c.info.index, c.info.name)).collect::<Vec<_>>().join(", ");
    all.retain(|c| wanted.is_none_or(|name| matches(&c.info, name)));
    all.sort_by_key(|c| preference(c.info.kind));
    let is_usable = |c: &Candidate| c.info.missing.is_empty();
    let is_good = |c: &Candidate| is_usable(c) && failure(&c.info).is_none();
    let best = all.iter().position(is_good);
    let failing: Vec<(String, &Candidate)> = all[..best.unwrap_or(all.len())]
        .iter()
        .filter(|c| is_usable(c))
        .filter_map(|c| Some((failure(&c.info)?, c)))
        .collect();
    let forced = all.iter().position(is_usable).filter(|_| wanted.is_some());
    let (best, warnings) = match (best, forced, failing.first()) {
        (Some(best), ..) => {
            let left_out = failing.iter().map(|(text, c)| {
                format!("{text}, and is left out; update its driver, or use it as `device` {}", c.info.index)
            });
            (best, left_out.collect())
        }
        (None, Some(forced), Some((text, _))) => {
            (forced, vec![format!("{text}; do not trust the result, and update the driver")])
        }
        (None, _, Some((text, c))) => {
            let remedy =
                format!("update its driver, or use it in spite of that as `device` {}", c.info.index);
            return Err(Error::device(text.clone(), remedy));
        }
        (None, _, None) => {
            return Err(match (all.first(), wanted) {
                (Some(c), _) => Error::device(
                    format!("device '{}' cannot be used: {}", c.info.name, c.info.missing.join(", ")),
                    format!("see `rtfmesh devices`, or {INSTALL_DRIVER}"),
                ),
                (None, Some(wanted)) => {
                    Error::device(format!("no device matches '{wanted}'"), format!("there are: {names}"))
                }
                (None, None) => no_device(),
            });
        }
    };
    Ok((all.swap_remove(best), warnings))
}

/// That a device fails the self-test, if it does.
fn failure(info: &DeviceInfo) -> Option<String> {
    let SelfTest::Failed(what) = &info.self_test else { return None };
    Some(format!("device '{}' (driver {}) fails the self-test: {what}", info.name, info.driver.trim()))
}

/// The error where there is no device at all.
pub(crate) fn no_device() -> Error {
    Error::device("there is no Vulkan driver for any device of this machine", INSTALL_DRIVER)
}

fn matches(info: &DeviceInfo, wanted: &str) -> bool {
    let wanted = wanted.to_lowercase();
    if let Some(uuid) = wanted.strip_prefix("uuid:") {
        // As `nvidia-smi -L` writes it.
        let uuid = uuid.strip_prefix("gpu-").unwrap_or(uuid);
        return !uuid.is_empty() && info.uuid.starts_with(uuid);
    }
    if let Some(pci) = wanted.strip_prefix("pci:") {
        return !pci.is_empty() && info.pci.as_ref().is_some_and(|own| is_pci_address(own, pci));
    }
    match (wanted.parse::<usize>(), wanted.as_str()) {
        (Ok(index), _) => info.index == index,
        (_, "cpu") => info.kind == "cpu",
        (_, "gpu") => info.kind != "cpu",
        (_, part) => info.name.to_lowercase().contains(part),
    }
}

/// Whether an address is this one: also without the domain, or with a domain of eight digits as nvidia-smi
/// writes it.
fn is_pci_address(own: &str, wanted: &str) -> bool {
    let parts = |address: &str| -> Vec<Option<u32>> {
        address.split([':', '.']).map(|part| u32::from_str_radix(part, 16).ok()).collect()
    };
    let (own, wanted) = (parts(own), parts(wanted));
    wanted == own || (own[0] == Some(0) && wanted == own[1..])
}

fn preference(kind: &str) -> usize {
    ["discrete", "integrated", "virtual", "cpu"].iter().position(|k| *k == kind).unwrap_or(4)
}

fn inspect_device(instance: &Instance, index: usize, handle: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut ids = vk::PhysicalDeviceIDProperties::default();
    let mut bus = vk::PhysicalDevicePCIBusInfoPropertiesEXT::default();
    let mut all = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut driver)
        .push_next(&mut subgroup)
        .push_next(&mut ids);
    // SAFETY: the handle comes from this instance; the calls only read.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(handle) };
    let has_bus = extensions
        .is_ok_and(|all| all.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::pci_bus_info::NAME)));
    if has_bus {
        all = all.push_next(&mut bus);
    }
    // SAFETY: as above.
    let (memory, families) = unsafe {
        instance.raw.get_physical_device_properties2(handle, &mut all);
        (
            instance.raw.get_physical_device_memory_properties(handle),
            instance.raw.get_physical_device_queue_family_properties(handle),
        )
    };
    let p = all.properties;
    let family = families.iter().position(|f| f.queue_flags.contains(vk::QueueFlags::COMPUTE));
    let timestamp_bits = family.map_or(0, |f| families[f].timestamp_valid_bits);
    let limits = limits_of(&p.limits, &memory, timestamp_bits, subgroup.subgroup_size);
    let mut missing = missing_features(p.api_version, &limits, family.is_some());
    if p.api_version >= vk::API_VERSION_1_2 && !broadcasts_any_lane(instance, handle) {
        missing.push("subgroupBroadcastDynamicId".to_owned());
    }
    // The kernel of the neighbour lists uses ballots within a subgroup.
    let votes = vk::SubgroupFeatureFlags::BASIC | vk::SubgroupFeatureFlags::BALLOT;
    if !subgroup.supported_operations.contains(votes)
        || !subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
    {
        missing.push("subgroup ballots in compute".to_owned());
    }
    let text = |s: std::result::Result<&std::ffi::CStr, _>| {
        s.map_or_else(
            |_: std::ffi::FromBytesUntilNulError| String::new(),
            |s| s.to_string_lossy().into_owned(),
        )
    };
    let info = DeviceInfo {
        index,
        name: text(p.device_name_as_c_str()),
        kind: match p.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            vk::PhysicalDeviceType::CPU => "cpu",
            _ => "other",
        },
        driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
        api: version_text(p.api_version),
        uuid: uuid_text(ids.device_uuid),
        pci: has_bus.then(|| {
            let [domain, bus, device, function] =
                [bus.pci_domain, bus.pci_bus, bus.pci_device, bus.pci_function];
            format!("{domain:04x}:{bus:02x}:{device:02x}.{function:x}")
        }),
        missing,
        limits,
        self_test: SelfTest::Untested,
    };
    // Old versions of lavapipe load a vector of a storage buffer number by number and lane by lane, but a
    // texel at once (docs/experiments.md). Newer ones load both otherwise, and were not measured.
    let reads_texels = driver.driver_id == vk::DriverId::MESA_LLVMPIPE
        && vk::api_version_major(p.driver_version) <= TEXEL_MESA
        && u64::from(p.limits.max_texel_buffer_elements) >= info.limits.storage_buffer_bytes / SMALLEST_TEXEL
        && p.limits.min_texel_buffer_offset_alignment <= WINDOW_ALIGNMENT;
    let queue_family = family.unwrap_or(0) as u32;
    let identity =
        verdict::identity(&info, (p.driver_version, p.pipeline_cache_uuid, ids.driver_uuid, reads_texels));
    let info = DeviceInfo { self_test: verdict::load(&info, identity), ..info };
    Candidate { instance: 0, handle, queue_family, timestamp_bits, reads_texels, identity, info }
}

/// Whether a lane that is not known before the shader runs may be broadcast to its subgroup, as the kernel of
/// the neighbour lists does.
fn broadcasts_any_lane(instance: &Instance, handle: vk::PhysicalDevice) -> bool {
    let mut vulkan_1_2 = vk::PhysicalDeviceVulkan12Features::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan_1_2);
    // SAFETY: the handle comes from this instance, the device has Vulkan 1.2; the call only reads.
    unsafe { instance.raw.get_physical_device_features2(handle, &mut all) };
    vulkan_1_2.subgroup_broadcast_dynamic_id == vk::TRUE
}

fn limits_of(
    limits: &vk::PhysicalDeviceLimits,
    memory: &vk::PhysicalDeviceMemoryProperties,
    timestamp_bits: u32,
    subgroup_size: u32,
) -> Limits {
    Limits {
        storage_buffer_bytes: limits.max_storage_buffer_range.into(),
        shared_memory_bytes: limits.max_compute_shared_memory_size,
        push_constant_bytes: limits.max_push_constants_size,
        storage_buffers: limits.max_per_stage_descriptor_storage_buffers,
        workgroup_invocations: limits
            .max_compute_work_group_invocations
            .min(limits.max_compute_work_group_size[0]),
        workgroups: limits.max_compute_work_group_count[0],
        timestamp_ns: if timestamp_bits == 0 { 0.0 } else { limits.timestamp_period },
        memory_bytes: memory
            .memory_heaps_as_slice()
            .iter()
            .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|h| h.size)
            .max()
            .unwrap_or(0),
        subgroup_size,
    }
}

/// In groups of 8, 4, 4, 4 and 12 digits.
fn uuid_text(bytes: [u8; vk::UUID_SIZE]) -> String {
    let mut text = String::with_capacity(36);
    for (k, byte) in bytes.iter().enumerate() {
        if [4, 6, 8, 10].contains(&k) {
            text.push('-');
        }
        text += &format!("{byte:02x}");
    }
    text
}

pub(super) fn version_text(v: u32) -> String {
    format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v))
}

fn missing_features(api: u32, limits: &Limits, compute: bool) -> Vec<String> {
    let mut list = Vec::new();
    if api < vk::API_VERSION_1_2 {
        list.push(format!("Vulkan 1.2 (it has {})", version_text(api)));
    }
    if !compute {
        list.push("a compute queue".to_owned());
    }
    let checks = [
        ("bytes of shared memory", limits.shared_memory_bytes, MIN_SHARED),
        ("bytes of push constants", limits.push_constant_bytes, MIN_PUSH),
        ("storage buffers per kernel", limits.storage_buffers, MIN_BUFFERS),
        ("invocations per workgroup", limits.workgroup_invocations, MIN_INVOCATIONS),
    ];
    list.extend(
        checks
            .iter()
            .filter(|(_, has, min)| has < min)
            .map(|(what, has, min)| format!("{min} {what} (it has {has})")),
    );
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fake(index: usize, name: &str, kind: &'static str, missing: &[&str]) -> Candidate {
        let limits = Limits {
            storage_buffer_bytes: 1 << 27,
            shared_memory_bytes: 1 << 15,
            push_constant_bytes: 128,
            storage_buffers: 8,
            workgroup_invocations: 128,
            workgroups: 65535,
            timestamp_ns: 1.0,
            memory_bytes: 1 << 30,
            subgroup_size: 8,
        };
        let info = DeviceInfo {
            index,
            name: name.to_owned(),
            kind,
            driver: String::new(),
            api: String::new(),
            limits,
            uuid: uuid_text([index as u8 + 0xa0; vk::UUID_SIZE]),
            pci: (kind != "cpu").then(|| format!("0000:4{index}:00.0")),
            missing: missing.iter().map(|m| (*m).to_owned()).collect(),
            self_test: SelfTest::Untested,
        };
        Candidate {
            instance: 0,
            handle: vk::PhysicalDevice::null(),
            queue_family: 0,
            timestamp_bits: 64,
            reads_texels: false,
            identity: 0,
            info,
        }
    }

    fn three() -> Vec<Candidate> {
        vec![
            fake(0, "llvmpipe", "cpu", &[]),
            fake(1, "Integrated One", "integrated", &[]),
            fake(2, "Old Discrete", "discrete", &["Vulkan 1.2"]),
        ]
    }

    fn chosen(wanted: Option<&str>) -> Result<usize> {
        choose(three(), wanted).map(|(c, _)| c.info.index)
    }

    #[test]
    fn the_best_usable_device_is_taken() {
        assert_eq!(chosen(None), Ok(1));
        assert_eq!(chosen(Some("cpu")), Ok(0));
        assert_eq!(chosen(Some("gpu")), Ok(1));
        assert_eq!(chosen(Some("0")), Ok(0));
        assert_eq!(chosen(Some("INTEGRATED")), Ok(1));
    }

    #[test]
    fn devices_are_found_by_uuid_and_pci_address() {
        assert_eq!(three()[0].info.uuid, "a0a0a0a0-a0a0-a0a0-a0a0-a0a0a0a0a0a0");
        assert_eq!(chosen(Some("uuid:A1A1a1a1-a1a1")), Ok(1));
        assert_eq!(chosen(Some("uuid:GPU-a1a1a1a1-a1a1-a1a1-a1a1-a1a1a1a1a1a1")), Ok(1));
        assert_eq!(chosen(Some("uuid:a0")), Ok(0));
        for address in ["pci:0000:41:00.0", "pci:00000000:41:00.0", "pci:41:00.0", "PCI:41:0.0"] {
            assert_eq!(chosen(Some(address)), Ok(1), "{address}");
        }
        for none in ["uuid:", "uuid:ff", "pci:", "pci:41:00.1", "pci:1:41:00.0", "pci:x", "pci:41"] {
            assert!(chosen(Some(none)).unwrap_err().to_string().contains("no device matches"), "{none}");
        }
    }

    #[test]
    fn a_device_that_cannot_be_chosen_says_why() {
        let text = |wanted| chosen(Some(wanted)).unwrap_err().to_string();
        assert!(text("2").contains("Old Discrete") && text("2").contains("Vulkan 1.2"));
        assert!(text("radeon").contains("radeon") && text("radeon").contains("llvmpipe"));
        assert!(choose(Vec::new(), None).is_err());
    }

    /// The device chosen where these fail the self-test, with the warnings.
    fn chosen_unless(failing: &[usize], wanted: Option<&str>) -> Result<(usize, Vec<String>)> {
        let mut all = three();
        for &index in failing {
            all[index].info.self_test = SelfTest::Failed("kernel selftest.loops".to_owned());
        }
        choose(all, wanted).map(|(c, warnings)| (c.info.index, warnings))
    }

    #[test]
    fn a_device_that_fails_the_self_test_is_left_out_unless_it_is_named() {
        assert_eq!(chosen_unless(&[0], None), Ok((1, Vec::new())));
        let (index, warnings) = chosen_unless(&[1], None).unwrap();
        assert!(index == 0 && warnings.len() == 1, "{warnings:?}");
        for part in ["Integrated One", "selftest.loops", "left out", "`device` 1"] {
            assert!(warnings[0].contains(part), "{warnings:?}");
        }
        // The CPU is usable, too, but not meant.
        for wanted in ["1", "gpu"] {
            let (index, warnings) = chosen_unless(&[1], Some(wanted)).unwrap();
            assert!(
                index == 1 && warnings.len() == 1 && warnings[0].contains("do not trust"),
                "{warnings:?}"
            );
        }
        let error = chosen_unless(&[0, 1], None).unwrap_err().to_string();
        assert!(error.contains("Integrated One") && error.contains("`device` 1"), "{error}");
        // What cannot be used is not forced.
        assert!(chosen_unless(&[2], Some("2")).unwrap_err().to_string().contains("Vulkan 1.2"));
    }

    #[test]
    fn too_small_limits_are_named() {
        let mut limits = three().remove(0).info.limits;
        assert!(missing_features(vk::API_VERSION_1_2, &limits, true).is_empty());
        limits.shared_memory_bytes = 8 << 10;
        assert!(missing_features(vk::API_VERSION_1_2, &limits, true)[0].contains("shared memory"));
        assert!(missing_features(vk::API_VERSION_1_1, &limits, false).len() == 3);
    }
}
