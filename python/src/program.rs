//! The program, for the wheel's own command.

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the program with these arguments, its own name first; returns its exit code.
#[pyfunction]
pub fn run_program(py: Python<'_>, args: Vec<OsString>) -> u8 {
    py.detach(|| rtfmesh::cli::run(args))
}
