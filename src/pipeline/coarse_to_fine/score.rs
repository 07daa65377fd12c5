//! What meshes of the same surface are compared by.

use crate::mesh::distance::rms_distance;
use crate::mesh::quality::quality;
use crate::pipeline::outcome::{Fault, FaultKind};
use crate::{ProgressToken, Result, TriMesh};

/// Figures of a mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Score {
    pub fault: Option<FaultKind>,
    /// See [`rms_distance`].
    pub rms: f64,
    /// The smallest angle in degrees.
    pub smallest: f64,
    /// The fraction of triangles with an angle below 30 degrees.
    pub narrow: f64,
    /// The mean quality.
    pub quality: f64,
}

impl Score {
    /// Of a mesh with this fault.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn of(
        mesh: &TriMesh,
        fault: Option<&Fault>,
        surface: &TriMesh,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let quality = quality(mesh);
        Ok(Self {
            fault: fault.map(|fault| fault.kind),
            rms: rms_distance(mesh, surface, progress)?,
            smallest: quality.as_ref().map_or(0.0, |quality| quality.min_angle),
            narrow: quality.as_ref().map_or(1.0, |quality| quality.fraction_below_30),
            quality: quality.map_or(0.0, |quality| quality.mean_quality),
        })
    }
}
