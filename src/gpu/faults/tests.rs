//! Every command fails once: opening and runs end in an error with a remedy, no object is leaked, and the
//! device stays usable.

use super::*;
use crate::gpu::{Device, DeviceOptions};
use crate::mesh::samples::sample;
use crate::{Error, MeasureDepth, Options, Remeshed, Result, TriMesh, remesh};

const CODES: [vk::Result; 4] = [
    vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
    vk::Result::ERROR_DEVICE_LOST,
    vk::Result::ERROR_INITIALIZATION_FAILED,
    vk::Result::ERROR_OUT_OF_HOST_MEMORY,
];

const WAITING: &str = "vkWaitForFences";
const NAMING: &str = "vkSetDebugUtilsObjectNameEXT";

fn open() -> Result<Device> {
    let options = DeviceOptions { validation: true, self_test: Some(false), ..DeviceOptions::from_env() };
    with_hooks(|| Device::open(&options))
}

pub(super) fn small_run(device: &Device, input: &TriMesh) -> Result<Remeshed> {
    let options = Options::new(60).iterations(2).measures(MeasureDepth::Basic);
    let options = options.polish_rounds(2).first_iterations(3).coarse_iterations(2);
    remesh(device, input, &options)
}

/// One line with a remedy, of a kind that fits the code.
#[track_caller]
pub(super) fn assert_has_remedy(error: &Error, fault: &Fault) {
    let line = error.to_string();
    assert!(!line.contains('\n') && line.len() < 300, "{fault:?}: {line}");
    assert!(line.contains("; ") || matches!(error, Error::DeviceLost(_)), "{fault:?}: {line}");
    match error {
        // GPUs are given up after a time.
        Error::DeviceLost(_) => {
            let codes = [vk::Result::ERROR_DEVICE_LOST, vk::Result::TIMEOUT];
            assert!(codes.contains(&fault.result), "{fault:?}: {line}");
        }
        Error::Device { .. } | Error::OutOfMemory { .. } => {}
        other => panic!("{fault:?}: {other:?}"),
    }
}

#[test]
fn a_device_that_fails_to_open_says_why() {
    let _turn = reserve_plan();
    plan_fault(None);
    let device = open().unwrap();
    let opening = calls();
    let messages = device.messages();
    drop(device);
    assert_eq!(*lock(&messages), Vec::<String>::new());
    assert!(opening.len() >= 8, "{opening:?}");
    for (&command, &count) in &opening {
        for result in CODES {
            let fault = Fault { command, at: count, result, lasting: false };
            plan_fault(Some(fault));
            match open() {
                // Compiled pipelines, names and the list of devices are done without, if need be.
                Ok(device) => {
                    let harmless = ["vkCreatePipelineCache", "vkGetPipelineCacheData", NAMING];
                    assert!(harmless.contains(&command), "{fault:?}");
                    let messages = device.messages();
                    drop(device);
                    assert_eq!(*lock(&messages), Vec::<String>::new(), "{fault:?}");
                }
                Err(error) => assert_has_remedy(&error, &fault),
            }
            assert!(failed_calls() > 0, "{fault:?}");
        }
    }
    plan_fault(None);
    assert!(open().is_ok());
}

/// Faults at the first, a middle and the last call of each command; codes take turns.
fn faults(calls: &BTreeMap<&'static str, u64>) -> Vec<Fault> {
    let mut all = Vec::new();
    for (number, (&command, &count)) in calls.iter().enumerate() {
        let mut places = vec![1, count / 2, count];
        places.retain(|at| (1..=count).contains(at));
        places.sort_unstable();
        places.dedup();
        for (k, at) in places.into_iter().enumerate() {
            // Names are given without a word to the device, which cannot be lost by that.
            let named = command == NAMING;
            let result = if named { CODES[3] } else { CODES[(number + k) % CODES.len()] };
            // A wait that fails for good has a test of its own.
            all.push(Fault { command, at, result, lasting: k == 1 && command != WAITING });
        }
    }
    // A wait that ends too early, on a CPU though nobody limits it.
    let early = Fault { command: WAITING, at: 1, result: vk::Result::TIMEOUT, lasting: false };
    all.push(early);
    all
}

