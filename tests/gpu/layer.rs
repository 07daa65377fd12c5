//! The GPU layer: copies, order of commands, limits, errors, and the SPIR-V modules.

use crate::support::{assert_valid, device};
use glam::UVec4;
use rtfmesh::gpu::kernels::ALL;
use rtfmesh::gpu::kernels::neighbours::tile_bounds;
use rtfmesh::gpu::kernels::spatial::gather_indices;
use rtfmesh::gpu::{Buffer, Device, DeviceOptions, Pipeline, Recorder, Threads};
use rtfmesh::{Error, list_devices};
use std::io::Write;
use std::process::Command;

#[test]
fn every_module_is_valid_spirv() {
    assert!(ALL.len() >= 9, "kernels are missing");
    let modules = ALL.iter().flat_map(|kernel| [(kernel, kernel.spirv), (kernel, kernel.texel_spirv)]);
    for (kernel, spirv) in modules.filter(|(_, spirv)| !spirv.is_empty()) {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(spirv).unwrap();
        let run = Command::new("spirv-val").args(["--target-env", "vulkan1.2"]).arg(file.path()).output();
        let run = run.expect("spirv-val is missing: run ci/setup.sh");
        assert!(run.status.success(), "{}: {}", kernel.name, String::from_utf8_lossy(&run.stderr));
    }
}

/// 64-bit numbers, and subgroup operations but ballots and broadcasts, are not everywhere.
#[test]
fn modules_need_no_rare_capability() {
    let modules = ALL.iter().flat_map(|kernel| [(kernel, kernel.spirv), (kernel, kernel.texel_spirv)]);
    for (kernel, spirv) in modules {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(spirv);
        let mut at = 5;
        while at < words.len() {
            let (length, operation) = ((words[at] >> 16) as usize, words[at] & 0xffff);
            // OpCapability: Shader, SampledBuffer, GroupNonUniform and GroupNonUniformBallot.
            if operation == 17 {
                assert!(
                    [1, 46, 61, 64].contains(&words[at + 1]),
                    "{}: capability {}",
                    kernel.name,
                    words[at + 1]
                );
            }
            at += length;
        }
    }
}

/// As on devices that have no more than they must.
#[test]
fn least_limits_are_kept_to() {
    let device = Device::open(&DeviceOptions::from_env().least_limits(true).timings(true)).unwrap();
    let limits = &device.info().limits;
    assert_eq!((limits.shared_memory_bytes, limits.workgroup_invocations), (16 << 10, 128));
    assert_eq!((limits.storage_buffer_bytes, limits.timestamp_ns), (128 << 20, 0.0));
    let error = Buffer::<u32>::new(&device, "test.large", (32 << 20) + 1).err().unwrap();
    assert!(error.to_string().contains("test.large"), "{error}");
    let input = rtfmesh::mesh::samples::sample("sphere").unwrap();
    let run = |device| rtfmesh::remesh(device, &input, &rtfmesh::Options::new(300)).unwrap();
    let (least, full) = (run(&device), run(&Device::open(&DeviceOptions::from_env()).unwrap()));
    assert_eq!(least.mesh, full.mesh);
    assert!(least.summary.timings.stages.iter().all(|stage| stage.milliseconds.is_none()));
}

/// As on a GPU, where none may last long: each part comes after the one before, and knows its place.
#[test]
fn long_dispatches_are_divided() {
    let device = Device::open(&DeviceOptions::from_env().validation(true).dispatch_threads(1000)).unwrap();
    let gather =
        Pipeline::<gather_indices::Shader>::new(&device, gather_indices::Constants::default()).unwrap();
    // One part; the last part full, and with one too many; many parts.
    for len in [960, 2880, 2881, 100_000] {
        let reversed: Vec<u32> = (0..len).rev().collect();
        let order = Buffer::from_slice(&device, "test.order", &reversed).unwrap();
        let [first, second] = ["test.first", "test.second"]
            .map(|name| Buffer::<u32>::zeros(&device, name, len as usize).unwrap());
        let push = gather_indices::Push { element_count: len };
        let mut recorder = Recorder::new(&device).unwrap();
        for (source, target) in [(&order, &first), (&first, &second)] {
            let bindings = gather_indices::Bindings { order: &order, source, target };
            recorder.dispatch(&gather, Threads(len as usize), &push, &bindings).unwrap();
        }
        let copy = recorder.download(&second).unwrap();
        assert_eq!(recorder.submit().unwrap().read(&copy).unwrap(), reversed);
    }
    // Workgroups of 64, and so 15 of them.
    let calls = device.take_timings().into_iter().find(|stage| stage.name == "spatial.gather_indices");
    assert_eq!(calls.unwrap().calls, 2 * (1 + 3 + 4 + 105));
    assert_valid(&device);
}

