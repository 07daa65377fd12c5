//! What can be drawn.

use crate::{Error, Result, TriMesh};

/// Refuses a mesh without faces, with vertices that are not finite, or with indices out of range.
pub(crate) fn check(mesh: &TriMesh) -> Result<()> {
    if mesh.triangles.is_empty() {
        return Err(Error::input(None, "the mesh has no faces to draw", "give one with triangles"));
    }
    check_indices(mesh)
}

/// Like [`check`], except that there need not be any faces.
pub(super) fn check_indices(mesh: &TriMesh) -> Result<()> {
    if let Some(v) = mesh.vertices.iter().position(|v| !v.is_finite()) {
        return Err(Error::input(None, format!("vertex {v} is not finite"), "repair the file"));
    }
    let corners = mesh.triangles.as_flattened();
    if let Some(v) = corners.iter().find(|v| **v as usize >= mesh.vertices.len()) {
        return Err(Error::input(
            None,
            format!("a face uses vertex {v}, which is not there"),
            "repair the file",
        ));
    }
    Ok(())
}
