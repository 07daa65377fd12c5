//! What is sent in one submission, and in how many a run is sent.

use crate::support::assert_valid;
use rtfmesh::gpu::{Buffer, Recorder};
use rtfmesh::mesh::samples::sample;
use rtfmesh::{Device, DeviceOptions, MeasureDepth, Options, remesh};

fn fresh() -> Device {
    Device::open(&DeviceOptions::from_env().validation(true)).unwrap()
}

#[test]
fn uploads_and_fills_ride_in_the_next_submission() {
    let device = fresh();
    let before = device.sent_work().submissions;
    let numbers: Vec<u32> = (0..1000).collect();
    let uploaded = Buffer::from_slice(&device, "test.uploaded", &numbers).unwrap();
    let zeros = Buffer::<u32>::zeros(&device, "test.zeros", 77).unwrap();
    let both = Buffer::from_slice(&device, "test.both", &[5_u32; 8]).unwrap();
    both.write(&device, &[6; 3]).unwrap();
    assert_eq!(device.sent_work().submissions, before);
    // Recorded ahead of an upload that waits, and run after it.
    let mut recorder = Recorder::new(&device).unwrap();
    let copies = [&uploaded, &zeros, &both].map(|buffer| recorder.download(buffer).unwrap());
    both.write(&device, &[7]).unwrap();
    let done = recorder.submit().unwrap();
    let read = copies.map(|copy| done.read(&copy).unwrap());
    assert_eq!(read, [numbers, vec![0; 77], vec![7, 6, 6, 5, 5, 5, 5, 5]]);
    assert_eq!(device.sent_work().submissions, before + 1);
    assert!(both.write(&device, &[0; 9]).is_err(), "does not fit");
    assert_valid(&device);
}

/// Of several threads, each may send what another one has uploaded, and each must find its own.
#[test]
fn nothing_is_lost_between_threads_or_with_a_recorder_that_is_dropped() {
    let device = &fresh();
    std::thread::scope(|scope| {
        for thread in 0..4_u32 {
            scope.spawn(move || {
                for round in 0..50 {
                    let values = vec![thread << 16 | round; 64 + round as usize];
                    let buffer = Buffer::from_slice(device, "test.own", &values).unwrap();
                    drop(Recorder::new(device).unwrap());
                    assert_eq!(buffer.to_vec(device).unwrap(), values);
                }
            });
        }
    });
    assert_valid(device);
}

#[test]
fn what_nobody_has_any_more_is_not_uploaded() {
    let device = fresh();
    device.take_timings();
    drop(Buffer::from_slice(&device, "test.dropped", &[1_u32; 100]).unwrap());
    drop(Buffer::<u32>::zeros(&device, "test.dropped_too", 100).unwrap());
    Recorder::new(&device).unwrap().submit().unwrap();
    assert_eq!(device.take_timings(), []);
}

#[test]
fn staging_memory_is_used_again_and_gives_way_to_buffers() {
    let device =
        Device::open(&DeviceOptions::from_env().validation(true).memory_bytes(Some(1 << 20))).unwrap();
    let values = vec![3_u32; 1 << 16];
    let buffer = Buffer::from_slice(&device, "test.first", &values).unwrap();
    assert_eq!(buffer.to_vec(&device).unwrap(), values);
    // A quarter of the limit each: the buffer, its upload and its download.
    assert_eq!(device.peak_bytes(), 3 << 18);
    buffer.write(&device, &values).unwrap();
    assert_eq!(buffer.to_vec(&device).unwrap(), values);
    assert_eq!(device.peak_bytes(), 3 << 18);
    // Also what waits is sent, and its memory freed.
    buffer.write(&device, &[4; 1 << 15]).unwrap();
    let more = Buffer::<u32>::new(&device, "test.more", 3 << 16).unwrap();
    drop(more);
    assert_eq!(buffer.to_vec(&device).unwrap()[0], 4);
    assert_valid(&device);
}

#[test]
fn a_run_is_few_submissions() {
    let device = Device::open(&DeviceOptions::from_env().polish(true)).unwrap();
    let options = Options::new(10_000).measures(MeasureDepth::Basic);
    remesh(&device, &sample("torus").unwrap(), &options).unwrap();
    // Three levels, the polish, the fit and the check are six; on a slow machine they are divided by time.
    let sent = device.sent_work();
    assert!((6..=24).contains(&sent.submissions), "{sent:?}");
}
