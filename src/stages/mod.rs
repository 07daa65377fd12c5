//! The stages of an iteration and what comes before and after them: one file a stage.

pub mod best_fit;
pub mod bvh;
pub mod cells;
pub mod centroid;
pub mod closest;
pub mod connect;
pub mod curve_room;
pub mod curve_sites;
pub mod exact;
pub mod face;
pub mod lists;
pub mod neighbours;
pub mod normals;
pub mod pins;
pub mod place;
pub mod planar;
pub mod poisson;
pub mod project;
pub mod records;
pub mod seed;
pub mod sizing;
pub mod sort;
mod spatial;
pub mod step;
pub mod surface;
pub mod surface_curves;
pub mod walk;
