//! Surface remeshing on any Vulkan device: well-shaped triangles with exactly the vertex count asked for.

mod error;
pub mod gpu;
pub mod measure;
pub mod mesh;
mod options;
mod pipeline;
pub mod stages;

pub use error::{Error, Result};
pub use mesh::TriMesh;
pub use options::{Centroid, MAX_NEIGHBOURS, Options};
pub use pipeline::{PhaseTime, Progress, Remeshed, Summary, remesh};
