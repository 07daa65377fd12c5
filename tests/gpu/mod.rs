//! The GPU layer: memory, order, limits.

pub mod layer;
pub mod memory;
