//! The polish of a whole mesh on the device: flips and relaxation, as [`crate::polish`] does on the host.

pub mod flip;
pub mod mesh;
pub mod relax;
pub(super) mod work_list;
