//! What improves a connected mesh.

pub mod angles;
pub mod chords;
pub mod fit;
pub mod outliers;
