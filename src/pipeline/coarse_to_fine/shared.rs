//! What all levels of an attempt share.

use super::surface_model::SurfaceModel;
use crate::TriMesh;
use crate::gpu::Device;
use crate::mesh::topology::Topology;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Options;
use crate::pipeline::intersections::InputIntersections;
use crate::sites::surface::Surface;

/// An attempt of the default pipeline.
pub(crate) struct CoarseToFine<'a> {
    pub device: &'a Device,
    pub surface: &'a Surface,
    pub model: &'a SurfaceModel,
    /// The repaired input, in its units.
    pub mesh: &'a TriMesh,
    /// From the input's units to those of the surface.
    pub frame: &'a UnitFrame,
    /// Topology of the repaired input.
    pub input: &'a Topology,
    /// Faces of the repaired input that intersect others.
    pub input_intersections: &'a InputIntersections,
    pub options: &'a Options,
    /// Vertices are inserted where the mesh is farther than this from the surface, in diagonals.
    pub deviation: Option<f64>,
}
