//! Formats of points without faces.

pub(crate) mod columns;
pub(crate) mod pcd;
pub(crate) mod xyz;
