//! What follows where cells fail, or where a component is too small for them: local operations. They keep the
//! topology with any number of vertices, at the price of somewhat less even triangles.

mod allot;
pub(crate) mod closer;
pub(crate) mod components;
pub(crate) mod faulty;
pub(crate) mod remesh;
