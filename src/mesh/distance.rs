//! Certified Hausdorff distances and sampled root mean square distances between two surfaces.

use std::ops::{Range, RangeInclusive};

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::TriMesh;
use super::bvh::Bvh;
use super::half_edges::EdgeTable;
use super::hausdorff::{Effort, Indexed, one_sided};
use super::quality::power_of_two_scale;
use super::triangle::doubled_normal;
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
/// Samples of each kind per vertex of the larger mesh, at the least.
const SAMPLES_PER_VERTEX: usize = 1;
/// How far beyond the reference's size a mesh may reach: fourth powers must stay in the range of f64.
const MAX_RATIO: f64 = 1e60;
/// Distances that differ by this share of them are as good as equal.
const NEGLIGIBLE: f64 = 1e-6;
/// Samples that one thread takes in a row, each starting its search where the last one ended.
const CHUNK: usize = 2048;
/// Multiples of these, without their integer part, fill the unit square evenly: the inverse powers of the
/// solution of `x^3 = x + 1`. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
const PLANE_SEQUENCE: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

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
    let vertices = mesh.vertices.len().max(reference.vertices.len());
    measure(mesh, reference, accuracy, MIN_SAMPLES.max(SAMPLES_PER_VERTEX * vertices), progress)
}

/// As [`distances`], with `samples` samples on the edges and as many on the faces of either mesh.
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

/// Whether Hausdorff distances can be so close.
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
    let (mesh, reference, diagonal) = placed(mesh, reference)?;
    let (mesh_bvh, reference_bvh) = (Bvh::new(&mesh), Bvh::new(&reference));
    let mesh = Indexed { mesh: &mesh, bvh: &mesh_bvh };
    let reference = Indexed { mesh: &reference, bvh: &reference_bvh };
    let steps = Effort::usual_steps(mesh.mesh, reference.mesh);
    let effort = Effort { relative: accuracy, absolute: FLOOR * diagonal, steps };
    let to = one_sided(mesh, reference, effort, progress)?;
    let from = one_sided(reference, mesh, effort, progress)?;
    // Very far apart, all points are equally far.
    let least = mesh_bvh.bounds().distance_to(&reference_bvh.bounds());
    let rms = |from: Indexed, to: Indexed, upper: f64| {
        let alike = upper - least <= NEGLIGIBLE * upper && upper > 0.0;
        if alike { Ok(upper) } else { Samples::new(from, samples).rms(to.bvh, progress) }
    };
    let (rms_to, rms_from) = (rms(mesh, reference, to.upper)?, rms(reference, mesh, from.upper)?);
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

/// Both meshes with the reference at the origin and of a size of about one, so that squares stay in range and
/// roundings are small, and its diagonal then.
fn placed(mesh: &TriMesh, reference: &TriMesh) -> Result<(TriMesh, TriMesh, f64)> {
    for (name, mesh) in [("mesh", mesh), ("reference mesh", reference)] {
        if mesh.triangles.is_empty() {
            let problem = format!("the {name} has no faces to measure distances to");
            return Err(Error::input(None, problem, "give a mesh with at least one triangle"));
        }
        if let Some(v) = mesh.vertices.iter().position(|v| !v.is_finite()) {
            let problem = format!("the {name} has a coordinate that is not a finite number");
            return Err(Error::input(Some(format!("vertex {v}")), problem, "remove or repair that vertex"));
        }
    }
    let scale = power_of_two_scale(reference.vertices.iter().copied());
    let origin = reference.vertices[0] * scale;
    let place = |mesh: &TriMesh| TriMesh {
        vertices: mesh.vertices.iter().map(|&v| v * scale - origin).collect(),
        triangles: mesh.triangles.clone(),
    };
    let (mesh, reference) = (place(mesh), place(reference));
    let diagonal = reference.bounds().map_or(0.0, |(lo, hi)| lo.distance(hi));
    if diagonal == 0.0 {
        let problem = "all vertices of the reference mesh are at one point";
        return Err(Error::input(None, problem, "give a reference with some extent"));
    }
    let largest = mesh.vertices.iter().fold(0.0, |m: f64, v| m.max(v.abs().max_element()));
    if largest > MAX_RATIO {
        let problem = "the mesh and its reference differ too much in size or place to measure distances";
        return Err(Error::input(None, problem, "check that both are in the same unit"));
    }
    Ok((mesh, reference, diagonal))
}

/// Where to sample a mesh. Vertices, edges and faces are listed in the leaf order of its hierarchy, so that
/// successive samples are near each other and each search can start from the last one's result.
struct Samples {
    vertices: Vec<DVec3>,
    edges: Vec<[u32; 2]>,
    triangles: Vec<[u32; 3]>,
    /// Length of all edges up to and including each one.
    edge_sums: Vec<f64>,
    /// Area of all triangles up to and including each one.
    area_sums: Vec<f64>,
    /// Samples on the edges, and as many on the triangles.
    count: usize,
}

