//! The GPU layer.

pub mod layer;
pub mod memory;
pub mod submissions;