#[test]
fn a_run_in_which_a_call_fails_ends_in_an_error_and_harms_no_later_run() {
    let _turn = reserve_plan();
    let input = sample("bumpy-sphere").unwrap();
    let device = open().unwrap();
    let messages = device.messages();
    plan_fault(None);
    let whole = small_run(&device, &input).unwrap();
    let compiling = calls();
    assert!(compiling.len() >= 16, "{compiling:?}");
    plan_fault(None);
    assert_eq!(small_run(&device, &input).unwrap().mesh, whole.mesh);
    let running = calls();
    let mut failed = 0;
    for fault in faults(&compiling) {
        // What the second run did not call, such as compilers, is called by a device without pipelines alone.
        let again = running.get(fault.command).is_some_and(|count| fault.at <= *count);
        let fresh = Device { pipelines: std::sync::Arc::default(), ..device.clone() };
        plan_fault(Some(fault));
        let result = small_run(if again { &device } else { &fresh }, &input);
        if failed_calls() == 0 {
            // Memory that the allocator keeps need not be asked for again, nor kept staging buffers be made.
            let rare = ["vkAllocateMemory", "vkMapMemory", "vkCreateBuffer", "vkBindBufferMemory", NAMING];
            assert!(rare.contains(&fault.command), "{fault:?}");
            continue;
        }
        if fault.command == NAMING && !fault.lasting {
            assert_eq!(result.unwrap().mesh, whole.mesh, "{fault:?}");
            continue;
        }
        assert_has_remedy(&result.err().unwrap_or_else(|| panic!("{fault:?} was not noticed")), &fault);
        assert_eq!(*lock(&messages), Vec::<String>::new(), "{fault:?}");
        failed += 1;
    }
    assert!(failed >= 32, "{failed}");
    plan_fault(None);
    assert_eq!(small_run(&device, &input).unwrap().mesh, whole.mesh);
    drop(device);
    assert_eq!(*lock(&messages), Vec::<String>::new(), "what is left when the device goes");
}

/// Memory is taken in large blocks, which a device that has run keeps; each of these is a new one.
#[test]
fn memory_that_is_refused_is_told_with_its_name() {
    let _turn = reserve_plan();
    let input = sample("bumpy-sphere").unwrap();
    for command in ["vkAllocateMemory", "vkMapMemory"] {
        for at in 1..=3 {
            let device = open().unwrap();
            let messages = device.messages();
            let fault = Fault { command, at, result: vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, lasting: false };
            plan_fault(Some(fault));
            match small_run(&device, &input) {
                // Memory for uploads is looked for on a GPU first, and then on the host.
                Ok(_) => assert!(failed_calls() == 0 || device.info().kind != "cpu", "{fault:?}"),
                Err(Error::OutOfMemory { what, bytes, .. }) => {
                    assert!(what.contains('.') && bytes > 0, "{what}")
                }
                Err(other) => panic!("{fault:?}: {other:?}"),
            }
            plan_fault(None);
            drop(device);
            assert_eq!(*lock(&messages), Vec::<String>::new(), "{fault:?}");
        }
    }
}

/// Nobody can tell then when the device is done with what it was given, so that must not be freed.
#[test]
fn what_the_device_may_still_use_stays_when_waiting_fails_for_good() {
    let _turn = reserve_plan();
    let input = sample("bumpy-sphere").unwrap();
    let device = open().unwrap();
    let messages = device.messages();
    let result = vk::Result::ERROR_OUT_OF_HOST_MEMORY;
    let fault = Fault { command: WAITING, at: 1, result, lasting: true };
    plan_fault(Some(fault));
    assert_has_remedy(&small_run(&device, &input).err().unwrap(), &fault);
    assert!(calls().contains_key("vkDeviceWaitIdle"), "{:?}", calls());
    plan_fault(None);
    assert!(small_run(&device, &input).is_ok(), "the device is as good as before");
    drop(device);
    assert_eq!(*lock(&messages), Vec::<String>::new());
}

#[test]
fn a_submission_that_does_not_end_is_told_with_the_command_that_it_runs() {
    let _turn = reserve_plan();
    // Limits dispatches, and waits for them, as on a GPU.
    let options = DeviceOptions {
        dispatch_threads: Some(1 << 20),
        timings: true,
        self_test: Some(false),
        ..DeviceOptions::from_env()
    };
    let device = with_hooks(|| Device::open(&options)).unwrap();
    plan_fault(Some(Fault { command: WAITING, at: 1, result: vk::Result::TIMEOUT, lasting: false }));
    let error = small_run(&device, &sample("bumpy-sphere").unwrap()).err().unwrap();
    let line = error.to_string();
    assert!(matches!(error, Error::DeviceLost(_)) && line.contains("did not end within 120 s"), "{line}");
    assert!(!calls().contains_key("vkDeviceWaitIdle"), "waits for what does not end");
    plan_fault(None);
}
