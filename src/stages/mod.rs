//! The stages of an iteration and of the polish on the device. Folders and files are named as in `glsl/`.

pub mod blocks;
pub mod centroid;
pub mod exact;
pub mod face;
pub mod fit;
pub mod flags;
pub mod intersect;
pub mod neighbours;
pub mod normals;
pub mod octahedral;
pub mod pins;
pub mod polish;
pub mod project;
pub mod records;
pub mod site_layout;
pub mod sizing;
pub mod spatial;
pub mod step;
