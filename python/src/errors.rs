//! The library's errors as exceptions.

use pyo3::prelude::*;
use pyo3::types::PyString;
use rtfmesh::Error;

/// The exception for an error: which class and with which words, `rtfmesh._errors` knows.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let (kind, field) = match error {
        Error::Usage { field, .. } => ("usage", *field),
        Error::Input { .. } => ("input", None),
        Error::Output { .. } => ("output", None),
        Error::Device { .. } | Error::DeviceLost(_) => ("device", None),
        Error::OutOfMemory { .. } => ("memory", None),
        Error::Cancelled => ("cancelled", None),
        _ => ("internal", None),
    };
    let made = py
        .import("rtfmesh._errors")
        .and_then(|errors| errors.call_method1("exception", (kind, field, error.to_string())));
    made.map_or_else(|failed| failed, PyErr::from_value)
}

/// A word that has one of these values.
///
/// # Errors
/// `InputError` that names the argument and the values.
pub fn one_of<T: Copy>(word: &Bound<'_, PyString>, argument: &str, values: &[(&str, T)]) -> PyResult<T> {
    let text = word.to_cow()?;
    if let Some((_, value)) = values.iter().find(|(name, _)| *name == text) {
        return Ok(*value);
    }
    let names: Vec<&str> = values.iter().map(|(name, _)| *name).collect();
    let error =
        Error::usage(format!("`{argument}` '{text}' is unknown"), format!("use {}", names.join(", ")));
    Err(exception(word.py(), &error))
}
