//! The cells of sites, as even samples of the surface that are nearest to each on its sheet.

use glam::DVec3;
use rayon::prelude::*;

use super::cell_quadric::CellQuadric;
use crate::TriMesh;
use crate::mesh::NONE;
use crate::mesh::csr::Csr;
use crate::mesh::half_edges::twins;
use crate::mesh::kd_tree::KdTree;
use crate::mesh::sampling::PLANE_SEQUENCE;
use crate::mesh::sizing::SizeField;
use crate::mesh::surface_tree::SurfaceTree;
use crate::mesh::triangle::doubled_normal;
use crate::polish::Target;

/// Samples of the surface for each site.
const SAMPLES: usize = 32;
/// Samples that one thread takes in a row, each search starting where the last one ended.
const CHUNK: usize = 1024;
/// Nearest sites among which a walk goes on.
const NEAR: usize = 14;
/// Walks for which they stay as they are: sites move little.
const NEAR_FOR: u32 = 4;
/// Steps of a walk to the nearest site.
const STEPS: usize = 16;
/// Minimum cosine between the normal of a sample and the mean normal of the cell that it may be in, and
/// between those of two cells that a walk leads from one to the other.
const SAME_SHEET: f64 = -0.2;

/// A sample of the surface.
#[derive(Debug, Clone, Copy)]
struct Sample {
    at: DVec3,
    normal: DVec3,
    /// The area that it stands for, times the density of the energy there.
    weight: f64,
}

/// Samples, each with the site in whose cell it is.
pub(super) struct Cells {
    samples: Vec<Sample>,
    site: Vec<u32>,
    /// The sites near each site.
    near: Vec<[u32; NEAR]>,
    /// How many times the samples have walked.
    rounds: u32,
}

impl Cells {
    /// Samples of the whole surface, in the cells of the vertices of a mesh on it.
    pub fn new(mesh: &TriMesh, (target, sizes): (&Target, &SizeField)) -> Self {
        let samples = samples(target, sizes, SAMPLES * mesh.vertices.len());
        let tree = SurfaceTree::new(mesh, &twins(&mesh.triangles));
        let nearest_corner = |sample: &Sample, rank: &mut usize| {
            let is_facing = |t: u32| doubled_normal(mesh.corners(t as usize)).dot(sample.normal) > 0.0;
            let found = tree.closest_accepted(sample.at, rank, is_facing)?;
            let distance = |v: &u32| mesh.vertices[*v as usize].distance_squared(sample.at);
            let corners = mesh.triangles[found.triangle as usize];
            corners.into_iter().min_by(|v, w| distance(v).total_cmp(&distance(w)))
        };
        let of_chunk = |chunk: &[Sample]| {
            let mut rank = 0;
            chunk.iter().map(|sample| nearest_corner(sample, &mut rank).unwrap_or(NONE)).collect::<Vec<u32>>()
        };
        let site = samples.par_chunks(CHUNK).flat_map_iter(of_chunk).collect();
        Self { samples, site, near: Vec::new(), rounds: 0 }
    }

    /// Walks from the site of each sample to nearer ones; `normals` are the mean normals of the cells.
    pub fn assign(&mut self, sites: &[DVec3], normals: &[DVec3]) {
        if self.rounds.is_multiple_of(NEAR_FOR) {
            self.near = near_sites(sites, normals);
        }
        self.rounds += 1;
        let near = &self.near;
        let samples = &self.samples;
        self.site.par_chunks_mut(CHUNK).zip(samples.par_chunks(CHUNK)).for_each(|(owners, samples)| {
            for (owner, sample) in owners.iter_mut().zip(samples).filter(|(owner, _)| **owner != NONE) {
                let mut least = sites[*owner as usize].distance_squared(sample.at);
                for _ in 0..STEPS {
                    let mut nearer = NONE;
                    for w in near[*owner as usize].iter().take_while(|w| **w != NONE) {
                        let distance = sites[*w as usize].distance_squared(sample.at);
                        if distance < least && normals[*w as usize].dot(sample.normal) > SAME_SHEET {
                            (least, nearer) = (distance, *w);
                        }
                    }
                    if nearer == NONE {
                        break;
                    }
                    *owner = nearer;
                }
            }
        });
    }

