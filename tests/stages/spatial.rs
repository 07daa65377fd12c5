//! `spatial/*` against the host's prefix sums and stable sort.

use crate::support::{assert_valid, cloud, device, rng, rounded, upload, vec4};
use glam::{UVec2, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::spatial::{Scan, Sort, SpatialOrder};

/// Around the workgroups, around the lengths that one invocation walks along, and with several levels of
/// sums.
const SIZES: [usize; 12] = [0, 1, 15, 16, 17, 31, 32, 33, 1023, 1025, 10_000, 300_000];
const WORKGROUPS: [u32; 2] = [16, 64];

fn random(count: usize, below: u32, seed: u64) -> Vec<u32> {
    let mut rng = rng(seed);
    (0..count).map(|_| if below == 0 { rng.random() } else { rng.random_range(0..below) }).collect()
}

#[test]
fn scans_are_exclusive_sums() {
    let device = device();
    for workgroup in WORKGROUPS {
        for size in SIZES {
            // Large values wrap around.
            for below in [3, 0] {
                let values = random(size, below, size as u64);
                let buffer = Buffer::from_slice(device, "test.values", &values).unwrap();
                let scan = Scan::new(device, size, Some(workgroup)).unwrap();
                let mut recorder = Recorder::new(device).unwrap();
                scan.record(&mut recorder, &buffer).unwrap();
                recorder.submit().unwrap();
                let mut sum = 0_u32;
                let want: Vec<u32> = values
                    .iter()
                    .map(|v| {
                        let before = sum;
                        sum = sum.wrapping_add(*v);
                        before
                    })
                    .collect();
                assert_eq!(buffer.to_vec(device).unwrap(), want, "{size} values");
                assert_eq!(scan.total().to_vec(device).unwrap(), [sum], "{size} values");
            }
        }
    }
    assert_valid(device);
}

fn assert_sorts(keys: Vec<u32>, bits: u32, workgroup: u32) {
    let device = device();
    let sort = Sort::new(device, keys.len(), bits, Some(workgroup)).unwrap();
    let values: Vec<u32> = (0..keys.len() as u32).map(|i| i ^ 0x5555_5555).collect();
    let mut recorder = Recorder::new(device).unwrap();
    recorder.upload(&sort.keys, &keys).unwrap();
    recorder.upload(&sort.values, &values).unwrap();
    sort.record(&mut recorder).unwrap();
    recorder.submit().unwrap();
    let mut want: Vec<UVec2> = keys.iter().zip(&values).map(|(k, v)| UVec2::new(*k, *v)).collect();
    want.sort_by_key(|p| p.x);
    let (keys, values) = (sort.keys.to_vec(device).unwrap(), sort.values.to_vec(device).unwrap());
    let got: Vec<UVec2> = keys.iter().zip(&values).map(|(k, v)| UVec2::new(*k, *v)).collect();
    assert!(got == want, "{} keys of {bits} bits", want.len());
    assert_valid(device);
}

#[test]
fn random_keys_are_sorted_and_ties_keep_their_order() {
    for workgroup in WORKGROUPS {
        for size in SIZES {
            assert_sorts(random(size, 0, 7), 32, workgroup);
            // Many ties, and an odd number of digits.
            assert_sorts(random(size, 500, 8), 9, workgroup);
        }
    }
}

#[test]
fn special_orders_are_sorted() {
    for size in [33, 10_000] {
        let rising: Vec<u32> = (0..size).map(|i| i * 300_000).collect();
        assert_sorts(vec![u32::MAX; size as usize], 32, 64);
        assert_sorts(vec![0; size as usize], 32, 64);
        assert_sorts(rising.iter().rev().copied().collect(), 32, 64);
        assert_sorts(rising, 32, 64);
    }
}

/// The code by interleaving bit by bit.
fn morton(p: Vec4) -> u32 {
    let cell = |x: f32| ((x + 0.51) * (1024.0 / 1.02)).clamp(0.0, 1023.0) as u32;
    let axes = [cell(p.x), cell(p.y), cell(p.z)];
    (0..30).map(|b| (axes[b % 3] >> (b / 3) & 1) << b).sum()
}

#[test]
fn spatial_order_is_that_of_the_codes() {
    let device = device();
    for size in [0, 1, 63, 64, 65, 3000] {
        // Reaches beyond the cube on purpose.
        let points = rounded(&cloud(size, 1.1, 3));
        let buffer = upload("test.points", &points);
        let (points, order) = (vec4(&points), SpatialOrder::new(device, size).unwrap());
        let marks: Vec<u32> = (0..size as u32).map(|i| 3 * i + 1).collect();
        let marks_buffer = Buffer::from_slice(device, "test.marks", &marks).unwrap();
        let sorted = Buffer::<Vec4>::new(device, "test.sorted", size).unwrap();
        let sorted_marks = Buffer::<u32>::new(device, "test.sorted_marks", size).unwrap();
        let mut recorder = Recorder::new(device).unwrap();
        order.record(&mut recorder, &buffer).unwrap();
        order.record_vectors(&mut recorder, &buffer, &sorted).unwrap();
        order.record_indices(&mut recorder, &marks_buffer, &sorted_marks).unwrap();
        recorder.submit().unwrap();
        // A coordinate may round to the other side of a cell's wall; the order is that of the device's own
        // codes.
        let codes = order.codes().to_vec(device).unwrap();
        let got = order.order().to_vec(device).unwrap();
        let differing =
            got.iter().zip(&codes).filter(|(i, code)| morton(points[**i as usize]) != **code).count();
        assert!(differing <= size / 500, "{differing} codes of {size} differ");
        assert!(got.iter().zip(&codes).is_sorted_by_key(|(i, code)| (*code, *i)));
        let mut all = got.clone();
        all.sort_unstable();
        assert_eq!(all, (0..size as u32).collect::<Vec<_>>());
        let pick = |i: &u32| points[*i as usize];
        assert_eq!(sorted.to_vec(device).unwrap(), got.iter().map(pick).collect::<Vec<_>>());
        let pick = |i: &u32| marks[*i as usize];
        assert_eq!(sorted_marks.to_vec(device).unwrap(), got.iter().map(pick).collect::<Vec<_>>());
    }
    assert_valid(device);
}
