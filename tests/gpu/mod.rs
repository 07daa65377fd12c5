//! The GPU layer.

pub mod layer;
pub mod memory;
