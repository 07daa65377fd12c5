//! Edge lengths for a largest deviation, found in several runs: each shortens edges where the mesh of the
//! last one was too far from the surface, and lengthens them where it was closer than need be. Where some
//! places are still too far, vertices are inserted (`coarse_to_fine/insert`).

pub(super) mod lengths;
pub(super) mod measured;

use super::clock::Clock;
use super::{GivenLengths, Made, RunInput, make};
use crate::gpu::Device;
use crate::mesh::bvh::Bvh;
use crate::mesh::distance::Distances;
use crate::mesh::small_angles::{SmallAnglePlace, small_angle_places};
use crate::mesh::spacing;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::Length;
use crate::pipeline::prepare::repaired_for;
use crate::progress::ProgressReporter;
use crate::{Error, ProgressToken, Result, TriMesh};
use lengths::Lengths;
use measured::{Depth, Measured, Reference};
use serde::Serialize;

/// Number of first runs, in which no vertices are inserted, since edge lengths still change much.
const ROUGH: u32 = 2;
/// Maximum number of runs.
const ROUNDS: u32 = 6;
/// A run must do with this share of the vertices of the best one for another to follow.
const GAIN: f64 = 0.95;
/// Vertices that a mesh may have more for each small angle less.
const VERTICES_PER_ANGLE: usize = 100;
/// Faces with small angles count as this many largest deviations from the surface.
const NARROW: f64 = 1.5;
/// Share of the largest deviation that is made use of; the rest is for the rounding of what is written.
const USED: f64 = 0.999;
/// The least edge length of a run, in its spacings, if none is given.
const LEAST: f64 = 0.125;

/// What [`Sizing::Deviation`](crate::options::Sizing::Deviation) led to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct DeviationSummary {
    /// The largest deviation that was asked for, in percent of the diagonal of the input's bounding box.
    pub asked: f64,
    /// The larger of the two Hausdorff distances, also in percent: no point of the result is farther from the
    /// input, nor the other way round.
    pub reached: f64,
    /// Whether `reached` is as small as asked for.
    pub is_reached: bool,
    /// Runs that it took.
    pub runs: u32,
    /// About how many vertices would do; only if they do not.
    pub enough: Option<usize>,
}

impl DeviationSummary {
    /// If it is not as small as asked for; with a number of vertices given, what would do.
    pub(super) fn warning(&self, vertices: usize) -> Option<String> {
        let Self { asked, reached, enough, .. } = self;
        let remedy = (enough.filter(|_| vertices > 0))
            .map_or_else(String::new, |enough| format!(": about {enough} vertices would reach it"));
        let problem =
            format!("the deviation is {reached:.4} % of the input's diagonal instead of {asked:.4} %");
        (!self.is_reached).then(|| problem + &remedy)
    }
}

/// How a largest deviation was reached, or not.
#[derive(Default)]
pub(super) struct Course {
    /// In diagonals; `None` if there is none.
    most: Option<f64>,
    runs: u32,
    enough: Option<usize>,
}

impl Course {
    /// With what was measured of the result.
    pub fn summary(&self, distances: Option<Distances>) -> Option<DeviationSummary> {
        let asked = 100.0 * self.most?;
        let reached = distances.map_or(f64::INFINITY, |distances| distances.hausdorff);
        let is_reached = reached <= asked;
        let enough = self.enough.filter(|_| !is_reached);
        Some(DeviationSummary { asked, reached, is_reached, runs: self.runs, enough })
    }
}

/// A run and how far its mesh is from the surface, in diagonals.
struct Candidate {
    made: Made,
    vertices: usize,
    /// Triangles with an angle below the least one.
    small: usize,
    upper: f64,
    enough: Option<usize>,
}

impl Candidate {
    /// One of which nothing is known but its mesh, in the unit of the surface.
    fn unmeasured(made: Made, mesh: &TriMesh) -> Self {
        Self { made, vertices: mesh.vertices.len(), small: 0, upper: f64::INFINITY, enough: None }
    }

    fn has_fault(&self) -> bool {
        self.made.outcome.fault.is_some()
    }

    fn cost(&self) -> usize {
        self.vertices + VERTICES_PER_ANGLE * self.small
    }

    /// Whether it is close enough and has no fault.
    fn is_good(&self, most: f64) -> bool {
        self.upper <= most && !self.has_fault()
    }

    /// Whether it is better than another one: without a fault, close enough with fewer vertices, or closer.
    fn is_better_than(&self, other: &Self, most: f64) -> bool {
        let [fault, other_fault] = [self, other].map(Self::has_fault);
        if fault != other_fault {
            return other_fault;
        }
        match (self.upper <= most, other.upper <= most) {
            (true, true) => self.cost() < other.cost(),
            (close, other_close) => close || (!other_close && self.upper < other.upper),
        }
    }
}

