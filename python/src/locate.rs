//! Points on meshes.

use crate::mesh::{Arrays, Places, mesh, places, positions};
use crate::work::watched_work;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use rtfmesh::mesh::locate::{PointsToLocate, locate as find};

/// The places of points (N x 3) on a mesh; with normals (N x 3), on the side that faces so, unless the other
/// one is nearer by more than the margin.
#[pyfunction]
pub fn locate<'py>(
    py: Python<'py>,
    given: Arrays<'py>,
    points: PyReadonlyArray2<'py, f64>,
    normals: Option<PyReadonlyArray2<'py, f64>>,
    margin: f64,
) -> PyResult<Places<'py>> {
    let (mesh, points) = (mesh(&given)?, positions(&points)?);
    let normals = normals.as_ref().map(positions).transpose()?.unwrap_or_default();
    let found = watched_work(py, move |progress| {
        find(&mesh, &PointsToLocate { points: &points, normals: &normals, margin }, progress)
    })?;
    places(py, &found)
}
