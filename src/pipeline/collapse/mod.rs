//! The alternative to remeshing by cells: edge collapses and the same polish. It keeps the topology with any
//! number of vertices, at the price of less even triangles.

pub(crate) mod components;
pub(crate) mod faulty;
pub(crate) mod simplify;
