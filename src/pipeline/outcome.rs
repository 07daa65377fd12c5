//! The outcome of an attempt.

use super::result::{ExactSummary, FeatureSummary, ShorterEdges};
use super::small_angles::MendingCounts;
use crate::mesh::quality::{angle_below, quality};
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::{UnitFrame, decimals};
use crate::polish::Outlier;
use crate::sites::connect::ConnectCounts;
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::poisson::DiskSummary;
use crate::stages::flags::FlagCounts;
use crate::{Error, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

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
    /// Places of the surface that the fit left far from the mesh.
    pub outliers: Vec<Outlier>,
    /// Where edges are shorter than elsewhere so that nothing is left out.
    pub shorter_edges: Option<ShorterEdges>,
    /// What was done about small angles.
    pub mended: MendingCounts,
    /// Number of attempts up to this one.
    pub attempts: u32,
}

impl Outcome {
    /// Whether the mesh has a fault for which it may be refused: slivers are none.
    pub fn is_refused(&self) -> bool {
        self.fault.as_ref().is_some_and(|fault| fault.kind != FaultKind::Slivers)
    }
}

/// Angles below this many degrees are slivers, unless the input has some of that kind.
const SLIVER: f64 = 1.0;

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
    /// There are angles that a mesh should not have, and the input has not. No reason to refuse it.
    Slivers,
    /// So many faces intersect others where none of the input did.
    Intersections(usize),
    /// A part of the surface is left out.
    Missing,
    /// The topology differs from the input's.
    Topology,
}

/// The triangles of a mesh with an angle that makes them slivers: the angle in degrees and the index.
pub(crate) fn slivers(mesh: &TriMesh) -> Vec<(f64, u32)> {
    let sliver = |t: u32| angle_below(mesh.corners(t as usize), SLIVER).map(|angle| (angle, t));
    (0..mesh.triangles.len() as u32).into_par_iter().filter_map(sliver).collect()
}

impl Fault {
    /// The fault of a mesh without the topology of the input, or with vertices that no triangle uses; `at` is
    /// a place where it is.
    pub fn topology(mesh: &TriMesh, input: &Topology, at: Option<DVec3>) -> Option<Self> {
        let got = topology(mesh);
        let is_sound = got.matches(input) && got.vertices == mesh.vertices.len();
        (!is_sound).then_some(Self { kind: FaultKind::Topology, at })
    }

    /// The worst sliver of a mesh on a surface, if there is any.
    pub fn sliver(mesh: &TriMesh, surface: &TriMesh) -> Option<Self> {
        let (_, worst) = slivers(mesh).into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Twice, because a result may be a little worse than an input of that kind.
        let of_surface = || quality(surface).is_some_and(|quality| quality.theta_min > 2.0 * SLIVER);
        let at = mesh.corners(worst as usize).into_iter().sum::<DVec3>() / 3.0;
        of_surface().then_some(Self { kind: FaultKind::Slivers, at: Some(at) })
    }

    /// The error for a mesh with this fault: `vertices` is the number asked for, and `tried` the largest that
    /// was tried.
    pub fn refusal(&self, [vertices, tried]: [usize; 2], input: &Topology, frame: &UnitFrame) -> Error {
        let problem = format!("no mesh of {vertices} vertices without a fault: {}", self.describe(frame));
        let repair = if input.is_manifold() { "" } else { "repair the input there (`weld` closes cracks), " };
        let remedy = format!("{repair}ask for more than {tried}, or accept it with `shortage` best-effort");
        Error::input(None, problem, remedy)
    }

    /// As text, with the place in the input's units.
    pub fn describe(&self, frame: &UnitFrame) -> String {
        let what = match self.kind {
            FaultKind::Slivers => format!("there are angles below {SLIVER} degree"),
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
