//! Sites and the triangles that they lie on.

use super::morton::morton_order;
use crate::mesh::chunks::CHUNK;
use glam::DVec3;
use rayon::prelude::*;

/// Sites on a surface: as seeds, while they move, and at rest.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SitesOnSurface {
    /// Positions in the unit-diagonal frame.
    pub positions: Vec<DVec3>,
    /// The surface's triangle that each site lies on, or from where the surface leads to it.
    pub triangles: Vec<u32>,
}

impl SitesOnSurface {
    /// No sites, with memory for `count` of them.
    pub fn with_capacity(count: usize) -> Self {
        Self { positions: Vec::with_capacity(count), triangles: Vec::with_capacity(count) }
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no sites.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Adds a site.
    pub fn push(&mut self, position: DVec3, triangle: u32) {
        self.positions.push(position);
        self.triangles.push(triangle);
    }

    /// Adds the sites of `other` after these.
    pub fn append(&mut self, other: Self) {
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles);
    }

    /// Keeps the first `count` sites.
    pub fn truncate(&mut self, count: usize) {
        self.positions.truncate(count);
        self.triangles.truncate(count);
    }

    /// The sites with these indices, in this order. Panics if an index is out of range.
    #[must_use]
    pub fn select(&self, indices: &[u32]) -> Self {
        let indices = || indices.par_iter().with_min_len(CHUNK);
        Self {
            positions: indices().map(|i| self.positions[*i as usize]).collect(),
            triangles: indices().map(|i| self.triangles[*i as usize]).collect(),
        }
    }

    /// The same sites in Morton order.
    #[must_use]
    pub fn in_morton_order(&self) -> Self {
        self.select(&morton_order(&self.positions))
    }
}
