//! The element of the surface that a site lies on: a triangle, an edge or a vertex.

/// A triangle, an edge or a vertex of the surface, by the surface's indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Place {
    /// In a triangle: a site that moves freely in its patch.
    Inside(u32),
    /// On a side, 0 to 2, of a triangle: from corner `side` to corner `(side + 1) % 3`. If the edge is on a
    /// curve, so is the site. Any triangle at the edge may be given.
    Edge(u32, u8),
    /// At a vertex; on a curve if one passes there.
    Vertex(u32),
}

impl Place {
    /// The places of sites that all lie in triangles.
    pub fn inside(triangles: &[u32]) -> Vec<Self> {
        triangles.iter().map(|t| Self::Inside(*t)).collect()
    }
}
