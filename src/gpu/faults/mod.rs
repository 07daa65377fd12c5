//! Makes Vulkan calls fail on request; compiled for unit tests only.
//!
//! All commands are looked up through `vkGetInstanceProcAddr`, which [`hooked`] replaces, so that no other
//! code is changed and the calls of the memory allocator are included. Each command returned counts its
//! calls, and either fails as [`Plan`] says or calls the real command. [`broken`] has commands that fail
//! without saying so.

mod broken;
mod selftest;
mod tests;

use super::device::lock;
use ash::vk;
use broken::Miscompiled;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

/// Which calls fail.
#[derive(Debug, Clone, Copy)]
struct Fault {
    /// The command.
    command: &'static str,
    /// Which of its calls, from 1.
    at: u64,
    /// What it returns.
    result: vk::Result,
    /// Whether all calls of any command after it return the same. A lost device stays lost either way.
    lasting: bool,
}

/// The planned fault, and the calls so far.
#[derive(Default)]
struct Plan {
    fault: Option<Fault>,
    calls: BTreeMap<&'static str, u64>,
    failed_calls: u64,
    /// Commands that do nothing.
    left_out: &'static [&'static str],
    miscompiled: Option<Miscompiled>,
    wrong_instructions: usize,
}

impl Plan {
    /// Counts a call; returns its result if it is to fail.
    fn count_call(&mut self, command: &'static str) -> Option<vk::Result> {
        let count = self.calls.entry(command).or_default();
        *count += 1;
        let fault = self.fault?;
        let lasting =
            fault.lasting || (fault.result == vk::Result::ERROR_DEVICE_LOST && reports_device_loss(command));
        let now = fault.command == command && *count == fault.at;
        let fails = now || (self.failed_calls > 0 && lasting);
        self.failed_calls += u64::from(fails);
        fails.then_some(fault.result)
    }
}

/// The commands that fail on a lost device.
fn reports_device_loss(command: &str) -> bool {
    matches!(command, "vkQueueSubmit" | "vkWaitForFences" | "vkDeviceWaitIdle" | "vkGetQueryPoolResults")
}

static PLAN: Mutex<Plan> = Mutex::new(Plan {
    fault: None,
    calls: BTreeMap::new(),
    failed_calls: 0,
    left_out: &[],
    miscompiled: None,
    wrong_instructions: 0,
});
/// Locked by a test while it uses the plan, which all tests share.
static TURN: Mutex<()> = Mutex::new(());
/// `vkGetInstanceProcAddr` and `vkGetDeviceProcAddr`.
static INSTANCE_PROC: AtomicUsize = AtomicUsize::new(0);
static DEVICE_PROC: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static HOOKING: Cell<bool> = const { Cell::new(false) };
}

/// Runs `open`; all calls of instances created in it go through the plan.
fn with_hooks<T>(open: impl FnOnce() -> T) -> T {
    HOOKING.set(true);
    let opened = open();
    HOOKING.set(false);
    opened
}

/// Waits until no other test uses the plan, and resets it.
fn reserve_plan() -> MutexGuard<'static, ()> {
    let turn = lock(&TURN);
    *lock(&PLAN) = Plan::default();
    turn
}

/// Resets the counts and plans a fault.
fn plan_fault(fault: Option<Fault>) {
    *lock(&PLAN) = Plan { fault, ..Plan::default() };
}

/// Calls by command since the last [`plan_fault`].
fn calls() -> BTreeMap<&'static str, u64> {
    lock(&PLAN).calls.clone()
}

/// How many calls failed since the last [`plan_fault`].
fn failed_calls() -> u64 {
    lock(&PLAN).failed_calls
}

/// The same entry, or within [`with_hooks`] one whose commands go through the plan.
pub(super) fn hooked(entry: ash::Entry) -> ash::Entry {
    if !HOOKING.get() {
        return entry;
    }
    INSTANCE_PROC.store(entry.static_fn().get_instance_proc_addr as usize, Ordering::Relaxed);
    // The new entry does not own the library that it calls; this keeps it loaded.
    std::mem::forget(entry);
    // SAFETY: `instance_proc` keeps the contract of vkGetInstanceProcAddr, because it returns the same
    // function or one of the same signature.
    unsafe { ash::Entry::from_static_fn(ash::StaticFn { get_instance_proc_addr: instance_proc }) }
}

unsafe extern "system" fn instance_proc(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: `hooked` stored this function before anyone can call; the caller keeps its contract, a valid
    // name.
    let (found, name) = unsafe {
        let real: vk::PFN_vkGetInstanceProcAddr = std::mem::transmute(INSTANCE_PROC.load(Ordering::Relaxed));
        (real(instance, name), CStr::from_ptr(name))
    };
    if name == c"vkGetDeviceProcAddr" {
        DEVICE_PROC.store(found.map_or(0, |function| function as usize), Ordering::Relaxed);
        // SAFETY: both are function pointers; the caller casts this one to what the name says.
        return unsafe {
            std::mem::transmute::<vk::PFN_vkGetDeviceProcAddr, vk::PFN_vkVoidFunction>(device_proc)
        };
    }
    shim(name, found)
}

