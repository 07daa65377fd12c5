//! The self-test finds drivers that compute nothing, or one thing wrong.

use super::broken::Wrong::{Function, Instruction, Nothing, Shorter, Word};
use super::broken::{Miscompiled, Wrong};
use super::tests::{assert_has_remedy, small_run};
use super::*;
use crate::gpu::kernel::{Kernel, KernelInfo};
use crate::gpu::kernels::selftest::{arithmetic, atomics, indirect, loops, shared, subgroups};
use crate::gpu::{Device, DeviceOptions, SelfTest};
use crate::mesh::samples::sample;
use crate::{Error, Result, WarningCode};

/// Opens any device that passes the self-test, which runs in any case and is not kept.
fn open() -> Result<Device> {
    let options = DeviceOptions { device: None, ..wish() };
    with_hooks(|| Device::open(&options))
}

fn wish() -> DeviceOptions {
    DeviceOptions { validation: true, self_test: Some(true), ..DeviceOptions::from_env() }
}

fn plan_broken(left_out: &'static [&'static str], miscompiled: Option<Miscompiled>) {
    *lock(&PLAN) = Plan { left_out, miscompiled, ..Plan::default() };
}

/// Why no device was opened.
#[track_caller]
fn refusal() -> String {
    match open() {
        Err(Error::Device { problem, remedy, .. }) => {
            assert!(problem.contains("fails the self-test") && problem.contains("(driver "), "{problem}");
            assert!(remedy.contains("`device`"), "{remedy}");
            problem
        }
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("it was not noticed: {:?} {:?}", lock(&PLAN).left_out, lock(&PLAN).miscompiled),
    }
}

const DISPATCHES: [&str; 3] = ["vkCmdDispatch", "vkCmdDispatchBase", "vkCmdDispatchIndirect"];

#[test]
fn a_driver_that_does_nothing_is_refused() {
    let _turn = reserve_plan();
    plan_broken(&DISPATCHES, None);
    let problem = refusal();
    for kernel in crate::gpu::selftest::KERNELS {
        assert!(problem.contains(kernel.name), "{problem}");
    }
    plan_broken(&["vkCmdCopyBuffer"], None);
    refusal();
    plan_broken(&["vkCmdDispatchIndirect"], None);
    assert!(refusal().contains("wrong results of kernel selftest.indirect ("));
    plan_broken(&[], None);
    let device = open().unwrap();
    assert_eq!((device.info().self_test.clone(), device.warnings()), (SelfTest::Passed, &[][..]));
    assert_eq!(device.take_validation_messages(), Vec::<String>::new());
}

/// The host repairs what a device does not do, so that a mesh is no proof of anything.
#[test]
fn a_device_that_is_named_is_used_with_a_warning_and_a_run_without_steps_fails() {
    let _turn = reserve_plan();
    let index = open().unwrap().info().index;
    let named = DeviceOptions { device: Some(index.to_string()), ..wish() };
    let open = || with_hooks(|| Device::open(&named)).unwrap();
    let input = sample("bumpy-sphere").unwrap();
    plan_broken(&["vkCmdDispatchIndirect"], None);
    let device = open();
    assert!(matches!(&device.info().self_test, SelfTest::Failed(what) if what.contains("selftest.indirect")));
    assert!(device.warnings().len() == 1 && device.warnings()[0].contains("do not trust"));
    plan_broken(&[], None);
    let summary = small_run(&device, &input).unwrap().summary;
    assert_eq!(summary.warning_codes.last(), Some(&WarningCode::Device));
    assert_eq!(summary.warnings.last(), device.warnings().first());
    plan_broken(&DISPATCHES, None);
    let device = open();
    let error = small_run(&device, &input).err().unwrap();
    assert!(
        matches!(&error, Error::Device { .. }) && error.to_string().contains("no vertex moved"),
        "{error}"
    );
}

