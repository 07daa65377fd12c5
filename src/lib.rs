//! Surface remeshing on any Vulkan device: well-shaped triangles with exactly the vertex count asked for.
//!
//! ```no_run
//! use rtfmesh::{Device, DeviceOptions, Options, io, remesh};
//!
//! let input = io::read("kitten.ply")?.mesh;
//! let device = Device::open(&DeviceOptions::from_env())?;
//! let result = remesh(&device, &input, &Options::new(10_000))?;
//! io::write("kitten-10k.ply", &result.mesh)?;
//! # Ok::<(), rtfmesh::Error>(())
//! ```
//!
//! Meshes are read and written by [`io`], cleaned by [`mesh::repair`], remeshed by [`remesh`] or a
//! [`Remesher`] with [`Options`], and judged by [`measure`] and [`report`]. Positions are [`glam`] vectors.

// With the feature everything inside can be seen, and what nobody uses is found.
#![cfg_attr(not(feature = "internals"), allow(dead_code, unused_imports))]

/// The example in README.md, which compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

// The command line names the library as any other user does.
#[cfg(feature = "cli")]
extern crate self as rtfmesh;

/// The program, for what brings it along in a form of its own, such as the Python package. No part of what
/// stays compatible.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
pub mod cloud;
mod error;
mod grammar;
pub mod io;
pub mod measure;
pub mod mesh;
pub mod options;
#[cfg(feature = "picture")]
pub mod picture;
mod pipeline;
mod progress;
mod remesher;
pub mod report;
pub mod volume;
pub mod wrap;

// How it is done, which may change at any time: seen by the project's own tests and benches alone.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod gpu;
#[cfg(not(feature = "internals"))]
mod gpu;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod local;
#[cfg(not(feature = "internals"))]
mod local;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod polish;
#[cfg(not(feature = "internals"))]
mod polish;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod sites;
#[cfg(not(feature = "internals"))]
mod sites;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod stages;
#[cfg(not(feature = "internals"))]
mod stages;

/// Vulkan devices: listed, opened, described.
pub mod device {
    pub use crate::gpu::{Device, DeviceInfo, DeviceOptions, Limits, SelfTest, list_devices, tested_devices};
}

pub use device::{Device, DeviceInfo, DeviceOptions, list_devices};
pub use error::{Cause, Error, Result};
pub use glam;
pub use mesh::TriMesh;
pub use mesh::cell_mesh::{CellColours, CellKind, CellMesh, CellSummary};
pub use mesh::correspondence::{Correspondence, CorrespondenceRequest, SurfacePoint};
pub use mesh::follow::Follower;
pub use options::{
    CoarseToFineOptions, FeatureLines, Length, MeasureDepth, Method, Options, Quality, Refinement, Region,
    Shortage, Size, Sizing, Symmetry,
};
pub use pipeline::{
    Preview, PreviewKept, PreviewLevel, Remeshed, Summary, WarningCode, preview, preview_repaired, remesh,
    remesh_repaired, remesh_with_progress,
};
pub use progress::{Flow, Phase, Progress, ProgressToken};
pub use remesher::Remesher;
