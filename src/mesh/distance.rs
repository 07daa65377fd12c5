//! Certified Hausdorff distances and sampled root mean square distances between two surfaces.

use std::ops::RangeInclusive;

use glam::DVec3;
use serde::Serialize;

use super::TriMesh;
use super::bvh::Bvh;
use super::hausdorff::{Effort, Indexed, one_sided};
use super::quality::power_of_two_scale;
use super::sampling::Samples;
use crate::{Error, ProgressToken, Result};

/// Gap between the ends of a Hausdorff distance over the upper end, unless another one is asked for.
pub const DEFAULT_ACCURACY: f64 = 0.01;
/// Gaps that can be asked for.
pub const ACCURACIES: RangeInclusive<f64> = 1e-6..=0.5;

/// A gap of this share of the diagonal is small enough, whatever the accuracy: half of the last digit that is
/// printed.
const FLOOR: f64 = 5e-7;
/// Samples on the edges and as many on the faces of either mesh, at the least.
const MIN_SAMPLES: usize = 50_000;
/// Samples for each vertex where only meshes of one surface are compared.
const FEW_SAMPLES_PER_VERTEX: usize = 8;
/// Samples of each kind per vertex of the larger mesh, at the least.
const SAMPLES_PER_VERTEX: usize = 1;
/// How far beyond the reference's size a mesh may reach: fourth powers must stay in the range of f64.
const MAX_RATIO: f64 = 1e60;
/// Distances that differ by this share of them are as good as equal.
const NEGLIGIBLE: f64 = 1e-6;

/// Distances in percent of the diagonal of the reference's bounding box, which spans all its vertices, used
/// or not.
///
/// Hausdorff distances are certified: each is an interval that contains the distance between the surfaces, in
/// every point of them. Root mean squares are of samples, half of them evenly along the edges and half evenly
/// over the faces, as in Cignoni, Rocchini and Scopigno, "Metro", 1998.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Distances {
    /// Upper end of the Hausdorff distance to the reference: no point of the mesh is farther from it.
    pub hausdorff_to_reference: f64,
    /// Lower end: some point of the mesh is so far from the reference.
    pub hausdorff_to_reference_lower: f64,
    /// Upper end of the Hausdorff distance from the reference: no point of it is farther from the mesh.
    pub hausdorff_from_reference: f64,
    /// Lower end: some point of the reference is so far from the mesh.
    pub hausdorff_from_reference_lower: f64,
    /// The larger upper end.
    pub hausdorff: f64,
    /// The larger lower end.
    pub hausdorff_lower: f64,
    /// Whether the ends are as close as asked for. If not, the budget of subdivisions ran out (2 million, and
    /// 30 for each triangle of both meshes), or one mesh is so much larger that rounding is more than that.
    pub hausdorff_close: bool,
    /// Root mean square distance of the samples on the mesh to the reference.
    pub rms_to_reference: f64,
    /// Root mean square distance of the samples on the reference to the mesh.
    pub rms_from_reference: f64,
    /// The larger of the two.
    pub rms: f64,
}

/// Distances between `mesh` and `reference`, both ways, with the [`DEFAULT_ACCURACY`].
///
/// # Errors
/// As [`distances_within`].
pub fn distances(mesh: &TriMesh, reference: &TriMesh, progress: &ProgressToken) -> Result<Distances> {
    distances_within(mesh, reference, DEFAULT_ACCURACY, progress)
}

/// Distances between `mesh` and `reference`, both ways.
///
/// The ends of the Hausdorff distances are apart by at most `accuracy` of the upper end, or by 5e-7 of the
/// diagonal, whichever is more, unless [`Distances::hausdorff_close`] is false. They contain the distance
/// even if all roundings of f64 add up, for which they leave 1e-12 of the size of both meshes together. At
/// least 100,000 samples on either mesh make up the root mean squares. The result is the same on every run
/// and for every number of threads.
///
/// # Errors
/// [`Error::Usage`] if `accuracy` is not among the [`ACCURACIES`]. [`Error::Input`] if either mesh has no
/// faces or a coordinate that is not finite, if the reference has no extent, or if the mesh reaches 1e60
/// times as far as the reference. [`Error::Cancelled`]. Panics if an index is out of range.
pub fn distances_within(
    mesh: &TriMesh,
    reference: &TriMesh,
    accuracy: f64,
    progress: &ProgressToken,
) -> Result<Distances> {
    check_accuracy(accuracy)?;
    measure(mesh, reference, accuracy, usual_samples(mesh, reference), progress)
}

/// As many samples on the edges, and on the faces, as there are vertices, and many for small meshes.
pub(crate) fn usual_samples(mesh: &TriMesh, reference: &TriMesh) -> usize {
    let vertices = mesh.vertices.len().max(reference.vertices.len());
    MIN_SAMPLES.max(SAMPLES_PER_VERTEX * vertices)
}

/// Like [`distances`], with `samples` samples on the edges and as many on the faces of either mesh.
///
/// # Errors
/// As [`distances_within`].
pub fn distances_sampled(
    mesh: &TriMesh,
    reference: &TriMesh,
    samples: usize,
    progress: &ProgressToken,
) -> Result<Distances> {
    measure(mesh, reference, DEFAULT_ACCURACY, samples, progress)
}

