//! Results that follow their inputs to other poses.

use crate::mesh::{Arrays, mesh};
use crate::work::watched_work;
use glam::DVec3;
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rtfmesh::{Error, Follower, TriMesh, glam};

/// The vertices of a result (F x N x 3) in all poses of its input (F x V x 3).
#[pyfunction]
pub fn follow<'py>(
    py: Python<'py>,
    input: Arrays<'py>,
    result: Arrays<'py>,
    poses: PyReadonlyArray3<'py, f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (input, result) = (mesh(&input)?, mesh(&result)?);
    let (count, own, rows) = (poses.shape()[0], poses.shape()[1], result.vertices.len());
    let (coordinates, _) = poses.as_slice()?.as_chunks::<3>();
    let found = watched_work(py, move |progress| {
        let follower = Follower::new(input, &result, progress)?;
        let mut found = Vec::with_capacity(count * rows);
        for frame in 0..count {
            if progress.is_cancelled() {
                return Err(Error::Cancelled);
            }
            let frame = &coordinates[frame * own..(frame + 1) * own];
            let vertices = frame.iter().map(|p| DVec3::from_array(*p)).collect();
            found.extend(follower.follow(&TriMesh { vertices, triangles: Vec::new() })?);
        }
        Ok(found)
    })?;
    PyArray1::from_vec(py, bytemuck::cast_vec(found)).reshape([count, rows, 3])
}
