//! The outcome of an attempt.

use super::result::{ExactSummary, FeatureSummary};
use crate::TriMesh;
use crate::mesh::unit_frame::{UnitFrame, decimals};
use crate::sites::connect::ConnectCounts;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::poisson::DiskSummary;
use crate::stages::flags::FlagCounts;
use glam::DVec3;

/// The mesh of an attempt, in the unit-diagonal frame, with its figures.
#[derive(Default)]
pub(crate) struct Outcome {
    pub mesh: TriMesh,
    /// The vertices before the polish; none with all sites from the start, which is not polished.
    pub sites: SitesOnSurface,
    pub counts: ConnectCounts,
    pub flags: FlagCounts,
    /// What is wrong with the mesh.
    pub fault: Option<Fault>,
    /// Number of faces that intersect others, if it is known.
    pub intersecting_faces: Option<usize>,
    /// Number of components that were remeshed by local operations or simplified.
    pub simplified_components: usize,
    /// The smallest and the largest edge length in the size field; `None` if all are equal.
    pub edge_lengths: Option<[f64; 2]>,
    /// With exact faces.
    pub exact: Option<ExactSummary>,
    /// Of Poisson disks that were not moved.
    pub disks: Option<DiskSummary>,
    /// Root mean square step of every iteration of the last level, in its spacings.
    pub steps: Vec<f64>,
    /// With [`crate::Method::CoarseToFine`].
    pub features: Option<FeatureSummary>,
    /// Number of vertices that the attempt was to have.
    pub vertices: usize,
    /// Number of attempts up to this one.
    pub attempts: u32,
}

/// What is wrong with a mesh.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    pub kind: FaultKind,
    /// A place where it is, in the unit-diagonal frame.
    pub at: Option<DVec3>,
}

/// Kinds of faults, from the least to the worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FaultKind {
    /// So many faces intersect others where none of the input did.
    Intersections(usize),
    /// A part of the surface is left out.
    Missing,
    /// The topology differs from the input's.
    Topology,
}

impl Fault {
    /// As text, with the place in the input's units.
    pub fn describe(&self, frame: &UnitFrame) -> String {
        let what = match self.kind {
            FaultKind::Topology => "components, handles or boundary loops of the surface are lost".to_owned(),
            FaultKind::Missing => "a part of the surface is left out".to_owned(),
            FaultKind::Intersections(1) => "1 face intersects others".to_owned(),
            FaultKind::Intersections(count) => format!("{count} faces intersect others"),
        };
        let Some(at) = self.at else { return what };
        let decimals = decimals(frame.scale);
        let [x, y, z] = frame.from_unit(at).to_array();
        format!("{what} near ({x:.decimals$}, {y:.decimals$}, {z:.decimals$})")
    }
}
