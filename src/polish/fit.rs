//! Fit: vertices move along their normals so that the faces, not the vertices, lie close to the surface.
//!
//! Distances of sample points on the faces to their closest points on the surface are made small in the least-squares
//! sense, weighted by area; the unknown is one height a vertex.

use glam::DVec3;
use rayon::prelude::*;

use super::links::{Links, cross};
use super::relax::{CHUNK, spoils, vertex_normal};
use super::{Target, is_locked};
use crate::TriMesh;
use crate::mesh::quality::TriangleQuality;

/// What the sample at a face's middle, at the middle of one of its edges and at one of its corners count, over the
/// face's area: exact for polynomials of degree three. Samples on edges and vertices stand for all faces there.
const FACE_SHARE: f64 = 9.0 / 20.0;
const EDGE_SHARE: f64 = 2.0 / 15.0;
const CORNER_SHARE: f64 = 1.0 / 20.0;
/// Distances below this share of a face's size have no direction of their own; the surface's normal serves.
const NO_DIRECTION: f64 = 1e-3;
/// What a height costs, over what a distance does.
const STIFFNESS: f64 = 1e-2;
/// Steps of the solver.
const SOLVER_STEPS: u32 = 12;
/// Largest height over the size of the faces around (the square root of a third of their area).
const MAX_HEIGHT: f64 = 0.25;
/// Times that heights at suffering triangles are halved before they become 0.
const HALVINGS: u32 = 4;

/// Settings of [`fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// Times that distances are measured and vertices moved.
    pub rounds: u32,
    /// Angles below this many degrees, and below the smallest that there is, may not become smaller.
    pub min_angle: f64,
    /// Vertices that stay where they are, besides those on a boundary; vertices beyond the end of the list are free.
    pub fixed: Vec<bool>,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { rounds: 1, min_angle: 38.0, fixed: Vec::new() }
    }
}

/// What [`fit`] met.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FitCounts {
    /// Vertices, counted in each round, that did not go all the way because a triangle would have suffered.
    pub held: usize,
}

/// Moves the vertices of `mesh` so that its faces fit `target`; vertices on a boundary and irregular ones stay.
///
/// No triangle folds over or gets a smaller angle than the options allow. The result does not depend on the number of
/// threads. Panics if an index is out of range.
pub fn fit(mesh: &mut TriMesh, target: &Target, options: &FitOptions) -> FitCounts {
    let mut counts = FitCounts::default();
    let links = Links::new(std::mem::take(&mut mesh.triangles), mesh.vertices.len());
    let locked: Vec<bool> = (0..mesh.vertices.len()).map(|v| is_locked(&links, &options.fixed, v)).collect();
    let mut ranks = Ranks { faces: vec![[0; 4]; links.triangles.len()], vertices: vec![0; locked.len()] };
    for _ in 0..options.rounds {
        let normals: Vec<DVec3> = (0..mesh.vertices.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|v| if locked[v as usize] { DVec3::ZERO } else { vertex_normal(&links, &mesh.vertices, v) })
            .collect();
        let sheet = Sheet { links: &links, points: &mesh.vertices, normals: &normals };
        let thirds = sheet.thirds();
        let on_vertices = sheet.measure_vertices(&thirds, &mut ranks.vertices, target);
        let on_faces = sheet.measure_faces(&mut ranks.faces, target);
        let mut heights = solve(&links.triangles, &on_vertices, &on_faces);
        counts.held += sheet.limit(&thirds, options.min_angle, &mut heights);
        for (p, (n, h)) in mesh.vertices.iter_mut().zip(normals.iter().zip(&heights)) {
            *p += *n * *h;
        }
    }
    mesh.triangles = links.triangles;
    counts
}

/// Where the searches of the samples ended: middle and edges of every face, and vertices.
struct Ranks {
    faces: Vec<[usize; 4]>,
    vertices: Vec<usize>,
}

/// The share of one face in the normal equations.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    matrix: [[f64; 3]; 3],
    right: [f64; 3],
}