#[test]
fn copies_come_back_as_they_were() {
    let device = device();
    for len in [0, 1, 3, 4, 1023, 70_000] {
        let values: Vec<u32> = (0..len).map(|i: u32| i.wrapping_mul(2_654_435_761)).collect();
        let buffer = Buffer::from_slice(device, "test.copy", &values).unwrap();
        assert_eq!(buffer.len(), len as usize);
        assert_eq!(buffer.to_vec(device).unwrap(), values);
    }
    assert_valid(device);
}

/// Between dispatches that write and read the same buffer. Full barriers would hide a missing one.
#[test]
fn fills_are_ordered_with_dispatches() {
    let device = device();
    let gather =
        Pipeline::<gather_indices::Shader>::new(device, gather_indices::Constants::default()).unwrap();
    for len in [1, 3, 1000] {
        let order = Buffer::from_slice(device, "test.order", &(0..len).collect::<Vec<u32>>()).unwrap();
        let source = Buffer::from_slice(device, "test.source", &vec![5_u32; len as usize]).unwrap();
        let target = Buffer::<u32>::zeros(device, "test.target", len as usize).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        let push = gather_indices::Push { element_count: len };
        let bindings = gather_indices::Bindings { order: &order, source: &source, target: &target };
        let mut copies = vec![recorder.download(&target).unwrap()];
        recorder.dispatch(&gather, Threads(len as usize), &push, &bindings).unwrap();
        copies.push(recorder.download(&target).unwrap());
        // What the dispatch wrote, then what it reads.
        recorder.fill(&target, 7).unwrap();
        copies.push(recorder.download(&target).unwrap());
        recorder.fill(&source, u32::MAX).unwrap();
        recorder.dispatch(&gather, Threads(len as usize), &push, &bindings).unwrap();
        copies.push(recorder.download(&target).unwrap());
        let done = recorder.submit().unwrap();
        let read: Vec<Vec<u32>> = copies.iter().map(|copy| done.read(copy).unwrap()).collect();
        assert_eq!(read, [0, 5, 7, u32::MAX].map(|word| vec![word; len as usize]));
    }
    let nothing = Buffer::<UVec4>::zeros(device, "test.nothing", 0).unwrap();
    assert!(nothing.to_vec(device).unwrap().is_empty());
    let vectors = Buffer::<UVec4>::zeros(device, "test.vectors", 5).unwrap();
    assert_eq!(vectors.to_vec(device).unwrap(), [UVec4::ZERO; 5]);
    assert_valid(device);
}

#[test]
fn a_recorder_keeps_what_it_uses() {
    let device = device();
    let mut recorder = Recorder::new(device).unwrap();
    let copy = {
        let short_lived = Buffer::from_slice(device, "test.short_lived", &[7_u32; 100_000]).unwrap();
        recorder.download(&short_lived).unwrap()
    };
    // Would reuse the memory if it had been freed.
    let _other = Buffer::from_slice(device, "test.other", &[9_u32; 100_000]).unwrap();
    assert_eq!(recorder.submit().unwrap().read(&copy).unwrap(), [7; 100_000]);
    assert_valid(device);
}

/// The SPIR-V default of the local size, a workgroup of one, would be several times slower.
#[test]
fn defaults_are_those_of_the_shaders() {
    use rtfmesh::gpu::kernels::face::cell;
    use rtfmesh::gpu::kernels::neighbours::knn;
    use rtfmesh::gpu::kernels::normals::plane_fit;
    use rtfmesh::gpu::kernels::step::step;
    assert_eq!(gather_indices::Constants::default().workgroup, 64);
    assert_eq!(tile_bounds::Constants::default().workgroup, 16);
    assert_eq!(knn::Constants::default(), knn::Constants { workgroup: 64, k: 32 });
    assert_eq!(cell::Constants::default().workgroup, 16);
    assert_eq!(step::Constants::default().workgroup, 64);
    assert!(plane_fit::Constants::default().workgroup > 1);
}

