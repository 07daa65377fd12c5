//! What every reader returns.

use super::checks::no_faces;
use crate::mesh::TriMesh;
use crate::mesh::attributes::Attributes;
use crate::{Result, WarningCode};

/// A mesh as read from a file: triangulated, but not cleaned.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loaded {
    /// Vertices in the file's order (for OBJ and STL: in the order in which faces first use them), polygons
    /// split into triangles, every index in range and every coordinate finite.
    pub mesh: TriMesh,
    /// Colours, texture coordinates, labels and the like.
    pub attributes: Attributes,
    /// What was left out of the file or changed, and which other files were read; one sentence each.
    pub notes: Vec<String>,
    /// What its user must know, for the summary of a run: what part of the file is left out, or how a surface
    /// of points or a volume was made.
    pub warnings: Vec<(WarningCode, String)>,
    /// Images that glTF materials lay onto the mesh by its texture coordinates and that were not read;
    /// [`crate::io::Reader::materials`] has them read.
    pub unread_images: usize,
}

impl Loaded {
    /// Returns itself if it is a mesh and not only points.
    ///
    /// # Errors
    /// [`crate::Error::Input`] without faces.
    pub fn with_faces(self) -> Result<Self> {
        if self.mesh.triangles.is_empty() { Err(no_faces()) } else { Ok(self) }
    }
}