/// The mesh with the fewest vertices that is close enough, or the closest one.
///
/// # Errors
/// As [`make`].
pub(super) fn make_within(
    device: &Device,
    input: RunInput,
    most: Length,
    progress: &mut ProgressReporter,
    clock: &mut Clock,
) -> Result<(Made, Course)> {
    let RunInput { mesh, repaired, options, gives_up_fixed, .. } = input;
    let repaired = progress.during(|token| repaired_for(mesh, repaired, options, token))?;
    let frame = UnitFrame::of(&repaired.mesh)?;
    let vertices = repaired.mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect();
    let surface = TriMesh { vertices, triangles: repaired.mesh.triangles.clone() };
    let bvh = Bvh::new(&surface);
    let method = &options.coarse_to_fine;
    let given = [method.min_edge, method.max_edge].map(|length| length.map(|l| l.share_of(frame.scale)));
    let most = most.share_of(frame.scale);
    let used = USED * most;
    let reference = Reference { surface: &surface, bvh: &bvh, most: used };
    let mut lengths = progress.during(|_| Ok(Lengths::new(&surface, most, given, options)))?;
    clock.end_phase("prepare");
    let is_free = options.vertices == 0;
    if !is_free {
        lengths.scale_to(options.vertices);
    }
    let mut best: Option<Candidate> = None;
    let (mut runs, mut attempts) = (0, 0);
    while runs < ROUNDS {
        let vertices = if is_free { count(lengths.vertices())? } else { options.vertices };
        let shortest = lengths.least().min(LEAST * spacing(surface.area(), vertices));
        let shortest = Length::OfDiagonal(shortest);
        let run = RunInput {
            vertices,
            lengths: Some(GivenLengths { values: &lengths.values, shortest }),
            deviation: (is_free && runs >= ROUGH).then_some(used),
            attempts,
            gives_up_fixed,
            ..RunInput::new(mesh, Some(repaired.clone()), options)
        };
        let made = make(device, run, progress, clock)?;
        attempts = made.outcome.attempts;
        let result = made.unit_mesh();
        let measured =
            progress.during(|progress| measure_for_next(&reference, &result, &lengths, progress))?;
        clock.end_phase("deviation");
        runs += 1;
        let Some((mut found, upper)) = measured else {
            let now = Candidate::unmeasured(made, &result);
            // Its lengths were corrected once more, so that it is closer than one that is not close enough.
            let stays = |best: &Candidate| best.is_good(used) || !best.has_fault() && now.has_fault();
            best = best.filter(stays).or(Some(now));
            break;
        };
        let enough = Some(lengths.enough(&result, &found).ceil() as usize);
        // Stretched triangles have small angles by design.
        let small = match method.sizing.aspect() {
            Some(_) => Vec::new(),
            None => small_angle_places(&result, method.min_angle, method.feature_angle),
        };
        let now = Candidate { made, vertices: result.vertices.len(), small: small.len(), upper, enough };
        let was_close = best.as_ref().filter(|best| best.is_good(used)).map(|best| best.vertices);
        let gains = was_close.is_none_or(|was| (now.vertices as f64) < GAIN * was as f64);
        if best.as_ref().is_none_or(|best| now.is_better_than(best, used)) {
            best = Some(now);
        }
        // Where curves come close to each other, shorter edges make better angles.
        let narrow = small.iter().filter(|(_, place)| *place != SmallAnglePlace::Corner);
        narrow.for_each(|(t, _)| found.of_face[*t].distance = found.of_face[*t].distance.max(NARROW * most));
        lengths.follow(&result, &found, runs - 1, if is_free { 0 } else { options.vertices });
        let is_enough = upper <= used && !is_free;
        if is_enough || !gains || progress.leave_out() {
            break;
        }
    }
    let Some(best) = best else { return Err(Error::Internal("no run was made".to_owned())) };
    Ok((best.made, Course { most: Some(most), runs, enough: best.enough }))
}

/// What is measured of a mesh for the next run, and the largest distance; `None` if the work is to finish
/// early, since no other run follows then.
fn measure_for_next(
    reference: &Reference,
    mesh: &TriMesh,
    lengths: &Lengths,
    progress: &ProgressToken,
) -> Result<Option<(Measured, f64)>> {
    let measure = |progress: &ProgressToken| {
        let found = reference.measured(mesh, &lengths.values, Depth::Coarse, progress)?;
        Ok(Some((found, reference.largest(mesh, progress)?.upper)))
    };
    progress.or_rough(measure, |_| Ok(None))
}

/// A number of vertices.
///
/// # Errors
/// [`Error::Usage`] if it is too large.
fn count(vertices: f64) -> Result<usize> {
    if vertices >= f64::from(u32::MAX) {
        let problem = format!("so small a deviation needs {vertices:.3e} vertices, more than can be indexed");
        return Err(Error::option("sizing", problem, "ask for a larger deviation"));
    }
    Ok((vertices.ceil() as usize).max(4))
}
