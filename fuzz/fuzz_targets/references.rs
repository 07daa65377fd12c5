//! `tests/fuzzing/references.rs` under libFuzzer.

#![no_main]

#[path = "../../tests/fuzzing/references.rs"]
mod references;

static PLACE: std::sync::LazyLock<references::Place> = std::sync::LazyLock::new(references::Place::new);

libfuzzer_sys::fuzz_target!(|data: &[u8]| PLACE.check(data));
