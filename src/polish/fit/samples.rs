//! What the fit measures: distances of points on the faces to the surface, and of the surface's vertices to
//! the faces.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::bvh::Bvh;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::triangle::doubled_normal;
use crate::polish::Target;
use crate::polish::relax::CHUNK;
use crate::{ProgressToken, Result, TriMesh};

/// What the sample at a face's middle, at the middle of one of its edges and at one of its corners count,
/// over the face's area: exact for polynomials of degree three. Samples on edges and vertices stand for all
/// faces there.
const FACE_SHARE: f64 = 9.0 / 20.0;
const EDGE_SHARE: f64 = 2.0 / 15.0;
const CORNER_SHARE: f64 = 1.0 / 20.0;
/// What the surface's vertices count, over their areas; as many samples again as the faces have.
const INWARD_SHARE: f64 = 0.4;
/// Distances below this share of a face's size have no direction of their own; the surface's normal serves.
const NO_DIRECTION: f64 = 1e-3;

/// Stands for a search that has not been made yet.
const NOWHERE: usize = usize::MAX;

/// Share of the measuring that is done after the corners,
const CORNERS: f64 = 0.15;
/// and after the faces.
const FACES: f64 = 0.8;

/// A point of the mesh and the point of the surface that it should meet: their distance, along the direction
/// in which it changes, both times the square root of what the sample counts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Sample {
    pub direction: DVec3,
    pub distance: f64,
}

impl Sample {
    fn new(offset: DVec3, facing: DVec3, size_sq: f64, weight: f64) -> Self {
        let distance = offset.length();
        let near = distance * distance <= NO_DIRECTION * NO_DIRECTION * size_sq;
        let direction = if near { facing } else { offset / distance };
        Self { direction: direction * weight.sqrt(), distance: offset.dot(direction) * weight.sqrt() }
    }
}

/// The closest point of a surface's vertex: in this triangle of the mesh, at these weights of its corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inward {
    pub triangle: u32,
    pub weights: [f64; 3],
    pub sample: Sample,
}

/// All samples of a round.
pub(crate) struct Samples {
    /// On every vertex.
    pub corners: Vec<Sample>,
    /// On the three edges of every face, where no face before it has them, and in its middle.
    pub faces: Vec<[Sample; 4]>,
    /// Of the surface's vertices.
    pub inward: Vec<Inward>,
}

/// Where the searches of the samples ended: middle and edges of every face, vertices, and the surface's
/// vertices.
pub(crate) struct Ranks {
    faces: Vec<[usize; 4]>,
    corners: Vec<usize>,
    inward: Vec<usize>,
}

impl Ranks {
    pub fn new(faces: usize, vertices: usize, target: &Target) -> Self {
        Self {
            faces: vec![[NOWHERE; 4]; faces],
            corners: vec![NOWHERE; vertices],
            inward: vec![NOWHERE; target.points.len()],
        }
    }
}

/// A mesh with its vertices' normals, 0 for those that may not move.
pub(crate) struct Sheet<'a> {
    pub links: &'a HalfEdgeMesh,
    pub points: &'a [DVec3],
    pub normals: &'a [DVec3],
}

