//! A mesh with its constraints: what all passes that improve a connected mesh work on.

use super::{MeshCache, SlidingCurve};
use crate::TriMesh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::{EdgeSet, edge_key};

/// A connected mesh on a surface, with what its improvement must keep.
///
/// - Lists have an entry for each vertex or triangle, or are empty as their fields say.
/// - Each edge in `curve_edges` is one of the mesh, and stands for the part of its curve between its ends.
/// - Vertices on curves are `fixed`: they move along their curves only. They have the same arc lengths in
///   `curve_edges` as in `sliding_curves`.
/// - `cache` belongs to the triangles and patches as they are; whoever changes these starts a new one. After
///   [`super::reduce_outliers`], only its tree is of use.
///
/// Every pass preserves this and the topology. If it is cancelled, arc lengths may be out of date.
#[derive(Debug, Clone, Default)]
pub struct ConstrainedMesh {
    /// The mesh.
    pub mesh: TriMesh,
    /// The patch of each triangle, in which it stays; empty if there is only one.
    pub patches: Vec<u32>,
    /// Whether each vertex stays where it is, or on its curve, as boundary vertices do; vertices beyond the
    /// end of the list do not.
    pub fixed: Vec<bool>,
    /// Whether each vertex stays exactly where it is and is never removed, nor an edge between two of them
    /// divided; empty if there are none.
    pub pinned: Vec<bool>,
    /// Its edges on curves, in order along each, which stay. If there are none, all edges between two fixed
    /// vertices do.
    pub curve_edges: Vec<CurveEdge>,
    /// The curves, with the vertices that may slide along them.
    pub sliding_curves: Vec<SlidingCurve>,
    /// The relative target edge length at each vertex; empty if they are all equal.
    pub lengths: Vec<f64>,
    /// What passes leave to each other.
    pub cache: MeshCache,
}

/// An edge of a mesh that lies on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveEdge {
    /// Its vertices.
    pub ends: [u32; 2],
    /// The curve's number among [`ConstrainedMesh::sliding_curves`].
    pub curve: u32,
    /// The arc length at the first vertex. On a closed curve, arc lengths may lie beyond its ends.
    pub from: f64,
    /// The arc length at the second vertex.
    pub to: f64,
}

impl From<TriMesh> for ConstrainedMesh {
    /// A mesh without constraints.
    fn from(mesh: TriMesh) -> Self {
        Self { mesh, ..Self::default() }
    }
}

impl ConstrainedMesh {
    /// The half-edges, without which the mesh has no triangles until they are kept.
    pub(super) fn take_half_edges(&mut self) -> HalfEdgeMesh {
        let triangles = std::mem::take(&mut self.mesh.triangles);
        self.cache.take(triangles, self.mesh.vertices.len(), &self.patches)
    }

    /// Gives the mesh back its triangles.
    pub(super) fn keep_half_edges(&mut self, half_edges: HalfEdgeMesh) {
        self.mesh.triangles = self.cache.keep(half_edges);
    }

    /// The edges on curves, which are not flipped; none if no edge between two fixed vertices is to be.
    pub(super) fn kept_edges(&self, keeps_chords: bool) -> EdgeSet {
        if keeps_chords { EdgeSet::new() } else { self.edge_set() }
    }

    /// The edges on curves.
    pub(crate) fn edge_set(&self) -> EdgeSet {
        self.curve_edges.iter().map(|CurveEdge { ends: [a, b], .. }| edge_key(*a, *b)).collect()
    }

    /// Takes over where vertices on curves are after they have slid.
    pub(super) fn slide_to(&mut self, curves: Vec<SlidingCurve>) {
        let mut arc_lengths = vec![f64::NAN; self.mesh.vertices.len()];
        curves.iter().flat_map(|curve| &curve.sliders).for_each(|(v, arc)| arc_lengths[*v as usize] = *arc);
        for CurveEdge { ends, curve, from, to } in &mut self.curve_edges {
            let line = &curves[*curve as usize].line;
            let runs_on = *from < *to;
            for (v, arc_length) in ends.iter().zip([&mut *from, &mut *to]) {
                let new = arc_lengths[*v as usize];
                // A corner is at its end of the curve.
                if !new.is_nan() {
                    *arc_length = new;
                }
            }
            if line.is_closed() && runs_on != (*from < *to) {
                *to += if runs_on { line.length() } else { -line.length() };
            }
        }
        self.sliding_curves = curves;
    }
}
