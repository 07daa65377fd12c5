//! Curves and why they are there.

use serde::Serialize;

/// Why an edge is on a curve; where several reasons hold, the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum CurveKind {
    /// It has one triangle: the boundary of the surface.
    Boundary,
    /// It has three or more triangles.
    NonManifold,
    /// Its two triangles run along it in the same direction: their orientations disagree.
    Inconsistent,
    /// The user marked it.
    User,
    /// The surface has a crease there.
    Sharp,
}

impl CurveKind {
    /// All kinds, in order.
    pub const ALL: [Self; 5] =
        [Self::Boundary, Self::NonManifold, Self::Inconsistent, Self::User, Self::Sharp];

    /// The name in reports and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Boundary => "boundary",
            Self::NonManifold => "non-manifold",
            Self::Inconsistent => "inconsistent",
            Self::User => "user",
            Self::Sharp => "sharp",
        }
    }

    /// Whether two triangles meet there, so that a curve may go from one such kind into another.
    pub(super) fn has_two_sides(self) -> bool {
        matches!(self, Self::Inconsistent | Self::User | Self::Sharp)
    }
}

/// A chain of edges without a corner inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Why it is there; the first kind in [`CurveKind::ALL`] that one of its edges has.
    pub kind: CurveKind,
    /// Its vertices in order. An open curve ends in corners, which may be the same one; a closed curve has no
    /// corner, and its first vertex is not repeated.
    pub vertices: Vec<u32>,
    /// Whether it is a loop without a corner.
    pub closed: bool,
    /// Its length in the mesh's units.
    pub length: f64,
}

impl Curve {
    /// How many edges it has.
    pub fn edges(&self) -> usize {
        self.vertices.len() - usize::from(!self.closed)
    }

    /// The two vertices of each edge, in order along the curve.
    pub fn edge_ends(&self) -> impl Iterator<Item = [u32; 2]> {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().zip(next).take(self.edges()).map(|(a, b)| [*a, *b])
    }
}
