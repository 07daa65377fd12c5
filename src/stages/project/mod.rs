//! Projections of targets onto the surface.

pub mod best_fit;
pub mod bvh;
pub mod closest;
pub mod nearest_vertices;
pub mod walk;
