//! Sites on the surface, on the host: initial positions, positions on curves, and how they are connected to
//! triangles.

pub mod cells;
pub mod connect;
pub mod curve_clearance;
pub mod curve_sites;
mod cusps;
pub mod ears;
pub mod fans;
pub(crate) mod morton;
pub(crate) mod nearby;
pub mod on_surface;
pub mod place;
pub mod poisson;
pub mod restricted_voronoi;
pub mod seed;
pub mod surface;
pub mod surface_curves;
