//! Warnings, each with a code that stays the same when its words change.

use serde::Serialize;

/// What a warning is about. `docs/warnings.md` explains each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum WarningCode {
    /// The device fails the self-test, or a better one does and was left out.
    Device,
    /// Sites of the preset got no face.
    LostFaces,
    /// The preset supports closed manifolds only, and the input is not one.
    OpenInput,
    /// Faces were left open.
    UnfilledFaces,
    /// The number of vertices of the result is not the one asked for.
    VertexCount,
    /// The number of triangles of the result is not the one asked for.
    FaceCount,
    /// The input is a closed manifold, and the result is not.
    OpenResult,
    /// Components, handles or boundary loops differ.
    Topology,
    /// The result is inside out.
    InsideOut,
    /// A component of the result faces inwards with a large part of its area.
    FacesInwards,
    /// Faces of the result intersect, and those of the input do not.
    Intersections,
    /// Rounding to the numbers of the format made faces intersect or vanish.
    Rounding,
    /// The input is far from the result in places.
    Distance,
    /// The volume changes by much.
    Volume,
    /// Sharp edges were given up for want of vertices.
    SharpEdges,
    /// Creases between narrow facets were taken for a coarse tessellation of a round surface.
    NarrowFacets,
    /// Triangles have small angles that no corner of the input's shape forces.
    SmallAngles,
    /// The result has folded edges where the input has none.
    FoldedEdges,
    /// The largest deviation that was asked for was not reached.
    Deviation,
    /// The best result that was found has a fault.
    Fault,
    /// Bodies of the input touch and share a wall.
    TouchingBodies,
    /// The input has cracks.
    Cracks,
    /// Normals of points disagreed with each other, and none was used.
    Normals,
    /// The values of a volume were smoothed, because noise gave the surface many handles.
    Smoothed,
    /// The run was cut short.
    CutShort,
    /// Textures are not kept.
    Textures,
    /// A part of the input file was left out: faces without finite coordinates, morph targets, copies of
    /// meshes.
    LeftOut,
    /// Points or boundary vertices that are to be kept are not, or not where they were.
    Points,
    /// No part of the surface is in a region to be refined.
    Refine,
}

/// A warning of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Warning {
    pub code: WarningCode,
    pub text: String,
}
