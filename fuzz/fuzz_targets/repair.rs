//! `tests/fuzzing/repairing.rs` under libFuzzer.

#![no_main]

#[path = "../../tests/fuzzing/repairing.rs"]
mod repairing;

libfuzzer_sys::fuzz_target!(|data: &[u8]| repairing::check(data));
