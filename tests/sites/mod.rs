//! Sites on the host: seeding, on curves, connected into a mesh.

pub mod cells;
pub mod cells_at_curves;
pub mod connect;
pub mod curve_sites;
pub mod ears;
pub mod poisson;
