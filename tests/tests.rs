//! One test binary; each module says what belongs in it.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

mod io;
mod io_bad;
mod repair;
mod samples;
