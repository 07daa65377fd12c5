//! Samples of the fit: distances from points on the faces to the surface, and from the surface's vertices to
//! the faces.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::mesh::bvh::Closest;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::triangle::doubled_normal;
use crate::polish::cache::UNKNOWN;
use crate::polish::relax::CHUNK;
use crate::polish::{MeshCache, Target};
use crate::{ProgressToken, Result, TriMesh};

/// Weights of the samples at a face's centroid, edge midpoints and corners, over the face's area: a
/// quadrature that is exact for polynomials of degree three. Samples on edges and at vertices stand for all
/// faces there.
const FACE_SHARE: f64 = 9.0 / 20.0;
const EDGE_SHARE: f64 = 2.0 / 15.0;
const CORNER_SHARE: f64 = 1.0 / 20.0;
/// Weight of the samples at the surface's vertices, over the area around each.
const INWARD_SHARE: f64 = 0.4;
/// Distances below this share of a face's size have no reliable direction; the surface's normal is used.
const NO_DIRECTION: f64 = 1e-3;

/// Share of measuring that is done after the corners.
const CORNERS: f64 = 0.15;
/// Share of measuring that is done after the faces.
const FACES: f64 = 0.8;

/// The distance of a point of the mesh to its closest point on the surface, and the direction in which it
/// changes; both times the square root of the sample's weight. In single precision: there are millions, and
/// the moves that come of them are small.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Sample {
    pub direction: Vec3,
    pub distance: f32,
}

impl Sample {
    fn new(offset: DVec3, facing: DVec3, size_sq: f64, weight: f64) -> Self {
        let distance = offset.length();
        let near = distance * distance <= NO_DIRECTION * NO_DIRECTION * size_sq;
        let direction = if near { facing } else { offset / distance };
        let weight = weight.sqrt();
        let distance = (offset.dot(direction) * weight) as f32;
        Self { direction: (direction * weight).as_vec3(), distance }
    }
}

/// The sample of a vertex of the surface: its closest point on the mesh, by triangle and barycentric weights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inward {
    pub triangle: u32,
    pub weights: [f64; 3],
    pub sample: Sample,
}

/// All samples of a round.
pub(crate) struct Samples {
    /// At every vertex.
    pub corners: Vec<Sample>,
    /// At the midpoints of the three edges of every face, unless an earlier face has them, and at its
    /// centroid.
    pub faces: Vec<[Sample; 4]>,
    /// At the surface's vertices.
    pub inward: Vec<Inward>,
}

/// What searches for closest points keep for the next round: the ranks at which they ended, where they begin
/// then.
pub(crate) struct Searches {
    faces: Vec<[usize; 4]>,
    pub corners: Vec<usize>,
    pub inward: Vec<usize>,
}

impl Searches {
    /// `corners` has for each vertex, and `inward` for each of the surface's, the rank of a triangle that is
    /// near, or [`UNKNOWN`].
    pub fn new(faces: usize, corners: Vec<usize>, inward: Vec<usize>) -> Self {
        Self { faces: vec![[UNKNOWN; 4]; faces], corners, inward }
    }
}

/// The mesh during a round, with its vertices' normals, which are 0 for fixed vertices.
pub(crate) struct FitMesh<'a> {
    pub half_edges: &'a HalfEdgeMesh,
    pub points: &'a [DVec3],
    pub normals: &'a [DVec3],
}

