//! The zero surface of a scalar field on a sparse grid, as triangles: marching cubes whose results are always
//! manifold. The field may come from anywhere: points, voxels, formulas.

mod cell;
mod extract;
mod grid;

pub use extract::{EdgeVertex, Extracted, extract};
pub use grid::{BLOCK, BLOCK_NODES, SparseGrid};