/// Each instruction that a kernel is there to test, and what a compiler may confuse it with.
fn faults_of_compilers() -> Vec<(&'static KernelInfo, Vec<Wrong>)> {
    // FAdd, FSub, FMul, FDiv; IAdd, ISub, IMul, UDiv, UMod; shifts, Or, Xor, And, Not, BitCount; ConvertSToF.
    let mut of_arithmetic: Vec<Wrong> = [
        (129, 131),
        (131, 129),
        (133, 136),
        (136, 133),
        (128, 130),
        (130, 128),
        (132, 128),
        (134, 137),
        (137, 134),
        (194, 196),
        (195, 194),
        (196, 194),
        (197, 199),
        (198, 197),
        (199, 197),
        (200, 205),
        (205, 200),
        (111, 112),
    ]
    .map(|(from, to)| Instruction(from, to))
    .into();
    // Comparisons of floats, unsigned and signed integers.
    of_arithmetic.extend([(184, 186), (190, 188), (176, 172), (177, 173)].map(|(a, b)| Instruction(a, b)));
    // Square roots, FAbs and FSign, rounding, minima and maxima, FMix and FClamp, Cross, Normalize, the first
    // and last bit, pairs of 16 bits.
    let functions = [
        (31, 32),
        (32, 31),
        (4, 6),
        (6, 4),
        (8, 9),
        (9, 8),
        (37, 40),
        (40, 37),
        (38, 41),
        (41, 38),
        (46, 43),
        (43, 46),
        (68, 37),
        (69, 4),
        (73, 75),
        (75, 73),
        (56, 57),
        (60, 61),
    ];
    of_arithmetic.extend(functions.map(|(from, to)| Function(from, to)));
    let barrier = Nothing(224);
    vec![
        (arithmetic::Shader::INFO, of_arithmetic),
        (
            loops::Shader::INFO,
            vec![Instruction(199, 197), Instruction(194, 196), Instruction(172, 176), Instruction(171, 170)],
        ),
        // Broadcasts of lane 0, the count of the lanes so far, and other ballots.
        (
            subgroups::Shader::INFO,
            vec![Shorter(337, 338), Word(342, 4, 1), Instruction(171, 170), Instruction(137, 134)],
        ),
        (shared::Shader::INFO, vec![barrier, Instruction(132, 128), Instruction(198, 197)]),
        (
            atomics::Shader::INFO,
            vec![
                barrier,
                Instruction(234, 235),
                Instruction(234, 229),
                Instruction(237, 239),
                Instruction(239, 237),
                Instruction(241, 240),
                Instruction(241, 242),
            ],
        ),
        (indirect::Shader::INFO, vec![Instruction(170, 171), Instruction(132, 128), Instruction(128, 130)]),
    ]
}

#[test]
fn each_kind_of_wrong_result_is_found_by_its_kernel() {
    let _turn = reserve_plan();
    for (kernel, faults) in faults_of_compilers() {
        for wrong in faults {
            plan_broken(&[], Some(Miscompiled { kernel, wrong }));
            let problem = refusal();
            assert!(lock(&PLAN).wrong_instructions > 0, "{} has no such instruction: {wrong:?}", kernel.name);
            let (_, kernels) = problem.split_once("wrong results of ").unwrap();
            // What depends on it may fail as well, but nothing before it does.
            let first = kernels.trim_start_matches("kernels ").trim_start_matches("kernel ");
            assert!(first.starts_with(kernel.name), "{wrong:?} of {}: {problem}", kernel.name);
        }
    }
}

/// Calls that fail are no proof of a bad driver, and end in an error.
#[test]
fn a_self_test_in_which_a_call_fails_ends_in_an_error() {
    let _turn = reserve_plan();
    plan_fault(None);
    let device = open().unwrap();
    let messages = device.messages();
    let opening = calls();
    drop(device);
    assert_eq!(*lock(&messages), Vec::<String>::new());
    assert!(opening.len() >= 24, "{opening:?}");
    for (&command, &count) in &opening {
        let lost = matches!(command, "vkQueueSubmit" | "vkWaitForFences");
        let result = if lost { vk::Result::ERROR_DEVICE_LOST } else { vk::Result::ERROR_OUT_OF_HOST_MEMORY };
        let fault = Fault { command, at: count, result, lasting: false };
        plan_fault(Some(fault));
        if let Err(error) = open() {
            assert_has_remedy(&error, &fault);
        }
        assert!(failed_calls() > 0, "{fault:?}");
    }
}
