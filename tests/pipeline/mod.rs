//! Whole runs through the library.

pub mod anisotropic;
pub mod bends;
pub mod choices;
pub mod coarse_to_fine;
pub mod curves;
pub mod deviation;
pub mod dirty;
pub mod exact;
pub mod kept;
pub mod kept_triangles;
pub mod label_borders;
pub mod models;
pub mod presets;
pub mod progress;
pub mod properties;
pub mod remesher;
pub mod ridges;
pub mod rounding;
pub mod shortage;
pub mod shorter;
pub mod sizing;
pub mod symmetric;
