//! Projections onto the surface.

pub mod best_fit;
pub mod closest;
pub mod model;
pub mod nearest_vertices;
pub mod walk;
