//! Samples of a mesh, evenly along its edges and over its faces, and what their distances add up to.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::TriMesh;
use super::bvh::Bvh;
use super::half_edges::EdgeTable;
use super::triangle::doubled_normal;
use crate::{ProgressToken, Result};

/// Samples that one thread takes in a row, each starting its search where the last one ended.
const CHUNK: usize = 2048;
/// Multiples of these, without their integer part, fill the unit square evenly: the inverse powers of the
/// solution of `x^3 = x + 1`. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
pub(crate) const PLANE_SEQUENCE: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Where to sample a mesh. Vertices, edges and faces are listed in the leaf order of its hierarchy, so that
/// successive samples are near each other and each search can start from the last one's result.
pub(crate) struct Samples {
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
    /// Half of `2 * count` samples along the edges and half over the faces of a mesh, by its hierarchy.
    pub fn new(mesh: &TriMesh, bvh: &Bvh, count: usize) -> Self {
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

    /// What `distance_sq` gives for the samples; for the vertices, if all triangles are points.
    pub fn tally(
        &self,
        distance_sq: impl Fn(DVec3, &mut usize) -> Option<f64> + Sync,
        progress: &ProgressToken,
    ) -> Result<Tally> {
        let on_edges = gather(self.count, &distance_sq, progress, |range, visit| {
            walk(&self.edge_sums, self.count, range, |_, edge, share| {
                let [a, b] = self.edges[edge].map(|v| self.vertices[v as usize]);
                visit(a + (b - a) * share);
            });
        })?;
        let on_faces = gather(self.count, &distance_sq, progress, |range, visit| {
            walk(&self.area_sums, self.count, range, |sample, face, _| {
                let [a, b, c] = self.triangles[face].map(|v| self.vertices[v as usize]);
                let [across, along] = PLANE_SEQUENCE.map(|step| (sample as f64 * step).fract());
                visit(a + ((b - a) * (1.0 - along) + (c - a) * along) * across.sqrt());
            });
        })?;
        let total = on_edges.join(on_faces);
        if total.count > 0 { Ok(total) } else { tally_of(&self.vertices, distance_sq, progress) }
    }
}

/// What `distance_sq` gives for points.
pub(crate) fn tally_of(
    points: &[DVec3],
    distance_sq: impl Fn(DVec3, &mut usize) -> Option<f64> + Sync,
    progress: &ProgressToken,
) -> Result<Tally> {
    gather(points.len(), &distance_sq, progress, |range, visit| {
        points[range].iter().for_each(|&p| visit(p));
    })
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

/// Squared distances of points, and how many there are.
#[derive(Clone, Copy, Default)]
pub(crate) struct Tally {
    sum: f64,
    sum_sq: f64,
    largest_sq: f64,
    count: usize,
}

impl Tally {
    fn join(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            sum_sq: self.sum_sq + other.sum_sq,
            largest_sq: self.largest_sq.max(other.largest_sq),
            count: self.count + other.count,
        }
    }

    fn add(&mut self, distance_sq: f64) {
        *self = self.join(Self {
            sum: distance_sq.sqrt(),
            sum_sq: distance_sq,
            largest_sq: distance_sq,
            count: 1,
        });
    }

    /// The root mean square distance.
    pub fn rms(&self) -> f64 {
        (self.sum_sq / self.count as f64).sqrt()
    }

    /// The mean distance.
    pub fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    /// The largest distance.
    pub fn largest(&self) -> f64 {
        self.largest_sq.sqrt()
    }
}

/// Runs `samples` over chunks of `0..count` in parallel; chunks and the order of their sums do not depend on
/// the number of threads. `samples` hands each of its points to the function that it is given.
fn gather(
    count: usize,
    distance_sq: &(impl Fn(DVec3, &mut usize) -> Option<f64> + Sync),
    progress: &ProgressToken,
    samples: impl Fn(Range<usize>, &mut dyn FnMut(DVec3)) + Sync,
) -> Result<Tally> {
    let tallies: Vec<Tally> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let (mut tally, mut rank) = (Tally::default(), 0);
            progress.poll()?;
            samples(chunk * CHUNK..count.min((chunk + 1) * CHUNK), &mut |point| {
                if let Some(found) = distance_sq(point, &mut rank) {
                    tally.add(found);
                }
            });
            Ok(tally)
        })
        .collect::<Result<_>>()?;
    Ok(tallies.into_iter().fold(Tally::default(), Tally::join))
}