impl FitMesh<'_> {
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|v| self.points[v as usize])
    }

    fn normal(&self, h: u32) -> DVec3 {
        doubled_normal(self.corners(self.half_edges.triangles[h as usize / 3]))
    }

    /// The areas of the triangles.
    pub fn areas(&self) -> Vec<f64> {
        let triangles = self.half_edges.triangles.par_iter().with_min_len(CHUNK);
        triangles.map(|t| 0.5 * doubled_normal(self.corners(*t)).length()).collect()
    }

    /// A third of the area of the triangles around each vertex.
    pub fn thirds(&self, areas: &[f64]) -> Vec<f64> {
        let mut thirds = vec![0.0; self.points.len()];
        for (triangle, area) in self.half_edges.triangles.iter().zip(areas) {
            triangle.iter().for_each(|&v| thirds[v as usize] += area / 3.0);
        }
        thirds
    }

    /// All samples.
    pub fn measure(
        &self,
        thirds: &[f64],
        target: &Target,
        (searches, cache): (&mut Searches, &mut MeshCache),
        progress: &ProgressToken,
    ) -> Result<Samples> {
        let corners = self.measure_corners(thirds, &mut searches.corners, target);
        progress.done(CORNERS)?;
        let faces = self.measure_faces(&mut searches.faces, &searches.corners, target);
        progress.done(FACES)?;
        let inward = self.measure_inward(&mut searches.inward, cache, target);
        progress.done(1.0)?;
        Ok(Samples { corners, faces, inward })
    }

    fn measure_corners(&self, thirds: &[f64], ranks: &mut [usize], target: &Target) -> Vec<Sample> {
        search_each(ranks, |v, rank| {
            let (area, patch) = (thirds[v], self.half_edges.patch_at(v as u32));
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
                let triangle = self.half_edges.triangles[t];
                // The first searches begin where others nearby ended.
                if ranks[3] == UNKNOWN {
                    ranks[3] = at[triangle[0] as usize];
                }
                let [a, b, c] = self.corners(triangle);
                let normal = doubled_normal([a, b, c]);
                let area = 0.5 * normal.length();
                let on = Search { target, normal, patch: self.half_edges.patch(t as u32), size_sq: area };
                let mut samples = [Sample::default(); 4];
                samples[3] = on.sample((a + b + c) / 3.0, &mut ranks[3], FACE_SHARE * area);
                for (k, middle) in [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].into_iter().enumerate() {
                    let h = 3 * t as u32 + k as u32;
                    let other = match self.half_edges.twin(h) {
                        Some(twin) if twin < h => continue,
                        Some(twin) => self.normal(twin),
                        None => DVec3::ZERO,
                    };
                    let both = area + 0.5 * other.length();
                    let on = Search { normal: normal + other, ..on };
                    if ranks[k] == UNKNOWN {
                        ranks[k] = ranks[3];
                    }
                    samples[k] = on.sample(middle, &mut ranks[k], EDGE_SHARE * both);
                }
                samples
            })
            .collect()
    }

    fn measure_inward(&self, ranks: &mut [usize], cache: &mut MeshCache, target: &Target) -> Vec<Inward> {
        let mesh = TriMesh { vertices: self.points.to_vec(), triangles: self.half_edges.triangles.clone() };
        let tree = cache.tree(&mesh, Some(self.half_edges));
        search_each(ranks, |v, rank| {
            let vertex = &target.vertices[v];
            let normal = |found: &Closest| self.normal(3 * found.triangle);
            let is_facing = |found: &Closest| normal(found).dot(vertex.normal) > 0.0;
            let below = tree.below(vertex.position, rank).filter(is_facing);
            let found = below.or_else(|| tree.bvh.closest_from(vertex.position, rank)).filter(is_facing)?;
            let normal = normal(&found);
            let facing = normal.normalize_or_zero();
            let size_sq = 0.5 * normal.length();
            let sample =
                Sample::new(vertex.position - found.point, facing, size_sq, INWARD_SHARE * vertex.area);
            Some(Inward { triangle: found.triangle, weights: found.barycentric, sample })
        })
    }
}

/// The results of `find` for each search; one with an unknown rank begins where the one before it ended.
fn search_each<T: Send>(ranks: &mut [usize], find: impl Fn(usize, &mut usize) -> Option<T> + Sync) -> Vec<T> {
    let of_chunk = |(c, chunk): (usize, &mut [usize])| {
        let mut last = UNKNOWN;
        let of_one = |(k, rank): (usize, &mut usize)| {
            if *rank == UNKNOWN {
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

/// Parameters of the search for the closest point of a sample.
#[derive(Clone, Copy)]
struct Search<'a> {
    target: &'a Target,
    normal: DVec3,
    patch: u32,
    size_sq: f64,
}

impl Search<'_> {
    /// The sample at `p`; without weight if no triangle of the patch faces the same way as the normal.
    fn sample(&self, p: DVec3, rank: &mut usize, weight: f64) -> Sample {
        match self.target.closest_with_normal(p, self.normal, self.patch, rank) {
            Some((closest, facing)) => Sample::new(closest - p, facing, self.size_sq, weight),
            None => Sample::default(),
        }
    }
}
