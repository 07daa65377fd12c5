//! Each kernel against its reference in f64; files are called as the folders of `glsl/`.

pub mod curves;
pub mod exact;
pub mod face_cell;
pub mod face_planar;
pub mod face_power;
pub mod move_paper;
pub mod neighbours_knn;
pub mod neighbours_lists;
pub mod normals;
pub mod project;
pub mod settle;
pub mod sizing;
pub mod spatial;
