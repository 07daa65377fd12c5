//! The result of a run and its summary.

use crate::TriMesh;
use crate::gpu::StageTime;
use crate::measure::Measures;
use crate::mesh::cell_mesh::{CellMesh, CellSummary};
use crate::mesh::correspondence::Correspondence;
use crate::mesh::features::{CurveKind, Discarded, Features};
use crate::mesh::repair::RepairCounts;
use crate::mesh::topology::Topology;
use crate::pipeline::warning::WarningCode;
use crate::sites::connect::ConnectCounts;
use crate::sites::poisson::DiskSummary;
use crate::sites::restricted_voronoi::Energy;
use crate::stages::flags::FlagCounts;
use serde::Serialize;

/// The result of a run.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Remeshed {
    /// The new mesh, in the input's frame.
    pub mesh: TriMesh,
    /// Where its vertices and faces lie on the input as it was given, if [`crate::Options::correspondence`]
    /// asks for it.
    pub correspondence: Option<Correspondence>,
    /// The cells of its vertices, if [`crate::Options::cells`] asks for them.
    pub cells: Option<CellMesh>,
    /// Figures of the run.
    pub summary: Summary,
}

/// Figures of a run, as in the report.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Summary {
    /// What was repaired of the input.
    pub repaired: RepairCounts,
    /// Topology of the repaired input.
    pub input: Topology,
    /// Faces of the repaired input that intersect others; `None` if they were not looked for, as the result
    /// has none.
    pub input_self_intersecting_faces: Option<usize>,
    /// Components that were remeshed by local operations or simplified: they had too few vertices for cells,
    /// or cells did not give their topology or their shape.
    pub collapsed_components: usize,
    /// What was unusual about the input, and what was done about it.
    pub remarks: Vec<String>,
    /// Figures of the result, as far as [`crate::Options::measures`] asks for them; distances are to the
    /// repaired input.
    pub output: Measures,
    /// Number of random starts, vertex counts and shorter edges that were tried; above 1 if there are hardly
    /// enough vertices, or if even edges leave something out.
    pub attempts: u32,
    /// Iterations done.
    pub iterations: u32,
    /// Whether the step fell below the tolerance.
    pub converged: bool,
    /// Whether iterations or rounds were left out because the run was asked to finish early.
    pub finished_early: bool,
    /// Root mean square step of every iteration, in spacings.
    pub steps: Vec<f64>,
    /// Edge length of a perfect layout, in the input's units.
    pub spacing: f64,
    /// The smallest and the largest edge length in the size field, in the input's units; `None` if all are
    /// equal.
    pub edge_lengths: Option<[f64; 2]>,
    /// Sites with special faces after the last iteration.
    pub flags: FlagCounts,
    /// Counts from connecting the sites.
    pub connected: ConnectCounts,
    /// Figures of the last exact cells; only with exact faces.
    pub exact: Option<ExactSummary>,
    /// Figures of the Poisson-disk sampling, in the input's units; only if its points were not moved.
    pub disks: Option<DiskSummary>,
    /// How evenly the vertices are spread over the repaired input; only with exact faces, if everything is
    /// measured.
    pub energy: Option<Energy>,
    /// Features that were kept; only with [`crate::Method::CoarseToFine`].
    pub features: Option<FeatureSummary>,
    /// The cells of the vertices, if they were asked for.
    pub cells: Option<CellSummary>,
    /// Small angles of the result; only with [`crate::Method::CoarseToFine`], if they are to be mended.
    pub small_angles: Option<super::SmallAngleSummary>,
    /// How even triangles are in the metric of [`crate::Sizing::Anisotropic`], if that was asked for.
    pub metric: Option<MetricQuality>,
    /// Where edges are shorter than elsewhere, with [`crate::Sizing::Automatic`]; `None` if nowhere.
    pub shorter_edges: Option<ShorterEdges>,
    /// What [`crate::Sizing::Deviation`] led to, if that was asked for.
    pub deviation: Option<super::DeviationSummary>,
    /// What is wrong with the result; empty if it is valid.
    pub warnings: Vec<String>,
    /// What each of these warnings is about, in the same order.
    pub warning_codes: Vec<WarningCode>,
    /// Time and memory.
    pub timings: RunTimings,
}

