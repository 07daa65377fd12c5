//! Hausdorff and root-mean-square distance between two surfaces.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::TriMesh;
use super::bvh::Bvh;
use super::half_edges::EdgeTable;
use super::quality::power_of_two_scale;
use super::triangle::doubled_normal;
use crate::{Error, ProgressToken, Result};

/// Samples on the edges and as many on the faces of either mesh, at the least.
const MIN_SAMPLES: usize = 200_000;
/// Samples of each kind per vertex of the larger mesh, at the least.
const SAMPLES_PER_VERTEX: usize = 4;
/// How far beyond the reference's size a mesh may reach.
const MAX_RATIO: f64 = 1e100;
/// Samples that one thread takes in a row, each starting its search where the last one ended.
const CHUNK: usize = 2048;
/// Multiples of these, without their integer part, fill the unit square evenly: the inverse powers of the
/// solution of `x^3 = x + 1`. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
const PLANE_SEQUENCE: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Distances in percent of the diagonal of the reference's bounding box, which spans all its vertices, used
/// or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Distances {
    /// Largest distance of a sample on the mesh to the reference.
    pub hausdorff_to_reference: f64,
    /// Largest distance of a sample on the reference to the mesh.
    pub hausdorff_from_reference: f64,
    /// The larger of the two.
    pub hausdorff: f64,
    /// Root mean square distance of the samples on the mesh to the reference.
    pub rms_to_reference: f64,
    /// Root mean square distance of the samples on the reference to the mesh.
    pub rms_from_reference: f64,
    /// The larger of the two.
    pub rms: f64,
}

/// Distances between `mesh` and `reference`, both ways, from at least 400,000 samples on each.
///
/// A mesh is sampled at all vertices that a face uses, evenly along its edges and evenly over its faces; all
/// samples count alike, as in Cignoni, Rocchini and Scopigno, "Metro", 1998. From a sample, the distance to
/// the other surface is exact up to rounding. The result is the same on every run and for every number of
/// threads.
///
/// Fails if either mesh has no faces or a coordinate that is not finite, if the reference has no extent, or
/// if the mesh reaches 1e100 times as far as the reference, and with [`Error::Cancelled`]. Panics if an index
/// is out of range.
pub fn distances(mesh: &TriMesh, reference: &TriMesh, progress: &ProgressToken) -> Result<Distances> {
    let vertices = mesh.vertices.len().max(reference.vertices.len());
    distances_sampled(mesh, reference, MIN_SAMPLES.max(SAMPLES_PER_VERTEX * vertices), progress)
}

/// As [`distances`], with `samples` samples on the edges and as many on the faces of either mesh.
pub fn distances_sampled(
    mesh: &TriMesh,
    reference: &TriMesh,
    samples: usize,
    progress: &ProgressToken,
) -> Result<Distances> {
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
    let place = Placement { origin: reference.vertices[0] * scale, scale };
    let (mesh, reference) = (place.apply(mesh), place.apply(reference));
    let diagonal = reference.bounds().map_or(0.0, |(lo, hi)| lo.distance(hi));
    if diagonal == 0.0 {
        let problem = "all vertices of the reference mesh are at one point";
        return Err(Error::input(None, problem, "give a reference with some extent"));
    }
    // The reference is of about size one now; far beyond this, sums of squares would leave the range of f64.
    let largest = mesh.vertices.iter().fold(0.0, |m: f64, v| m.max(v.abs().max_element()));
    if largest > MAX_RATIO {
        let problem = "the mesh and its reference differ too much in size or place to measure distances";
        return Err(Error::input(None, problem, "check that both are in the same unit"));
    }
    let (mesh_bvh, reference_bvh) = (Bvh::new(&mesh), Bvh::new(&reference));
    let to = Samples::new(&mesh, &mesh_bvh, samples).measure(&reference_bvh, progress)?;
    let from = Samples::new(&reference, &reference_bvh, samples).measure(&mesh_bvh, progress)?;
    let percent = 100.0 / diagonal;
    Ok(Distances {
        hausdorff_to_reference: to.hausdorff * percent,
        hausdorff_from_reference: from.hausdorff * percent,
        hausdorff: to.hausdorff.max(from.hausdorff) * percent,
        rms_to_reference: to.rms * percent,
        rms_from_reference: from.rms * percent,
        rms: to.rms.max(from.rms) * percent,
    })
}

