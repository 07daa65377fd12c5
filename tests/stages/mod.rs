//! Each kernel against its reference in f64; files and folders are called as those of `glsl/`.

pub mod centroid;
pub mod exact;
pub mod face;
pub mod fit;
pub mod intersect;
pub mod neighbours;
pub mod normals;
pub mod polish;
pub mod project;
pub mod sizing;
pub mod spatial;
pub mod step;
