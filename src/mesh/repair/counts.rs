//! What repairing a mesh changed.

use serde::Serialize;

/// How many vertices and faces [`super::repair`] changed, by reason.
#[derive(Serialize, Default, Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct RepairCounts {
    /// Vertices at exactly the position of an earlier one, replaced by it.
    pub duplicate_vertices_welded: usize,
    /// Boundary vertices that differed by no more than rounding from an earlier one, replaced by it.
    pub crack_vertices_welded: usize,
    /// Vertices within the tolerance of an earlier one, replaced by it.
    pub near_vertices_welded: usize,
    /// Boundary vertices on boundary edges, which were split there.
    pub edges_joined: usize,
    /// Vertices that no face uses, after the faces below were dropped.
    pub unreferenced_vertices_dropped: usize,
    /// Faces with a vertex twice or without an area.
    pub degenerate_faces_dropped: usize,
    /// Faces over the same three vertices as an earlier one, in any order or orientation.
    pub duplicate_faces_dropped: usize,
    /// Components below the least area.
    pub components_dropped: usize,
    /// Faces turned over to agree with the larger part of their component.
    pub faces_turned: usize,
    /// Components that no turning makes agree.
    pub unorientable_components: usize,
    /// Boundary vertices moved to make ragged boundaries smooth.
    pub boundary_vertices_moved: usize,
}

impl RepairCounts {
    /// What a user should know of, in words; nothing for a mesh that needed no more than exact welding.
    pub fn notes(&self) -> Vec<String> {
        let lines = [
            (self.crack_vertices_welded, "vertices of cracks no wider than rounding were welded"),
            (self.near_vertices_welded, "vertices within the tolerance of others were welded to them"),
            (self.edges_joined, "boundary edges were joined to vertices on them"),
            (self.degenerate_faces_dropped, "faces without an area were dropped"),
            (self.duplicate_faces_dropped, "duplicate faces were dropped"),
            (self.components_dropped, "components were dropped as too small"),
            (self.faces_turned, "faces were turned over to agree with those around"),
            (self.unorientable_components, "components have no two sides; they stay as they are"),
            (self.boundary_vertices_moved, "boundary vertices were moved to make boundaries smooth"),
        ];
        lines.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}")).collect()
    }
}
