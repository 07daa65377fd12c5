//! Repairs without remeshing.

use crate::mesh::{Arrays, NewArrays, arrays, mesh};
use crate::work::watched_work;
use numpy::PyArray1;
use pyo3::prelude::*;
use rtfmesh::cli::call::repaired;
use rtfmesh::report::to_json;

/// The repaired mesh, the face of the input that each of its faces comes from, what was repaired
/// as JSON, and in words.
type Outcome<'py> = (NewArrays<'py>, Bound<'py, PyArray1<u32>>, String, Vec<String>);

/// Repairs a mesh with the command line's options.
#[pyfunction]
pub fn repair<'py>(py: Python<'py>, given: Arrays<'py>, options: Vec<String>) -> PyResult<Outcome<'py>> {
    let own = mesh(&given)?;
    let (repaired, counts) = watched_work(py, move |progress| {
        let repaired = repaired(&own, &options, progress)?;
        let counts = to_json(&repaired.counts)?;
        Ok((repaired, counts))
    })?;
    let notes = repaired.counts.notes();
    Ok((arrays(py, repaired.mesh)?, PyArray1::from_vec(py, repaired.origin), counts, notes))
}
