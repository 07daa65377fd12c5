//! What repairing a mesh changed.

use serde::Serialize;

use crate::grammar::counted;

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
    pub unreferenced_vertices_removed: usize,
    /// Faces with a vertex twice or without an area.
    pub degenerate_faces_removed: usize,
    /// Faces over the same three vertices as an earlier one, with the same orientation.
    pub duplicate_faces_removed: usize,
    /// Faces over the same three vertices as an earlier one, with the opposite orientation: both sides of a
    /// sheet, or the contact of two bodies. The earlier one stays.
    pub opposite_faces_merged: usize,
    /// Components below the least area.
    pub components_removed: usize,
    /// Faces turned over to agree with the larger part of their component.
    pub faces_turned: usize,
    /// Components that no turning makes agree.
    pub unorientable_components: usize,
    /// Small parts that hung in holes by a vertex, if holes are to be filled.
    pub parts_removed: usize,
    /// Holes filled.
    pub holes_filled: usize,
    /// Holes that are wider than those to be filled, if some are to be, and rims of small or flat parts.
    pub holes_left: usize,
    /// Holes that cannot be filled without an edge of more than two faces.
    pub holes_unfilled: usize,
    /// Spikes smoothed: vertices that stuck out like needles.
    pub spikes_smoothed: usize,
    /// Components inside closed ones, if only outer ones stay.
    pub hidden_components_removed: usize,
    /// Boundary vertices moved to make ragged boundaries smooth.
    pub boundary_vertices_moved: usize,
}

impl RepairCounts {
    /// Faces over the same three vertices as an earlier one, with either orientation.
    pub(crate) fn repeated_faces(&self) -> usize {
        self.duplicate_faces_removed + self.opposite_faces_merged
    }

    /// What a user should know of, in words; nothing for a mesh that needed no more than exact welding.
    pub fn notes(&self) -> Vec<String> {
        let lines = [
            (
                self.crack_vertices_welded,
                ["crack vertex was", "crack vertices were"],
                "welded, within rounding",
            ),
            (self.near_vertices_welded, ["vertex was", "vertices were"], "welded within the tolerance"),
            (
                self.edges_joined,
                ["boundary edge was", "boundary edges were"],
                "joined to vertices on boundaries",
            ),
            (
                self.degenerate_faces_removed,
                ["face without an area was", "faces without an area were"],
                "removed",
            ),
            (self.duplicate_faces_removed, ["duplicate face was", "duplicate faces were"], "removed"),
            (
                self.opposite_faces_merged,
                ["face was", "faces were"],
                "merged with the same face of opposite orientation",
            ),
            (
                self.components_removed,
                ["component was", "components were"],
                "removed, below the minimum \
            size",
            ),
            (self.faces_turned, ["face was", "faces were"], "flipped to agree with the neighbours"),
            (
                self.unorientable_components,
                ["component is", "components are"],
                "non-orientable and left unchanged",
            ),
            (
                self.parts_removed,
                ["part was", "parts were"],
                "removed: small, and joined to the rest by a vertex alone",
            ),
            (self.holes_filled, ["hole was", "holes were"], "filled"),
            (
                self.holes_left,
                ["hole was", "holes were"],
                "left open: wider than asked for, or around a small or flat part",
            ),
            (
                self.holes_unfilled,
                ["hole was", "holes were"],
                "left open at edges that already have two faces",
            ),
            (self.spikes_smoothed, ["spike was", "spikes were"], "smoothed"),
            (
                self.hidden_components_removed,
                ["component was", "components were"],
                "removed: inside closed ones",
            ),
            (
                self.boundary_vertices_moved,
                ["boundary vertex was", "boundary vertices were"],
                "moved to smooth boundaries",
            ),
        ];
        let present = lines.iter().filter(|(count, ..)| *count > 0);
        present.map(|(count, words, rest)| format!("{} {rest}", counted(*count, *words))).collect()
    }
}