impl Block {
    /// Adds a sample: by what the heights bring it closer, how far it is, and what it counts.
    fn add(&mut self, row: [f64; 3], distance: f64, weight: f64) {
        for i in 0..3 {
            for j in 0..3 {
                self.matrix[i][j] += weight * row[i] * row[j];
            }
            self.right[i] += weight * row[i] * distance;
        }
    }
}

/// A mesh with the directions its vertices may move in; 0 for those that may not.
struct Sheet<'a> {
    links: &'a Links,
    points: &'a [DVec3],
    normals: &'a [DVec3],
}

impl Sheet<'_> {
    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|v| self.points[v as usize])
    }

    fn normal(&self, h: u32) -> DVec3 {
        cross(self.corners(self.links.triangles[h as usize / 3]))
    }

    /// A third of the area of the triangles around each vertex.
    fn thirds(&self) -> Vec<f64> {
        let mut thirds = vec![0.0; self.points.len()];
        for triangle in &self.links.triangles {
            let third = cross(self.corners(*triangle)).length() / 6.0;
            triangle.iter().for_each(|&v| thirds[v as usize] += third);
        }
        thirds
    }

    /// The samples on the vertices, and what keeps heights small: diagonal and right side of each.
    fn measure_vertices(&self, thirds: &[f64], ranks: &mut [usize], target: &Target) -> Vec<(f64, f64)> {
        ranks
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .map(|(v, rank)| {
                let (p, up, area) = (self.points[v], self.normals[v], thirds[v]);
                let Some((offset, direction)) = offset(target, p, up, area, rank) else { return (0.0, 0.0) };
                let (slope, weight) = (up.dot(direction), 3.0 * CORNER_SHARE * area);
                (weight * slope * slope + STIFFNESS * area, weight * slope * offset.dot(direction))
            })
            .collect()
    }

    /// The samples in the middle of every face and on those of its edges that no face before it has.
    fn measure_faces(&self, ranks: &mut [[usize; 4]], target: &Target) -> Vec<Block> {
        ranks
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .map(|(t, ranks)| {
                let triangle = self.links.triangles[t];
                let corners = self.corners(triangle);
                let ups = triangle.map(|v| self.normals[v as usize]);
                let normal = cross(corners);
                let area = 0.5 * normal.length();
                let mut block = Block::default();
                let mut sample = |weights: [f64; 3], weight: f64, normal: DVec3, rank: &mut usize| {
                    let p = (0..3).map(|k| corners[k] * weights[k]).sum();
                    if let Some((offset, direction)) = offset(target, p, normal, area, rank) {
                        let row = std::array::from_fn(|k| weights[k] * ups[k].dot(direction));
                        block.add(row, offset.dot(direction), weight);
                    }
                };
                sample([1.0 / 3.0; 3], FACE_SHARE * area, normal, &mut ranks[3]);
                for k in 0..3 {
                    let h = 3 * t as u32 + k;
                    let other = match self.links.twin(h) {
                        Some(twin) if twin < h => continue,
                        Some(twin) => self.normal(twin),
                        None => DVec3::ZERO,
                    };
                    let mut weights = [0.5; 3];
                    weights[(k as usize + 2) % 3] = 0.0;
                    let both = area + 0.5 * other.length();
                    sample(weights, EDGE_SHARE * both, normal + other, &mut ranks[k as usize]);
                }
                block
            })
            .collect()
    }

    /// Makes heights smaller where they are out of proportion or a triangle would suffer; gives the number of the
    /// latter.
    fn limit(&self, thirds: &[f64], min_angle: f64, heights: &mut [f64]) -> usize {
        for (height, area) in heights.iter_mut().zip(thirds) {
            let most = MAX_HEIGHT * area.sqrt();
            *height = height.clamp(-most, most);
        }
        let angles = self.links.triangles.par_iter().with_min_len(CHUNK);
        let smallest = angles
            .map(|t| TriangleQuality::new(self.corners(*t)).min_angle())
            .reduce(|| f64::INFINITY, f64::min);
        let floor = smallest.max(min_angle);
        let mut held = vec![false; self.points.len()];
        for round in 0..=2 * HALVINGS {
            let suffering: Vec<[u32; 3]> = self
                .links
                .triangles
                .par_iter()
                .with_min_len(CHUNK)
                .filter(|triangle| self.suffers(**triangle, heights, floor))
                .copied()
                .collect();
            if suffering.is_empty() {
                break;
            }
            if round == 2 * HALVINGS {
                heights.fill(0.0);
            }
            let mut vertices: Vec<u32> = suffering.into_iter().flatten().collect();
            vertices.sort_unstable();
            vertices.dedup();
            for v in vertices {
                heights[v as usize] *= if round < HALVINGS { 0.5 } else { 0.0 };
                held[v as usize] = true;
            }
        }
        held.iter().filter(|held| **held).count()
    }

    /// Whether the heights fold a triangle, or make an angle below `floor` degrees smaller.
    fn suffers(&self, triangle: [u32; 3], heights: &[f64], floor: f64) -> bool {
        let old = self.corners(triangle);
        let new = triangle.map(|v| v as usize).map(|v| self.points[v] + self.normals[v] * heights[v]);
        if new == old {
            return false;
        }
        let angle = TriangleQuality::new(new).min_angle();
        let smaller = angle < floor && angle < TriangleQuality::new(old).min_angle();
        smaller || spoils(old, new, cross(old))
    }
}

