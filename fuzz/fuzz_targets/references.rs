//! `tests/fuzzing/references.rs` under libFuzzer.

#![no_main]

#[path = "../../tests/fuzzing/references.rs"]
mod references;

libfuzzer_sys::fuzz_target!(|data: &[u8]| references::check(data));
