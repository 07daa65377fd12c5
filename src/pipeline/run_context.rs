//! What all parts of a run share.

use super::intersections::InputIntersections;
use super::plan::Plan;
use crate::TriMesh;
use crate::gpu::Device;
use crate::mesh::topology::Topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Options;
use crate::sites::surface::Surface;

/// The device, the input without its small components, and what is asked for.
#[derive(Clone, Copy)]
pub(crate) struct RunContext<'a> {
    pub device: &'a Device,
    /// The repaired input, in its units.
    pub mesh: &'a TriMesh,
    /// From the input's units to those of the surface.
    pub frame: &'a UnitFrame,
    pub surface: &'a Surface,
    /// Topology of the repaired input.
    pub input: &'a Topology,
    /// Faces of the repaired input that intersect others.
    pub input_intersections: &'a InputIntersections,
    /// The user's request.
    pub options: &'a Options,
    /// What is derived from it.
    pub plan: &'a Plan,
    /// Vertices are inserted where the mesh is farther than this from the surface, in diagonals.
    pub deviation: Option<f64>,
}

impl RunContext<'_> {
    /// Whether the surface may be simplified without its curves if there are too few vertices.
    pub fn may_simplify(&self) -> bool {
        self.plan.pinned.is_empty() && self.plan.curves.may_be_lost(self.options)
    }
}
