//! The faces of the sites in their tangent planes.

pub mod cell;
pub mod planar;
