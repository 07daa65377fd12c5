//! The fit of a whole mesh to the surface on the device, as [`crate::polish`] does on the host.

pub mod equations;
pub mod inward;
pub mod limit;
pub mod mesh;
pub mod samples;
