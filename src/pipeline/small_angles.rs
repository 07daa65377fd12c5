//! Small angles of a run's result, and what was done about them.

use super::kept::Kept;
use crate::TriMesh;
use crate::local::Mended;
use crate::mesh::quality::angle_below;
use crate::mesh::small_angles::{SmallAngles, small_angles};
use crate::options::{Method, Options};
use serde::Serialize;

/// What was done about small angles.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MendingCounts {
    pub edits: usize,
    /// Vertices that went there from elsewhere.
    pub vertices: usize,
}

impl MendingCounts {
    pub fn of(mended: &Mended) -> Self {
        Self { edits: mended.edits, vertices: usize::try_from(mended.added).unwrap_or(0) }
    }
}

/// Small angles: what was done about them, and which are left.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SmallAngleSummary {
    /// The least angle that was asked for, in degrees.
    pub min_angle: f64,
    /// Edits that mended some; those of components that were remeshed by local operations are not counted.
    pub edits: usize,
    /// Vertices that these edits took from elsewhere.
    pub vertices: usize,
    /// Triangles of the result with a smaller angle.
    pub left: usize,
    /// Triangles among `left` where two sharp edges or boundaries meet at that angle.
    pub at_corners: usize,
    /// Other triangles among `left` with all vertices on such edges, as where these come close to each other.
    pub between_curves: usize,
    /// Triangles among `left` that are kept as they are in the input.
    pub kept: usize,
}

impl SmallAngleSummary {
    /// For a result with this smallest angle, in degrees, if its small angles were to be mended; its last
    /// triangles may be kept ones.
    pub(crate) fn new(
        (result, kept): (&TriMesh, Option<&Kept>),
        smallest: f64,
        mended: MendingCounts,
        options: &Options,
    ) -> Option<Self> {
        let (min_angle, feature_angle) =
            (options.coarse_to_fine.min_angle, options.coarse_to_fine.feature_angle);
        // Stretched triangles have small angles by design.
        let is_stretched = options.coarse_to_fine.sizing.aspect().is_some();
        if options.method != Method::CoarseToFine || min_angle == 0.0 || is_stretched {
            return None;
        }
        let MendingCounts { edits, vertices } = mended;
        let SmallAngles { faces, at_corners, between_curves } = if smallest < min_angle {
            small_angles(result, min_angle, feature_angle)
        } else {
            SmallAngles::default()
        };
        let is_small = |t: &usize| angle_below(result.corners(*t), min_angle).is_some();
        let first = result.triangles.len() - kept.map_or(0, Kept::triangles);
        let kept = (first..result.triangles.len()).filter(is_small).count();
        Some(Self { min_angle, edits, vertices, left: faces, at_corners, between_curves, kept })
    }
}