/// Brings the reference to the origin and to a size of about one, so that squares stay in range.
struct Placement {
    origin: DVec3,
    scale: f64,
}

impl Placement {
    fn apply(&self, mesh: &TriMesh) -> TriMesh {
        let vertices = mesh.vertices.iter().map(|&v| v * self.scale - self.origin).collect();
        TriMesh { vertices, triangles: mesh.triangles.clone() }
    }
}

/// Distances in the unit of the placed meshes.
struct OneWay {
    hausdorff: f64,
    rms: f64,
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
    fn new(mesh: &TriMesh, bvh: &Bvh, count: usize) -> Self {
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

    fn measure(&self, target: &Bvh, progress: &ProgressToken) -> Result<OneWay> {
        let on_vertices = gather(self.vertices.len(), progress, |range, visit| {
            self.vertices[range].iter().for_each(|&p| visit(p, target));
        })?;
        let on_edges = gather(self.count, progress, |range, visit| {
            walk(&self.edge_sums, self.count, range, |_, edge, (k, n)| {
                let [a, b] = self.edges[edge].map(|v| self.vertices[v as usize]);
                // The ends are sampled already, so the edge's samples keep clear of them.
                visit(a + (b - a) * ((k + 1) as f64 / (n + 1) as f64), target);
            });
        })?;
        let on_faces = gather(self.count, progress, |range, visit| {
            walk(&self.area_sums, self.count, range, |sample, face, _| {
                let [a, b, c] = self.triangles[face].map(|v| self.vertices[v as usize]);
                let [across, along] = PLANE_SEQUENCE.map(|step| (sample as f64 * step).fract());
                visit(a + ((b - a) * (1.0 - along) + (c - a) * along) * across.sqrt(), target);
            });
        })?;
        let total = on_vertices.join(on_edges).join(on_faces);
        Ok(OneWay { hausdorff: total.max_sq.sqrt(), rms: (total.sum_sq / total.count as f64).sqrt() })
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

/// Calls `visit(sample, element, (k, n))` for the samples in `range` of `count` that are shared out among
/// elements by size, `sums` being the running sums of the sizes; `k` is the sample's number among the `n` of
/// its element. Nothing is visited where all sizes are zero.
fn walk(
    sums: &[f64],
    count: usize,
    range: std::ops::Range<usize>,
    mut visit: impl FnMut(usize, usize, (usize, usize)),
) {
    let total = sums.last().copied().unwrap_or(0.0);
    if total <= 0.0 {
        return;
    }
    // The samples stand at (sample + 1/2) / count of the total; this many of them lie below a running sum.
    let below = |sum: f64| (sum / total * count as f64 - 0.5).ceil().max(0.0) as usize;
    let mut element = sums.partition_point(|&sum| below(sum) <= range.start);
    for sample in range {
        while below(sums[element]) <= sample {
            element += 1;
        }
        let first = if element == 0 { 0 } else { below(sums[element - 1]) };
        visit(sample, element, (sample - first, below(sums[element]) - first));
    }
}

#[derive(Clone, Copy, Default)]
struct Tally {
    max_sq: f64,
    sum_sq: f64,
    count: usize,
}

impl Tally {
    fn join(self, other: Self) -> Self {
        Self {
            max_sq: self.max_sq.max(other.max_sq),
            sum_sq: self.sum_sq + other.sum_sq,
            count: self.count + other.count,
        }
    }
}

/// Runs `samples` over chunks of `0..count` in parallel; chunks and the order of their sums do not depend on
/// the number of threads. `samples` hands each of its points to the function that it is given.
fn gather(
    count: usize,
    progress: &ProgressToken,
    samples: impl Fn(std::ops::Range<usize>, &mut dyn FnMut(DVec3, &Bvh)) + Sync,
) -> Result<Tally> {
    let tallies: Vec<Tally> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let (mut tally, mut rank) = (Tally::default(), 0);
            progress.poll()?;
            samples(chunk * CHUNK..count.min((chunk + 1) * CHUNK), &mut |point, target| {
                if let Some(found) = target.closest_from(point, &mut rank) {
                    tally.max_sq = tally.max_sq.max(found.distance_sq);
                    tally.sum_sq += found.distance_sq;
                    tally.count += 1;
                }
            });
            Ok(tally)
        })
        .collect::<Result<_>>()?;
    Ok(tallies.into_iter().fold(Tally::default(), Tally::join))
}
