//! Surface remeshing on any Vulkan device: well-shaped triangles with exactly the vertex count asked for.
//!
//! ```no_run
//! use rtfmesh::{Device, DeviceOptions, Options, io, remesh};
//!
//! let input = io::read("kitten.ply".as_ref())?.mesh;
//! let device = Device::open(&DeviceOptions::from_env())?;
//! let result = remesh(&device, &input, &Options::new(10_000))?;
//! io::write("kitten-10k.ply".as_ref(), &result.mesh)?;
//! # Ok::<(), rtfmesh::Error>(())
//! ```

/// The example in README.md, which compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod error;
pub mod gpu;
pub mod io;
pub mod measure;
pub mod mesh;
mod options;
#[cfg(feature = "picture")]
pub mod picture;
mod pipeline;
pub mod polish;
mod progress;
mod remesher;
pub mod report;
pub mod sites;
pub mod stages;

pub use error::{Cause, Error, Result};
pub use gpu::{Device, DeviceInfo, DeviceOptions, list_devices};
pub use mesh::TriMesh;
pub use mesh::correspondence::{Correspondence, CorrespondenceRequest, SurfacePoint};
pub use options::{
    AllAtOnceOptions, Centroid, CoarseToFineOptions, Face, FeatureLines, Length, MAX_GRADATION, MAX_GROWTH,
    MAX_ITERATIONS, MAX_LBFGS, MAX_NEIGHBOURS, MAX_OFFSET, MeasureDepth, Method, Neighbours, Normals,
    Options, Projection, Quality, Seeding, Shortage, Size, Sizing,
};
pub use pipeline::{
    ExactSummary, FeatureSummary, PhaseTime, Preview, PreviewLevel, Remeshed, RunTimings, Summary, preview,
    preview_repaired, remesh, remesh_repaired, remesh_with_progress,
};
pub use progress::{Flow, Phase, Progress, ProgressToken};
pub use remesher::Remesher;
pub use sites::poisson::DiskSummary;
