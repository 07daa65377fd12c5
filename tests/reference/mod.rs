//! The kernels' results in plain f64, from the maths: slow, sequential, without any trick of the shaders. And
//! what host geometry is compared with.

pub mod best_fit;
pub mod centroid;
pub mod closest;
pub mod exact;
pub mod face;
pub mod fit;
pub mod hausdorff;
pub mod keep_off;
pub mod knn;
pub mod nearest_vertices;
pub mod octahedral;
pub mod pins;
pub mod plane_fit;
pub mod polish;
pub mod power;
pub mod sizing;
