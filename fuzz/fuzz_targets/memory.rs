//! `tests/fuzzing/memory.rs` under libFuzzer.

#![no_main]

#[path = "../../tests/fuzzing/memory.rs"]
mod memory;

use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The most bytes that the job had at a time.
fn peak(job: &mut dyn FnMut()) -> usize {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    job();
    MEMORY.peak_usage().saturating_sub(before)
}

libfuzzer_sys::fuzz_target!(|data: &[u8]| memory::check(data, &peak));
