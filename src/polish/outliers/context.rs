//! Settings of the edits at outliers, and what all of them share.

use std::collections::HashSet;

use crate::ProgressToken;
use crate::polish::Target;

/// Tolerated distance, as a share of the typical edge length.
pub(super) const FAR: f64 = 0.15;
/// Settings of [`super::reduce_outliers`].
#[derive(Debug, Clone, PartialEq)]
pub struct OutlierOptions {
    /// Passes over all outliers; one around which nothing has changed since it was tried is left out.
    pub passes: u32,
    /// No angle may fall below this many degrees, unless it was smaller before.
    pub min_angle: f64,
    /// Whether each vertex stays where it is, as boundary vertices do; vertices beyond the end of the list do
    /// not.
    pub fixed: Vec<bool>,
    /// Edges on curves, the smaller vertex first, which are not flipped. If there are none, no edge between
    /// two fixed vertices is.
    pub curve_edges: HashSet<(u32, u32)>,
    /// The patch of each triangle, in which it stays; empty if there is only one.
    pub patches: Vec<u32>,
    /// The target edge length at each vertex, relative to the typical one; empty if they are all equal.
    pub lengths: Vec<f64>,
    /// Largest distance that is tolerated, if that is less than 0.15 edge lengths.
    pub tolerance: f64,
}

impl Default for OutlierOptions {
    fn default() -> Self {
        Self {
            passes: 2,
            min_angle: 38.0,
            fixed: Vec::new(),
            curve_edges: HashSet::new(),
            patches: Vec::new(),
            lengths: Vec::new(),
            tolerance: f64::INFINITY,
        }
    }
}

/// What all copies of the mesh share.
#[derive(Clone, Copy)]
pub(crate) struct OutlierContext<'a> {
    pub target: &'a Target,
    pub options: &'a OutlierOptions,
    /// The typical edge length.
    pub edge: f64,
    pub progress: &'a ProgressToken,
}

impl OutlierContext<'_> {
    /// The typical edge length at a triangle.
    pub fn typical_edge_length(&self, triangle: [u32; 3]) -> f64 {
        let lengths = &self.options.lengths;
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
