//! Edges that are not flipped.

use crate::mesh::half_edges::{EdgeSet, edge_key};

/// What stays as it is.
#[derive(Clone, Copy)]
pub(crate) struct Locked<'a> {
    /// Vertices that do not move freely.
    pub fixed: &'a [bool],
    pub curve_edges: &'a EdgeSet,
}

impl Locked<'_> {
    /// Whether the edge between two vertices stays: those on curves, and all between fixed vertices where
    /// curves are unknown.
    pub fn holds(&self, a: u32, b: u32) -> bool {
        self.fixed[a as usize]
            && self.fixed[b as usize]
            && (self.curve_edges.is_empty() || self.curve_edges.contains(&edge_key(a, b)))
    }
}
