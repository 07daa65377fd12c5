//! The stages of an iteration and what comes before and after them: one file a stage.

pub mod bvh;
pub mod centroid;
pub mod closest;
pub mod connect;
pub mod face;
pub mod neighbours;
pub mod normals;
pub mod project;
pub mod records;
pub mod seed;
mod spatial;
pub mod step;
pub mod surface;
pub mod walk;
