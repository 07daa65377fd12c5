//! Sites on the host: connected, on curves, at a distance.

pub mod cells;
pub mod cells_at_curves;
pub mod connect;
pub mod curve_sites;
pub mod poisson;
