//! Faces of the sites: polygons in their tangent planes.

pub mod cell;
pub mod planar;
pub mod polygons;
pub mod power;
