//! Plain f64 versions of the kernels, written from the maths: slow, sequential, and none of the shader's tricks.

pub mod centroid;
pub mod exact;
pub mod face;
pub mod marks;
pub mod nearest;
pub mod octahedral;
pub mod plane_fit;
pub mod power;
pub mod project;
pub mod surface;
