//! What improves a connected mesh.

pub mod angles;
pub mod fit;
pub mod outliers;