/// The first dispatches write, in the same submission, how many workgroups the next ones run.
#[test]
fn the_device_decides_how_many_workgroups_run() {
    let device = device();
    let gather =
        Pipeline::<gather_indices::Shader>::new(device, gather_indices::Constants::default()).unwrap();
    let order = Buffer::from_slice(device, "test.order", &(0..1000).collect::<Vec<u32>>()).unwrap();
    let source = Buffer::from_slice(device, "test.source", &[5_u32; 1000]).unwrap();
    let target = Buffer::from_slice(device, "test.target", &[0_u32; 1000]).unwrap();
    let groups = Buffer::<UVec4>::new(device, "test.groups", 2).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    let push = gather_indices::Push { element_count: 1000 };
    let bindings = gather_indices::Bindings { order: &order, source: &source, target: &target };
    let all = recorder.groups(&gather, Threads(1000));
    assert_eq!(all, UVec4::new(16, 1, 1, 0), "workgroups of 64");
    let mut copies = Vec::new();
    // All elements; none; two workgroups of 64, from the second element.
    for (first, second, at) in
        [(all, UVec4::ZERO, 0), (UVec4::ZERO, all, 0), (all, UVec4::new(2, 1, 1, 0), 1)]
    {
        recorder.upload(&target, &[0; 1000]).unwrap();
        recorder.upload(&groups, &[first, second]).unwrap();
        recorder.dispatch_indirect(&gather, &groups, at, &push, &bindings).unwrap();
        copies.push(recorder.download(&target).unwrap());
    }
    assert!(matches!(
        recorder.dispatch_indirect(&gather, &groups, 2, &push, &bindings),
        Err(Error::Internal(_))
    ));
    let done = recorder.submit().unwrap();
    let written: Vec<usize> =
        copies.iter().map(|c| done.read(c).unwrap().iter().filter(|v| **v == 5).count()).collect();
    assert_eq!(written, [1000, 0, 128]);
    assert_valid(device);
}

#[test]
fn too_large_buffers_are_refused_by_name() {
    let error = Buffer::<u32>::new(device(), "test.too_large", 1 << 40).err().unwrap();
    assert!(matches!(&error, Error::OutOfMemory { what, .. } if what == "test.too_large"), "{error}");
    let upload_too_long = {
        let buffer = Buffer::<u32>::new(device(), "test.short", 2).unwrap();
        Recorder::new(device()).unwrap().upload(&buffer, &[1, 2, 3])
    };
    assert!(matches!(upload_too_long, Err(Error::Internal(_))));
}

#[test]
fn workgroups_beyond_the_limit_are_refused() {
    for workgroup in [0, 1 << 20] {
        let made = Pipeline::<tile_bounds::Shader>::new(device(), tile_bounds::Constants { workgroup });
        assert!(matches!(made.err(), Some(Error::Device { problem, .. }) if problem.contains("tile_bounds")));
    }
}

#[test]
fn devices_are_listed_and_chosen() {
    // Its self-test has run once it has been open.
    drop(Device::open(&DeviceOptions::from_env()).unwrap());
    let all = list_devices().unwrap();
    let usable = all.iter().find(|d| d.missing.is_empty()).expect("a usable device");
    let by_index = DeviceOptions::default().device(Some(usable.index.to_string()));
    assert_eq!(Device::open(&by_index).unwrap().info(), usable);
    let none = DeviceOptions::default().device(Some("no such device".to_owned()));
    let error = Device::open(&none).err().unwrap().to_string();
    assert!(error.contains("no such device") && error.contains(&usable.name), "{error}");
}

#[test]
fn memory_in_use_is_counted() {
    let device = Device::open(&DeviceOptions::from_env()).unwrap();
    assert_eq!(device.peak_bytes(), 0);
    drop(Buffer::<u32>::new(&device, "test.first", 1000).unwrap());
    drop(Buffer::<u32>::new(&device, "test.second", 500).unwrap());
    assert_eq!(device.peak_bytes(), 4000, "the first is gone before the second comes");
}
