//! Settings of the edits at outliers, and what all of them share.

use crate::ProgressToken;
use crate::mesh::half_edges::EdgeSet;
use crate::polish::Target;

/// Tolerated distance, as a share of the typical edge length.
pub(super) const FAR: f64 = 0.15;

/// Settings of [`super::reduce_outliers`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlierOptions {
    /// Passes over all outliers; one around which nothing has changed since it was tried is left out.
    pub passes: u32,
    /// No angle may fall below this many degrees, unless it was smaller before.
    pub min_angle: f64,
    /// Whether no edge between two fixed vertices is flipped, as if no curves were known.
    pub keeps_chords: bool,
    /// Largest distance that is tolerated, if that is less than 0.15 edge lengths.
    pub tolerance: f64,
}

impl Default for OutlierOptions {
    fn default() -> Self {
        Self { passes: 2, min_angle: 38.0, keeps_chords: false, tolerance: f64::INFINITY }
    }
}

/// What all copies of the mesh share.
#[derive(Clone, Copy)]
pub(crate) struct OutlierContext<'a> {
    pub target: &'a Target,
    pub options: &'a OutlierOptions,
    /// Edges that are not flipped, and the relative target edge lengths, as
    /// [`crate::polish::ConstrainedMesh`] has them.
    pub curve_edges: &'a EdgeSet,
    pub lengths: &'a [f64],
    /// The typical edge length.
    pub edge: f64,
    pub progress: &'a ProgressToken,
}

impl OutlierContext<'_> {
    /// The typical edge length at a triangle.
    pub fn typical_edge_length(&self, triangle: [u32; 3]) -> f64 {
        let lengths = self.lengths;
        if lengths.is_empty() {
            return self.edge;
        }
        self.edge * triangle.iter().map(|v| lengths[*v as usize]).sum::<f64>() / 3.0
    }

    /// The square of the tolerated distance at a triangle.
    pub fn tolerance_sq(&self, triangle: [u32; 3]) -> f64 {
        (FAR * self.typical_edge_length(triangle)).min(self.options.tolerance).powi(2)
    }
}
