//! Volumes: surfaces through values on a grid.

mod grid;
mod iso;

pub use iso::{Inside, IsoOptions, IsoSurface, iso_surface, iso_surface_with_progress};
