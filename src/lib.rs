//! Surface remeshing on any Vulkan device: well-shaped triangles with exactly the vertex count asked for.
//!
//! ```no_run
//! use rtfmesh::{Device, DeviceOptions, Options, mesh, remesh};
//!
//! let input = mesh::io::read("kitten.ply".as_ref())?.mesh;
//! let device = Device::open(&DeviceOptions::from_env())?;
//! let result = remesh(&device, &input, &Options::new(10_000), &mut |_| {})?;
//! mesh::io::write("kitten-10k.ply".as_ref(), &result.mesh)?;
//! # Ok::<(), rtfmesh::Error>(())
//! ```

mod choices;
mod error;
pub mod gpu;
pub mod measure;
pub mod mesh;
mod options;
#[cfg(feature = "picture")]
pub mod picture;
mod pipeline;
pub mod polish;
mod remesher;
pub mod report;
mod size;
pub mod stages;
mod watch;

pub use choices::{Face, Neighbours, Normals, Projection, Seeding};
pub use error::{Error, Result};
pub use gpu::{Device, DeviceInfo, DeviceOptions, list_devices};
pub use mesh::TriMesh;
pub use mesh::source::{Source, SurfacePoint, Traced};
pub use options::{
    Centroid, Features, MAX_GRADATION, MAX_GROWTH, MAX_ITERATIONS, MAX_LBFGS, MAX_NEIGHBOURS, MAX_OFFSET,
    MeasureDepth, Method, Options, Quality, Shortage, Sizing,
};
pub use pipeline::{
    ExactSummary, PhaseTime, Preview, PreviewLevel, Remeshed, RunTimings, SkeletonSummary, Summary, preview,
    preview_repaired, remesh, remesh_repaired,
};
pub use remesher::Remesher;
pub use size::{Length, Size};
pub use stages::poisson::DiskSummary;
pub use watch::{Flow, Phase, Progress};
