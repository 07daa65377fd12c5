//! Faces of sites: polygons in tangent planes.

pub mod cell;
pub mod planar;
pub mod power;
