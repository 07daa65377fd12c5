//! Mesh files.

use crate::attributes::{self, Given, New, new};
use crate::errors::exception;
use crate::mesh::{Arrays, NewArrays, arrays, mesh};
use crate::work::{watched_work, work};
use pyo3::prelude::*;
use rtfmesh::io;
use rtfmesh::io::{Encoding, Patience, Reader, Writer};
use std::path::PathBuf;

fn encoding(py: Python<'_>, format: Option<&str>) -> PyResult<Option<Encoding>> {
    format.map(str::parse).transpose().map_err(|error| exception(py, &error))
}

/// A mesh, its attributes, and what was left out of the file or changed.
#[pyfunction]
pub fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    format: Option<&str>,
    materials: bool,
    points: bool,
) -> PyResult<(NewArrays<'py>, New<'py>, Vec<String>)> {
    let declared = encoding(py, format)?;
    let loaded = watched_work(py, |token| {
        let patience = Patience { token: token.clone(), deadline: None };
        let input = Reader::new().format(declared).materials(materials).patience(patience).read_any(&path)?;
        let loaded = if points { input.mesh_or_points() } else { input.mesh() };
        loaded.map_err(|error| error.in_file(&path))
    })?;
    let mut notes = loaded.notes;
    notes.extend(loaded.warnings.into_iter().map(|(_, text)| text));
    if loaded.attributes.skin.is_some() {
        notes.push("the skin and its animations are left out; the command line keeps them in GLB".to_owned());
    }
    Ok((arrays(py, loaded.mesh)?, new(py, loaded.attributes), notes))
}

/// Writes, and returns what the format cannot hold.
#[pyfunction]
pub fn write(
    py: Python<'_>,
    path: PathBuf,
    given: Arrays<'_>,
    attributes: Given<'_>,
    format: Option<&str>,
) -> PyResult<Vec<String>> {
    let declared = encoding(py, format)?;
    let (mesh, attributes) = (mesh(&given)?, attributes::given(&attributes)?);
    work(py, || {
        let encoding = declared.map_or_else(|| io::target_encoding(&path), Ok)?;
        Writer::new().attributes(&attributes).encoding(encoding).write(&path, &mesh)?;
        let rounded = io::lost_precision_note(&mesh, encoding.format);
        Ok(rounded.into_iter().chain(io::lost_attributes_note(&attributes, encoding.format)).collect())
    })
}

/// A built-in model.
#[pyfunction]
pub fn sample<'py>(py: Python<'py>, name: &str) -> PyResult<NewArrays<'py>> {
    let mesh = rtfmesh::mesh::samples::sample(name).map_err(|error| exception(py, &error))?;
    arrays(py, mesh)
}
