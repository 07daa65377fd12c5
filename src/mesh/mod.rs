//! Triangle meshes on the host: reading, cleaning, measuring, writing.

pub mod attributes;
pub mod cell_mesh;
pub(crate) mod chunks;
pub(crate) mod coincident;
pub mod correspondence;
pub(crate) mod csr;
pub mod distance;
pub mod feature_distance;
pub mod features;
pub mod follow;
pub(crate) mod forced_angles;
pub(crate) mod half_edge_mesh;
pub(crate) mod half_edges;
pub(crate) mod handles;
pub(crate) mod hash_grid;
pub(crate) mod insert_points;
pub mod intersections;
pub mod locate;
pub(crate) mod mirror;
pub(crate) mod planes;
pub mod quality;
pub(crate) mod queue;
pub(crate) mod quick_hash;
pub mod repair;
pub mod samples;
pub(crate) mod sampling;
pub(crate) mod submesh;
pub(crate) mod surface_tree;
pub mod topology;

// Inner parts, as in lib.rs.
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod bvh;
#[cfg(not(feature = "internals"))]
pub(crate) mod bvh;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod hausdorff;
#[cfg(not(feature = "internals"))]
pub(crate) mod hausdorff;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod kd_tree;
#[cfg(not(feature = "internals"))]
pub(crate) mod kd_tree;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod level_set;
#[cfg(not(feature = "internals"))]
pub(crate) mod level_set;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod polyline;
#[cfg(not(feature = "internals"))]
pub(crate) mod polyline;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod simplify;
#[cfg(not(feature = "internals"))]
pub(crate) mod simplify;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod sizing;
#[cfg(not(feature = "internals"))]
pub(crate) mod sizing;
pub mod small_angles;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod subdivide;
#[cfg(not(feature = "internals"))]
pub(crate) mod subdivide;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod triangle;
#[cfg(not(feature = "internals"))]
pub(crate) mod triangle;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod unit_frame;
#[cfg(not(feature = "internals"))]
pub(crate) mod unit_frame;

use chunks::par_clone;
use glam::DVec3;

/// What two equal positions have in common, whatever the signs of their zeros.
pub(crate) fn position_key(position: DVec3) -> [u64; 3] {
    // Adding zero turns -0.0 into 0.0 and changes nothing else.
    position.to_array().map(|value| (value + 0.0).to_bits())
}

/// The index that stands for none: no vertex, half-edge, triangle or site. The kernels have the same.
pub const NONE: u32 = u32::MAX;

/// An indexed triangle mesh in the units of its file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions.
    pub vertices: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// A copy, made by all threads.
    pub(crate) fn par_clone(&self) -> Self {
        Self { vertices: par_clone(&self.vertices), triangles: par_clone(&self.triangles) }
    }

    /// The three corners of triangle `t`. Panics if `t` or one of its indices is out of range.
    #[inline]
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.vertices[v as usize])
    }

    /// The normal of triangle `t`, twice as long as its area. Panics as [`TriMesh::corners`] does.
    pub(crate) fn doubled_normal(&self, t: usize) -> DVec3 {
        triangle::doubled_normal(self.corners(t))
    }

    /// The area of triangle `t` in the unit of the coordinates squared. Panics as [`TriMesh::corners`] does.
    pub fn triangle_area(&self, t: usize) -> f64 {
        triangle::area(self.corners(t))
    }

    /// The area of all triangles. Panics if an index is out of range.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.triangle_area(t)).sum()
    }

    /// Smallest and largest coordinates over all vertices; `None` without vertices.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold([first; 2], |[low, high], v| [low.min(*v), high.max(*v)]))
    }
}

/// Edge length of `count` points in a hexagonal layout over `area`.
pub(crate) fn spacing(area: f64, count: usize) -> f64 {
    (2.0 * area / (3f64.sqrt() * count as f64)).sqrt()
}