    /// The integrals over the cells, about the sites.
    pub fn quadrics(&self, sites: &[DVec3]) -> Vec<CellQuadric> {
        let owned = (0..).zip(&self.site).filter(|(_, v)| **v != NONE);
        let of = Csr::group(sites.len(), owned.map(|(sample, v): (u32, &u32)| (*v, sample)));
        (0..sites.len() as u32)
            .into_par_iter()
            .with_min_len(64)
            .map(|v| {
                let mut quadric = CellQuadric::ZERO;
                for s in of.of(v) {
                    let Sample { at, normal, weight } = self.samples[*s as usize];
                    quadric.add(at - sites[v as usize], normal, weight);
                }
                quadric
            })
            .collect()
    }
}

/// The nearest sites of each on its sheet, [`NONE`] where there are fewer.
fn near_sites(sites: &[DVec3], normals: &[DVec3]) -> Vec<[u32; NEAR]> {
    let tree = KdTree::new(sites);
    let of_site = |found: &mut Vec<(f64, u32)>, v: usize| {
        tree.nearest_few(sites[v], NEAR + 1, found);
        let is_other = |w: &u32| *w as usize != v && normals[v].dot(normals[*w as usize]) > SAME_SHEET;
        let others = found.iter().map(|(_, w)| *w).filter(is_other);
        let mut list = [NONE; NEAR];
        list.iter_mut().zip(others).for_each(|(slot, w)| *slot = w);
        list
    };
    (0..sites.len()).into_par_iter().with_min_len(64).map_init(Vec::new, of_site).collect()
}

/// About `count` samples, spread over the surface so that cells of the lengths in `sizes` have as many each.
///
/// Cells are as large as these lengths say if the energy has a density of 1 / length⁴ (Du, Faber and
/// Gunzburger 1999, for two dimensions).
fn samples(target: &Target, sizes: &SizeField, count: usize) -> Vec<Sample> {
    let bvh = target.bvh();
    let triangles: Vec<(u32, [DVec3; 3])> = (0..)
        .zip(bvh.leaf_order())
        .filter_map(|(rank, t): (usize, &u32)| bvh.corners_at(rank).map(|corners| (*t, corners)))
        .collect();
    let share =
        |(t, corners): &(u32, [DVec3; 3])| doubled_normal(*corners).length() * sizes.density(*t as usize);
    let each = triangles.iter().map(share).sum::<f64>() / count as f64;
    let (mut samples, mut sum, mut number) = (Vec::with_capacity(count), 0.0, 0_usize);
    for (t, [a, b, c]) in triangles {
        let normal = doubled_normal([a, b, c]);
        sum += share(&(t, [a, b, c]));
        while (number as f64 + 0.5) * each < sum {
            let [across, along] = PLANE_SEQUENCE.map(|step| (number as f64 * step).fract());
            let at = a + ((b - a) * (1.0 - along) + (c - a) * along) * across.sqrt();
            let weight = 0.5 * each / sizes.at(at, t).powi(2);
            samples.push(Sample { at, normal: normal.normalize_or_zero(), weight });
            number += 1;
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn samples_are_in_the_cell_of_the_nearest_site() {
        let mesh = sample("bumpy-sphere").unwrap_or_default();
        let target = Target::new(&mesh);
        let mut cells = Cells::new(&mesh, (&target, &SizeField::default()));
        let area: f64 = cells.quadrics(&mesh.vertices).iter().map(|quadric| quadric.area).sum();
        assert!((area / mesh.area() - 1.0).abs() < 1e-3, "{area}");
        // Moved sites get other samples.
        let moved: Vec<DVec3> = mesh.vertices.iter().map(|p| *p + 0.02 * DVec3::new(p.y, p.z, p.x)).collect();
        let normals = moved.iter().map(|p| p.normalize()).collect::<Vec<_>>();
        cells.assign(&moved, &normals);
        for (sample, site) in cells.samples.iter().zip(&cells.site).step_by(97) {
            let distance = |v: u32| moved[v as usize].distance(sample.at);
            let nearest = (0..moved.len() as u32).map(distance).fold(f64::INFINITY, f64::min);
            assert!(distance(*site) <= nearest + 1e-12, "{} {nearest}", distance(*site));
        }
    }
}
