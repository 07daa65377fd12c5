//! One test binary; each module says what belongs in it.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

mod cli;
mod cloud;
mod fuzzing;
mod gpu;
mod io;
mod local;
mod measure;
mod mesh;
mod options;
mod picture;
mod pipeline;
mod polish;
mod readme;
mod reference;
mod report;
mod sites;
mod stages;
mod support;
mod tables;
mod volume;
mod wrap;
