//! `tests/fuzzing/reading.rs` under libFuzzer.

#![no_main]

#[path = "../../tests/fuzzing/reading.rs"]
mod reading;

libfuzzer_sys::fuzz_target!(|data: &[u8]| reading::check(data));