unsafe extern "system" fn device_proc(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: `instance_proc` stored this function when it gave out this one; the caller keeps its contract.
    unsafe {
        let real: vk::PFN_vkGetDeviceProcAddr = std::mem::transmute(DEVICE_PROC.load(Ordering::Relaxed));
        let name = CStr::from_ptr(name);
        broken::shim(name, shim(name, real(device, name.as_ptr())))
    }
}

type Pointer = *const c_void;

/// Commands that return a result: their names and arguments, all pointers alike. All devices are opened with
/// the same layers, so a command has one real address.
macro_rules! commands {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {
        /// The replacement for the command whose real address is `found`.
        fn shim(name: &CStr, found: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
            $(
                if name.to_bytes() == stringify!($name).as_bytes() {
                    let real = found? as usize;
                    $name::REAL.store(real, Ordering::Relaxed);
                    // SAFETY: both are function pointers; the caller casts this one to what the name says.
                    return unsafe {
                        std::mem::transmute::<$name::Command, vk::PFN_vkVoidFunction>($name::shim)
                    };
                }
            )*
            found
        }

        $(
            #[allow(non_snake_case, reason = "it is Vulkan's name")]
            mod $name {
                use super::*;

                pub type Command = unsafe extern "system" fn($($type),*) -> vk::Result;
                pub static REAL: AtomicUsize = AtomicUsize::new(0);

                pub unsafe extern "system" fn shim($($argument: $type),*) -> vk::Result {
                    let command = stringify!($name);
                    let fails = lock(&PLAN).count_call(command);
                    // A lost device does no more work, but here the real device is still working.
                    let ends = fails == Some(vk::Result::ERROR_DEVICE_LOST) && reports_device_loss(command);
                    if let (Some(result), false) = (fails, ends && command == "vkWaitForFences") {
                        return result;
                    }
                    // SAFETY: the address was stored before this function was given out; the caller keeps the
                    // command's contract.
                    let made = unsafe {
                        let real: Command = std::mem::transmute(REAL.load(Ordering::Relaxed));
                        real($($argument),*)
                    };
                    fails.unwrap_or(made)
                }
            }
        )*
    };
}

commands! {
    vkEnumerateInstanceExtensionProperties(layer: Pointer, count: Pointer, list: Pointer);
    vkEnumerateInstanceLayerProperties(count: Pointer, list: Pointer);
    vkCreateInstance(info: Pointer, allocator: Pointer, made: Pointer);
    vkCreateDebugUtilsMessengerEXT(instance: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkSetDebugUtilsObjectNameEXT(device: Pointer, info: Pointer);
    vkEnumeratePhysicalDevices(instance: Pointer, count: Pointer, list: Pointer);
    vkEnumerateDeviceExtensionProperties(device: Pointer, layer: Pointer, count: Pointer, list: Pointer);
    vkCreateDevice(physical: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkCreatePipelineCache(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkGetPipelineCacheData(device: Pointer, cache: u64, size: Pointer, data: Pointer);
    vkCreateDescriptorSetLayout(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkCreatePipelineLayout(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkCreateShaderModule(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkCreateComputePipelines(
        device: Pointer, cache: u64, count: u32, infos: Pointer, allocator: Pointer, made: Pointer
    );
    vkCreateBuffer(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkAllocateMemory(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkMapMemory(device: Pointer, memory: u64, offset: u64, size: u64, flags: u32, mapped: Pointer);
    vkBindBufferMemory(device: Pointer, buffer: u64, memory: u64, offset: u64);
    vkCreateCommandPool(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkAllocateCommandBuffers(device: Pointer, info: Pointer, made: Pointer);
    vkBeginCommandBuffer(commands: Pointer, info: Pointer);
    vkEndCommandBuffer(commands: Pointer);
    vkCreateDescriptorPool(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkAllocateDescriptorSets(device: Pointer, info: Pointer, made: Pointer);
    vkCreateQueryPool(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkGetQueryPoolResults(
        device: Pointer, pool: u64, first: u32, count: u32, bytes: usize, data: Pointer, stride: u64,
        flags: u32
    );
    vkCreateFence(device: Pointer, info: Pointer, allocator: Pointer, made: Pointer);
    vkQueueSubmit(queue: Pointer, count: u32, submits: Pointer, fence: u64);
    vkWaitForFences(device: Pointer, count: u32, fences: Pointer, all: u32, timeout: u64);
    vkDeviceWaitIdle(device: Pointer);
}
