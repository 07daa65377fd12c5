//! The GPU layer: copies, order, limits, errors, and the modules themselves.

use crate::support::{assert_valid, device};
use rtfmesh::gpu::kernels::{ALL, neighbours::tile_bounds};
use rtfmesh::gpu::{Buffer, Device, DeviceOptions, Pipeline};
use rtfmesh::{Error, list_devices};
use std::io::Write;
use std::process::Command;

#[test]
fn every_module_is_valid_spirv() {
    assert!(ALL.len() >= 9, "kernels are missing");
    for kernel in ALL {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(kernel.spirv).unwrap();
        let run = Command::new("spirv-val").args(["--target-env", "vulkan1.2"]).arg(file.path()).output();
        let run = run.expect("spirv-val is missing: run ci/setup.sh");
        assert!(run.status.success(), "{}: {}", kernel.name, String::from_utf8_lossy(&run.stderr));
    }
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

#[test]
fn a_recorder_keeps_what_it_uses() {
    let device = device();
    let mut recorder = device.recorder().unwrap();
    let copy = {
        let short_lived = Buffer::from_slice(device, "test.short_lived", &[7_u32; 100_000]).unwrap();
        recorder.download(&short_lived).unwrap()
    };
    // Would take over the memory if it had been freed.
    let _other = Buffer::from_slice(device, "test.other", &[9_u32; 100_000]).unwrap();
    assert_eq!(recorder.submit().unwrap().read(&copy).unwrap(), [7; 100_000]);
    assert_valid(device);
}

#[test]
fn too_large_buffers_are_refused_by_name() {
    let error = Buffer::<u32>::new(device(), "test.too_large", 1 << 40).err().unwrap();
    assert!(matches!(&error, Error::OutOfMemory { what, .. } if what == "test.too_large"), "{error}");
    let upload_too_long = {
        let buffer = Buffer::<u32>::new(device(), "test.short", 2).unwrap();
        device().recorder().unwrap().upload(&buffer, &[1, 2, 3])
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
    let all = list_devices().unwrap();
    let usable = all.iter().find(|d| d.missing.is_empty()).expect("a usable device");
    let by_index = DeviceOptions { device: Some(usable.index.to_string()), ..Default::default() };
    assert_eq!(Device::open(&by_index).unwrap().info(), usable);
    let none = DeviceOptions { device: Some("no such device".to_owned()), ..Default::default() };
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
