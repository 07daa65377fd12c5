//! The outcome of an attempt.

use super::result::{ExactSummary, FeatureSummary, MetricQuality, ShorterEdges};
use super::small_angles::MendingCounts;
use crate::mesh::forced_angles::ForcedAngles;
use crate::mesh::quality::angle_below;
use crate::mesh::spacing;
use crate::mesh::submesh::{used_vertices, without_unused_vertices};
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
    /// The faces of the vertices in tangent planes, if the method has some and they were asked for.
    pub tangent_faces: Option<Vec<Vec<DVec3>>>,
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
    /// With [`crate::Sizing::Anisotropic`].
    pub metric: Option<MetricQuality>,
    /// What was done about small angles.
    pub mended: MendingCounts,
    /// Number of attempts up to this one.
    pub attempts: u32,
}

impl Outcome {
    /// Takes the mesh, without vertices that no triangle has, as faulty ones may have them.
    pub fn take_mesh(&mut self) -> TriMesh {
        let TriMesh { vertices, triangles } = std::mem::take(&mut self.mesh);
        let is_used = used_vertices(vertices.len(), &triangles);
        if !is_used.contains(&false) {
            return TriMesh { vertices, triangles };
        }
        if let Some(faces) = &mut self.tangent_faces {
            let mut uses = is_used.iter();
            faces.retain(|_| uses.next().is_none_or(|used| *used));
        }
        without_unused_vertices(&TriMesh { vertices, triangles: Vec::new() }, triangles)
    }

    /// Whether the mesh has a fault for which it may be refused, other than slivers.
    pub fn is_refused(&self) -> bool {
        self.fault.as_ref().is_some_and(Fault::is_refused)
    }

    /// Whether its triangles are bad all over, as those of a surface that was only simplified.
    pub fn is_bad_all_over(&self) -> bool {
        self.fault.as_ref().is_some_and(|fault| fault.kind == FaultKind::SliversAllOver)
    }
}

/// Angles below this many degrees are slivers, unless a corner of the input's shape has such an angle.
pub(crate) const SLIVER: f64 = 1.0;

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
    /// This many triangles have angles that a mesh should not have and the input's shape does not have. Not a
    /// reason to refuse the mesh.
    Slivers(usize),
    /// This many faces intersect others where none of the input did.
    Intersections(usize),
    /// A part of the surface is left out.
    Missing,
    /// A large fraction of the triangles has such angles or nearly such. Not a reason to refuse the mesh,
    /// either.
    SliversAllOver,
    /// The topology differs from the input's.
    Topology,
}

/// Narrow triangles have an angle below this many degrees.
const NARROW: f64 = 10.0;
/// A mesh is bad all over if this share of its triangles is narrow.
const ALL_OVER: f64 = 0.2;

/// Whether a large share of a mesh's triangles is narrow.
pub(crate) fn is_bad_all_over(mesh: &TriMesh) -> bool {
    let faces = mesh.triangles.len();
    let narrow =
        (0..faces).into_par_iter().filter(|t| angle_below(mesh.corners(*t), NARROW).is_some()).count();
    narrow as f64 > ALL_OVER * faces as f64
}

/// The triangles of a mesh of a surface with an angle that makes them slivers and that no corner of the
/// surface forces: the angle in degrees and the index.
pub(crate) fn slivers(mesh: &TriMesh, surface: &TriMesh, feature_angle: f64) -> Vec<(f64, u32)> {
    let angle = |t: usize| angle_below(mesh.corners(t), SLIVER);
    if (0..mesh.triangles.len()).into_par_iter().all(|t| angle(t).is_none()) {
        return Vec::new();
    }
    let spacing = spacing(surface.area(), mesh.vertices.len());
    let unforced = ForcedAngles::of(surface, SLIVER, feature_angle).unforced(mesh, SLIVER, spacing);
    unforced.into_iter().filter_map(|t| angle(t).map(|angle| (angle, t as u32))).collect()
}

impl Fault {
    /// Whether a mesh may be refused for it. Slivers are not a reason: the warning of small angles reports
    /// them.
    pub fn is_refused(&self) -> bool {
        !matches!(self.kind, FaultKind::Slivers(_) | FaultKind::SliversAllOver)
    }

    /// The fault of a mesh without the topology of the input, or with vertices that no triangle uses; `at` is
    /// a place where it is.
    pub fn topology(mesh: &TriMesh, input: &Topology, at: Option<DVec3>) -> Option<Self> {
        let got = topology(mesh);
        let is_sound = got.matches(input) && got.vertices == mesh.vertices.len();
        (!is_sound).then_some(Self { kind: FaultKind::Topology, at })
    }

    /// The worst sliver of a mesh on a surface, if there is any that no corner of the surface forces.
    pub fn sliver(mesh: &TriMesh, surface: &TriMesh, feature_angle: f64) -> Option<Self> {
        let slivers = slivers(mesh, surface, feature_angle);
        let (_, worst) = slivers.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let at = mesh.corners(worst as usize).into_iter().sum::<DVec3>() / 3.0;
        Some(Self { kind: FaultKind::Slivers(slivers.len()), at: Some(at) })
    }

    /// The error for a mesh with this fault; `vertices` is the number asked for.
    pub fn refusal(&self, vertices: usize, input: &Topology, frame: &UnitFrame) -> Error {
        let problem =
            format!("could not build a valid mesh with {vertices} vertices: {}", self.describe(frame));
        let repair = if input.is_manifold() { "" } else { "repair the input there (`weld` closes cracks), " };
        let remedy =
            format!("{repair}ask for more than {vertices}, or accept it with `shortage` best-effort");
        Error::input(None, problem, remedy)
    }

    /// As text, with the place in the input's units.
    pub fn describe(&self, frame: &UnitFrame) -> String {
        let what = match self.kind {
            FaultKind::Slivers(_) | FaultKind::SliversAllOver => {
                format!("some angles are below {SLIVER} degree")
            }
            FaultKind::Topology => "components, handles or boundary loops of the surface are lost".to_owned(),
            FaultKind::Missing => "a part of the surface is left out".to_owned(),
            FaultKind::Intersections(1) => "1 face intersects others".to_owned(),
            FaultKind::Intersections(count) => format!("{count} faces intersect others"),
        };
        let Some(at) = self.at else { return what };
        let decimals = decimals(frame.scale);
        let [x, y, z] = frame.to_input_units(at).to_array();
        format!("{what} near ({x:.decimals$}, {y:.decimals$}, {z:.decimals$})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_without_triangles_are_left_out_with_their_faces() {
        let vertices = [0.0, 1.0, 2.0, 3.0, 4.0].map(|x| DVec3::new(x, x * x, 0.0)).to_vec();
        let mesh = TriMesh { vertices: vertices.clone(), triangles: vec![[4, 0, 2]] };
        let faces = vertices.iter().map(|p| vec![*p]).collect();
        let mut outcome = Outcome { mesh, tangent_faces: Some(faces), ..Outcome::default() };
        let taken = outcome.take_mesh();
        let left = [0, 2, 4].map(|v: usize| vertices[v]);
        assert_eq!((taken.vertices.as_slice(), taken.triangles.as_slice()), (&left[..], &[[2, 0, 1]][..]));
        assert_eq!(outcome.tangent_faces.unwrap(), left.map(|p| vec![p]));
    }
}
