//! Surface remeshing on any Vulkan device: well-shaped triangles with exactly the vertex count asked for.

mod error;
pub mod measure;
pub mod mesh;

pub use error::{Error, Result};
pub use mesh::TriMesh;