impl Samples {
    fn new(Indexed { mesh, bvh }: Indexed, count: usize) -> Self {
        let mut renamed = vec![u32::MAX; mesh.vertices.len()];
        let mut vertices = Vec::with_capacity(mesh.vertices.len());
        let mut triangles = Vec::with_capacity(mesh.triangles.len());
        for &t in bvh.leaf_order() {
            triangles.push(mesh.triangles[t as usize].map(|v| {
                let name = &mut renamed[v as usize];
                if *name == u32::MAX {
                    *name = vertices.len() as u32;
                    vertices.push(mesh.vertices[v as usize]);
                }
                *name
            }));
        }
        let edges: Vec<[u32; 2]> =
            EdgeTable::new(&triangles).edges().map(|edge| edge[0].ends().into()).collect();
        let at = |v: u32| vertices[v as usize];
        let edge_sums = running_sums(edges.iter().map(|&[a, b]| at(a).distance(at(b))));
        let area_sums = running_sums(triangles.iter().map(|t| doubled_normal(t.map(at)).length()));
        Self { vertices, edges, triangles, edge_sums, area_sums, count }
    }

    /// The root mean square distance of the samples; of the vertices, if all triangles are points.
    fn rms(&self, target: &Bvh, progress: &ProgressToken) -> Result<f64> {
        let on_edges = gather(self.count, target, progress, |range, visit| {
            walk(&self.edge_sums, self.count, range, |_, edge, share| {
                let [a, b] = self.edges[edge].map(|v| self.vertices[v as usize]);
                visit(a + (b - a) * share);
            });
        })?;
        let on_faces = gather(self.count, target, progress, |range, visit| {
            walk(&self.area_sums, self.count, range, |sample, face, _| {
                let [a, b, c] = self.triangles[face].map(|v| self.vertices[v as usize]);
                let [across, along] = PLANE_SEQUENCE.map(|step| (sample as f64 * step).fract());
                visit(a + ((b - a) * (1.0 - along) + (c - a) * along) * across.sqrt());
            });
        })?;
        let mut total = on_edges.join(on_faces);
        if total.count == 0 {
            total = gather(self.vertices.len(), target, progress, |range, visit| {
                self.vertices[range].iter().for_each(|&p| visit(p));
            })?;
        }
        Ok((total.sum_sq / total.count as f64).sqrt())
    }
}

fn running_sums(sizes: impl Iterator<Item = f64>) -> Vec<f64> {
    sizes
        .scan(0.0, |sum, size| {
            *sum += size;
            Some(*sum)
        })
        .collect()
}

/// Calls `visit(sample, element, share)` for the samples in `range` of `count` that are shared out among
/// elements by size, `sums` being the running sums of the sizes; `share` is how much of its element lies
/// before the sample, 0..=1. Nothing is visited where all sizes are zero.
fn walk(sums: &[f64], count: usize, range: Range<usize>, mut visit: impl FnMut(usize, usize, f64)) {
    let total = sums.last().copied().unwrap_or(0.0);
    if total <= 0.0 {
        return;
    }
    let stand = |sample: usize| ((sample as f64 + 0.5) / count as f64) * total;
    let mut element = sums.partition_point(|&sum| sum < stand(range.start));
    for sample in range {
        let place = stand(sample);
        while sums[element] < place {
            element += 1;
        }
        let before = if element == 0 { 0.0 } else { sums[element - 1] };
        visit(sample, element, ((place - before) / (sums[element] - before)).min(1.0));
    }
}

#[derive(Clone, Copy, Default)]
struct Tally {
    sum_sq: f64,
    count: usize,
}

impl Tally {
    fn join(self, other: Self) -> Self {
        Self { sum_sq: self.sum_sq + other.sum_sq, count: self.count + other.count }
    }
}

/// Runs `samples` over chunks of `0..count` in parallel; chunks and the order of their sums do not depend on
/// the number of threads. `samples` hands each of its points to the function that it is given.
fn gather(
    count: usize,
    target: &Bvh,
    progress: &ProgressToken,
    samples: impl Fn(Range<usize>, &mut dyn FnMut(DVec3)) + Sync,
) -> Result<Tally> {
    let tallies: Vec<Tally> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let (mut tally, mut rank) = (Tally::default(), 0);
            progress.poll()?;
            samples(chunk * CHUNK..count.min((chunk + 1) * CHUNK), &mut |point| {
                if let Some(found) = target.closest_from(point, &mut rank) {
                    tally.sum_sq += found.distance_sq;
                    tally.count += 1;
                }
            });
            Ok(tally)
        })
        .collect::<Result<_>>()?;
    Ok(tallies.into_iter().fold(Tally::default(), Tally::join))
}