/// The root mean square distance between two meshes in a common frame and unit, the larger of both ways, from
/// a few samples for each vertex of the first.
///
/// # Errors
/// [`Error::Cancelled`].
pub(crate) fn rms_distance(mesh: &TriMesh, reference: &TriMesh, progress: &ProgressToken) -> Result<f64> {
    let samples = FEW_SAMPLES_PER_VERTEX * mesh.vertices.len();
    let (mesh_bvh, reference_bvh) = rayon::join(|| Bvh::new(mesh), || Bvh::new(reference));
    let mesh = Indexed { mesh, bvh: &mesh_bvh };
    let reference = Indexed { mesh: reference, bvh: &reference_bvh };
    let (to, from) = rayon::join(
        || rms_one_way(mesh, reference, samples, progress),
        || rms_one_way(reference, mesh, samples, progress),
    );
    Ok(to?.max(from?))
}

/// The root mean square distance of `samples` samples on the edges of a mesh, and as many on its faces, from
/// another one.
fn rms_one_way(from: Indexed, to: Indexed, samples: usize, progress: &ProgressToken) -> Result<f64> {
    let distance_sq =
        |p: DVec3, rank: &mut usize| to.bvh.closest_from(p, rank).map(|found| found.distance_sq);
    Samples::new(from.mesh, from.bvh, samples).tally(distance_sq, progress).map(|tally| tally.rms())
}

/// Checks that Hausdorff distances can be this accurate.
///
/// # Errors
/// [`Error::Usage`].
pub(crate) fn check_accuracy(accuracy: f64) -> Result<()> {
    if ACCURACIES.contains(&accuracy) {
        return Ok(());
    }
    let problem = format!("`accuracy` {accuracy} is out of range");
    let remedy = format!("use {:e} to {}", ACCURACIES.start(), ACCURACIES.end());
    Err(Error::option("accuracy", problem, remedy))
}

fn measure(
    mesh: &TriMesh,
    reference: &TriMesh,
    accuracy: f64,
    samples: usize,
    progress: &ProgressToken,
) -> Result<Distances> {
    check_faces("mesh", mesh)?;
    check_faces("reference mesh", reference)?;
    let (mesh, reference, diagonal) = placed(mesh, reference)?;
    let (mesh_bvh, reference_bvh) = rayon::join(|| Bvh::new(&mesh), || Bvh::new(&reference));
    let mesh = Indexed { mesh: &mesh, bvh: &mesh_bvh };
    let reference = Indexed { mesh: &reference, bvh: &reference_bvh };
    let steps = Effort::usual_steps(mesh.mesh, reference.mesh);
    let effort = Effort { relative: accuracy, absolute: FLOOR * diagonal, steps };
    // Very far apart, all points are equally far.
    let least = mesh_bvh.bounds().distance_to(&reference_bvh.bounds());
    let rms = |from: Indexed, to: Indexed, upper: f64| {
        let alike = upper - least <= NEGLIGIBLE * upper && upper > 0.0;
        if alike {
            return Ok(upper);
        }
        rms_one_way(from, to, samples, progress)
    };
    let one_way = |from: Indexed, to: Indexed| {
        let largest = one_sided(from, to, effort, progress)?;
        Ok::<_, Error>((rms(from, to, largest.upper)?, largest))
    };
    // Each way has steps in order, and the two ways run in parallel.
    let (to, from) = rayon::join(|| one_way(mesh, reference), || one_way(reference, mesh));
    let ((rms_to, to), (rms_from, from)) = (to?, from?);
    let percent = 100.0 / diagonal;
    Ok(Distances {
        hausdorff_to_reference: to.upper * percent,
        hausdorff_to_reference_lower: to.lower * percent,
        hausdorff_from_reference: from.upper * percent,
        hausdorff_from_reference_lower: from.lower * percent,
        hausdorff: to.upper.max(from.upper) * percent,
        hausdorff_lower: to.lower.max(from.lower) * percent,
        hausdorff_close: to.close && from.close,
        rms_to_reference: rms_to * percent,
        rms_from_reference: rms_from * percent,
        rms: rms_to.max(rms_from) * percent,
    })
}

/// Refuses a mesh without faces.
pub(crate) fn check_faces(name: &str, mesh: &TriMesh) -> Result<()> {
    if !mesh.triangles.is_empty() {
        return Ok(());
    }
    let problem = format!("the {name} has no faces to measure distances to");
    Err(Error::input(None, problem, "give a mesh with at least one triangle"))
}

/// Both meshes with the reference at the origin and of a size of about one, so that squares stay in range and
/// roundings are small, and its diagonal then. The reference may be points.
pub(crate) fn placed(mesh: &TriMesh, reference: &TriMesh) -> Result<(TriMesh, TriMesh, f64)> {
    for (name, mesh) in [("mesh", mesh), ("reference", reference)] {
        if let Some(v) = mesh.vertices.iter().position(|v| !v.is_finite()) {
            let problem = format!("the {name} has a coordinate that is not a finite number");
            return Err(Error::input(Some(format!("vertex {v}")), problem, "remove or repair that vertex"));
        }
    }
    let scale = power_of_two_scale(reference.vertices.iter().copied());
    let origin = reference.vertices.first().map_or(DVec3::ZERO, |first| *first * scale);
    let place = |mesh: &TriMesh| TriMesh {
        vertices: mesh.vertices.iter().map(|&v| v * scale - origin).collect(),
        triangles: mesh.triangles.clone(),
    };
    let (mesh, reference) = (place(mesh), place(reference));
    let diagonal = reference.bounds().map_or(0.0, |[lo, hi]| lo.distance(hi));
    if diagonal == 0.0 {
        let problem = "all vertices of the reference are at one point";
        return Err(Error::input(None, problem, "give a reference with some extent"));
    }
    let largest = mesh.vertices.iter().fold(0.0, |m: f64, v| m.max(v.abs().max_element()));
    if largest > MAX_RATIO {
        let problem = "the mesh and its reference differ too much in size or place to measure distances";
        return Err(Error::input(None, problem, "check that both are in the same unit"));
    }
    Ok((mesh, reference, diagonal))
}
