//! Meshes from arrays and back.

use glam::DVec3;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rtfmesh::mesh::correspondence::SurfacePoint;
use rtfmesh::{TriMesh, glam};

/// Vertices (V x 3) and faces (F x 3), both contiguous, every index in range.
pub type Arrays<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, u32>);

/// The same of a result.
pub type NewArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// Triangles and weights of points.
pub type Places<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray2<f64>>);

/// The mesh of two arrays.
///
/// # Errors
/// `ValueError` for arrays of another shape, which the package's other modules do not give.
pub fn mesh((vertices, faces): &Arrays<'_>) -> PyResult<TriMesh> {
    let vertices = positions(vertices)?;
    let (triangles, rest) = faces.as_slice()?.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(PyValueError::new_err("faces must have three columns"));
    }
    let in_range = |corner: &u32| (*corner as usize) < vertices.len();
    if !triangles.as_flattened().iter().all(in_range) {
        return Err(PyValueError::new_err("faces must have indices of vertices"));
    }
    Ok(TriMesh { vertices, triangles: triangles.to_vec() })
}

/// The rows of an array (N x 3), which is contiguous.
///
/// # Errors
/// `ValueError` for an array of another shape.
pub fn positions(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<DVec3>> {
    let (rows, rest) = array.as_slice()?.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(PyValueError::new_err("positions and normals must have three columns"));
    }
    Ok(rows.iter().map(|row| DVec3::from_array(*row)).collect())
}

/// The arrays of a mesh, in its own memory.
///
/// # Errors
/// Those of numpy.
pub fn arrays(py: Python<'_>, mesh: TriMesh) -> PyResult<NewArrays<'_>> {
    let TriMesh { vertices, triangles } = mesh;
    let (rows, faces) = (vertices.len(), triangles.len());
    let vertices = PyArray1::from_vec(py, bytemuck::cast_vec(vertices)).reshape([rows, 3])?;
    let faces = PyArray1::from_vec(py, triangles.into_flattened()).reshape([faces, 3])?;
    Ok((vertices, faces))
}

/// The triangles and the weights of their corners (N x 3) of points.
///
/// # Errors
/// Those of numpy.
pub fn places<'py>(py: Python<'py>, points: &[SurfacePoint]) -> PyResult<Places<'py>> {
    let triangles = PyArray1::from_iter(py, points.iter().map(|point| point.triangle));
    let weights = PyArray1::from_iter(py, points.iter().flat_map(|point| point.barycentric));
    Ok((triangles, weights.reshape([points.len(), 3])?))
}