impl Summary {
    /// Adds a warning.
    pub fn warn(&mut self, code: WarningCode, text: impl Into<String>) {
        self.warnings.push(text.into());
        self.warning_codes.push(code);
    }

    /// Adds several, such as those of [`crate::io::Loaded::warnings`].
    pub fn warn_all(&mut self, warnings: impl IntoIterator<Item = (WarningCode, String)>) {
        warnings.into_iter().for_each(|(code, text)| self.warn(code, text));
    }
}

/// Features of the input, and the vertices of the result on them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FeatureSummary {
    /// Number of curves: chains of sharp edges, boundary edges and others that are kept.
    pub curves: usize,
    /// Number of corners, where curves end, branch or turn sharply.
    pub corners: usize,
    /// Patches of the surface between the curves.
    pub patches: usize,
    /// Vertices of the result on curves.
    pub curve_sites: usize,
    /// Length of the curves that are sharp edges, in the input's units.
    pub sharp_length: f64,
    /// Sharp edges that are not features at this spacing; lengths in the input's units.
    pub discarded: Discarded,
}

impl FeatureSummary {
    /// The counts and lengths of these features, without sites.
    pub(crate) fn of(features: &Features) -> Self {
        Self {
            discarded: features.discarded,
            curves: features.curves.len(),
            corners: features.corners.len(),
            patches: features.patch_count,
            curve_sites: 0,
            sharp_length: (features.curves.iter())
                .filter(|curve| curve.kind == CurveKind::Sharp)
                .map(|curve| curve.length)
                .sum(),
        }
    }

    /// The same without its sharp edges, which are given up.
    pub(crate) fn without_sharp_edges(self) -> Self {
        let mut discarded = self.discarded;
        discarded.give_up(self.curves, self.sharp_length);
        Self { curves: 0, corners: 0, patches: 1, sharp_length: 0.0, discarded, ..self }
    }

    /// Multiplies the lengths by `unit`.
    pub(crate) fn in_units(&mut self, unit: f64) {
        self.sharp_length *= unit;
        self.discarded.in_units(unit);
    }
}

/// How even triangles are in a metric, in which lengths depend on the direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MetricQuality {
    /// The mean quality of the triangles, 0 to 1.
    pub mean_quality: f64,
    /// The smallest angle in degrees.
    pub min_angle: f64,
    /// The mean over the triangles of the quotient of the longest and the shortest length that edges are to
    /// have there.
    pub mean_aspect: f64,
}

/// Where edges are shorter than elsewhere, since a part of the input would be left out: such as a fold that
/// even edges bridge.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ShorterEdges {
    /// Places that earlier attempts left out, at least two edge lengths apart, in the input's units: those of
    /// the first attempt, with even edges, before those of the next, the farthest from the mesh first.
    pub places: Vec<[f64; 3]>,
    /// The shortest edge length that is wanted, as a share of the longest.
    pub shortest: f64,
    /// Vertices that this takes from elsewhere.
    pub vertices: usize,
}

/// Time and memory of a run.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct RunTimings {
    /// Device time by kernel and kind of copy.
    pub stages: Vec<StageTime>,
    /// Wall time by phase.
    pub phases: Vec<PhaseTime>,
    /// Wall time of all phases in milliseconds.
    pub wall_milliseconds: f64,
    /// How much of it the host waited for the device or, once the input was prepared, for the first kernels
    /// to be compiled; the rest is host code. Other runs on the same device at the same time count as well.
    pub waiting_milliseconds: f64,
    /// Largest device memory in use at once, in bytes.
    pub peak_device_bytes: u64,
}

/// Wall time of a phase of the run.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PhaseTime {
    /// Name of the phase.
    pub name: &'static str,
    /// Wall time in milliseconds, with waiting for the device.
    pub milliseconds: f64,
    /// How much of it is waiting; the rest is host code.
    pub waiting_milliseconds: f64,
}

/// Figures of the exact cells of the last iteration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ExactSummary {
    /// Sum of their areas relative to the surface's.
    pub area: f64,
    /// Sites without a cell: another one has the same position.
    pub empty_cells: usize,
    /// Pairs of a triangle and a site that may have a part of it.
    pub pairs: usize,
    /// Triangles left to the host, over all iterations, because they meet the cells of too many sites.
    pub crowded: usize,
}
