//! `tests/fuzzing/images.rs` under libFuzzer.

#![no_main]

#[path = "../../tests/fuzzing/images.rs"]
mod images;

libfuzzer_sys::fuzz_target!(|data: &[u8]| images::check(data));