impl Sheet<'_> {
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|v| self.points[v as usize])
    }

    fn normal(&self, h: u32) -> DVec3 {
        doubled_normal(self.corners(self.links.triangles[h as usize / 3]))
    }

    /// The triangles' areas.
    pub fn areas(&self) -> Vec<f64> {
        self.links.triangles.iter().map(|t| 0.5 * doubled_normal(self.corners(*t)).length()).collect()
    }

    /// A third of the area of the triangles around each vertex.
    pub fn thirds(&self, areas: &[f64]) -> Vec<f64> {
        let mut thirds = vec![0.0; self.points.len()];
        for (triangle, area) in self.links.triangles.iter().zip(areas) {
            triangle.iter().for_each(|&v| thirds[v as usize] += area / 3.0);
        }
        thirds
    }

    /// All samples.
    pub fn measure(
        &self,
        thirds: &[f64],
        target: &Target,
        ranks: &mut Ranks,
        progress: &ProgressToken,
    ) -> Result<Samples> {
        let corners = self.measure_corners(thirds, &mut ranks.corners, target);
        progress.done(CORNERS)?;
        let faces = self.measure_faces(&mut ranks.faces, &ranks.corners, target);
        progress.done(FACES)?;
        let inward = self.measure_inward(&mut ranks.inward, target);
        progress.done(1.0)?;
        Ok(Samples { corners, faces, inward })
    }

    fn measure_corners(&self, thirds: &[f64], ranks: &mut [usize], target: &Target) -> Vec<Sample> {
        one_after_another(ranks, |v, rank| {
            let (area, patch) = (thirds[v], self.links.patch_at(v as u32));
            let on = Search { target, normal: self.normals[v], patch, size_sq: area };
            Some(on.sample(self.points[v], rank, 3.0 * CORNER_SHARE * area))
        })
    }

    fn measure_faces(&self, ranks: &mut [[usize; 4]], at: &[usize], target: &Target) -> Vec<[Sample; 4]> {
        ranks
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .map(|(t, ranks)| {
                let triangle = self.links.triangles[t];
                for rank in ranks.iter_mut().filter(|rank| **rank == NOWHERE) {
                    // Not far from there.
                    *rank = at[triangle[0] as usize];
                }
                let [a, b, c] = self.corners(triangle);
                let normal = doubled_normal([a, b, c]);
                let area = 0.5 * normal.length();
                let on = Search { target, normal, patch: self.links.patch(t as u32), size_sq: area };
                let mut samples = [Sample::default(); 4];
                samples[3] = on.sample((a + b + c) / 3.0, &mut ranks[3], FACE_SHARE * area);
                for (k, middle) in [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].into_iter().enumerate() {
                    let h = 3 * t as u32 + k as u32;
                    let other = match self.links.twin(h) {
                        Some(twin) if twin < h => continue,
                        Some(twin) => self.normal(twin),
                        None => DVec3::ZERO,
                    };
                    let both = area + 0.5 * other.length();
                    let on = Search { normal: normal + other, ..on };
                    samples[k] = on.sample(middle, &mut ranks[k], EDGE_SHARE * both);
                }
                samples
            })
            .collect()
    }

    fn measure_inward(&self, ranks: &mut [usize], target: &Target) -> Vec<Inward> {
        let mesh = TriMesh { vertices: self.points.to_vec(), triangles: self.links.triangles.clone() };
        let bvh = Bvh::new(&mesh);
        one_after_another(ranks, |v, rank| {
            let point = &target.points[v];
            let found = bvh.closest_from(point.at, rank)?;
            let normal = self.normal(3 * found.triangle);
            if normal.dot(point.normal) <= 0.0 {
                return None;
            }
            let facing = normal.normalize_or_zero();
            let size_sq = 0.5 * normal.length();
            let sample = Sample::new(point.at - found.point, facing, size_sq, INWARD_SHARE * point.area);
            Some(Inward { triangle: found.triangle, weights: found.barycentric, sample })
        })
    }
}

/// What `find` finds for each search, one that was not made yet beginning where the one before it ended.
fn one_after_another<T: Send>(
    ranks: &mut [usize],
    find: impl Fn(usize, &mut usize) -> Option<T> + Sync,
) -> Vec<T> {
    let of_chunk = |(c, chunk): (usize, &mut [usize])| {
        let mut last = NOWHERE;
        let of_one = |(k, rank): (usize, &mut usize)| {
            if *rank == NOWHERE {
                *rank = last;
            }
            let found = find(c * CHUNK + k, rank);
            last = *rank;
            found
        };
        chunk.iter_mut().enumerate().filter_map(of_one).collect::<Vec<T>>()
    };
    ranks.par_chunks_mut(CHUNK).enumerate().flat_map_iter(of_chunk).collect()
}

/// Where the point that a sample should meet is looked for.
#[derive(Clone, Copy)]
struct Search<'a> {
    target: &'a Target,
    normal: DVec3,
    patch: u32,
    size_sq: f64,
}

impl Search<'_> {
    /// The sample at `p`; nothing where no part of the patch faces as the normal does.
    fn sample(&self, p: DVec3, rank: &mut usize, weight: f64) -> Sample {
        match self.target.closest_with_normal(p, self.normal, self.patch, rank) {
            Some((closest, facing)) => Sample::new(closest - p, facing, self.size_sq, weight),
            None => Sample::default(),
        }
    }
}