/// From `p` to its closest point, and the unit direction in which the distance to the surface changes there.
fn offset(target: &Target, p: DVec3, normal: DVec3, area: f64, rank: &mut usize) -> Option<(DVec3, DVec3)> {
    let (closest, facing) = target.closest_with_normal(p, normal, rank)?;
    let offset = closest - p;
    let distance = offset.length();
    let near = distance * distance <= NO_DIRECTION * NO_DIRECTION * area;
    Some((offset, if near { facing } else { offset / distance }))
}

/// Conjugate gradients with the diagonal as preconditioner, from zero. In one thread: it is a few percent of the
/// whole, and the order of the sums is then the same always.
fn solve(triangles: &[[u32; 3]], on_vertices: &[(f64, f64)], on_faces: &[Block]) -> Vec<f64> {
    let vertices = on_vertices.len();
    let (mut diagonal, mut residual): (Vec<f64>, Vec<f64>) = on_vertices.iter().copied().unzip();
    for (triangle, block) in triangles.iter().zip(on_faces) {
        for (k, &v) in triangle.iter().enumerate() {
            residual[v as usize] += block.right[k];
            diagonal[v as usize] += block.matrix[k][k];
        }
    }
    let scaled = |residual: &[f64]| -> Vec<f64> {
        residual.iter().zip(&diagonal).map(|(r, d)| if *d > 0.0 { r / d } else { 0.0 }).collect()
    };
    let dot = |x: &[f64], y: &[f64]| -> f64 { x.iter().zip(y).map(|(a, b)| a * b).sum() };
    let mut x = vec![0.0; vertices];
    let mut z = scaled(&residual);
    let mut direction = z.clone();
    let mut rho = dot(&residual, &z);
    for _ in 0..SOLVER_STEPS {
        let mut product: Vec<f64> = on_vertices.iter().zip(&direction).map(|((d, _), x)| d * x).collect();
        for (triangle, block) in triangles.iter().zip(on_faces) {
            let at = triangle.map(|v| direction[v as usize]);
            for (row, &v) in block.matrix.iter().zip(triangle) {
                product[v as usize] += row[0] * at[0] + row[1] * at[1] + row[2] * at[2];
            }
        }
        let curvature = dot(&direction, &product);
        if rho <= 0.0 || curvature <= 0.0 {
            break;
        }
        let step = rho / curvature;
        for v in 0..vertices {
            x[v] += step * direction[v];
            residual[v] -= step * product[v];
        }
        z = scaled(&residual);
        let before = rho;
        rho = dot(&residual, &z);
        for v in 0..vertices {
            direction[v] = z[v] + rho / before * direction[v];
        }
    }
    x
}
