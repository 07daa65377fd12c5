//! The normal equations of the fit, solved by conjugate gradients.

use std::ops::AddAssign;

use glam::{DMat3, DVec3, Vec3, Vec3A, Vec3Swizzles};
use rayon::prelude::*;

use super::samples::{Inward, Sample, Samples};
use crate::mesh::csr::Csr;
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::next;

/// Barycentric weights of the samples at a face's edge midpoints and centroid.
const WEIGHTS: [[f64; 3]; 4] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0; 3]];
/// Rows of the matrix that are done together.
const ROWS: usize = 512;
/// Vertices whose products are added together; a constant, since sums must not depend on the number of
/// threads.
const SUMMED: usize = 2048;

/// The sum of squares that is minimized.
pub(crate) struct System<'a> {
    pub half_edges: &'a HalfEdgeMesh,
    pub samples: &'a Samples,
    /// Weight of the squared move of each vertex.
    pub stiffness: &'a [f64],
    /// Weight of the squared differences between the moves of each triangle's corners.
    pub coupling: &'a [f64],
    /// Vertices that stay: all on a boundary, all irregular ones, and maybe others.
    pub fixed: &'a [bool],
}

impl System<'_> {
    /// The moves after at most `steps` steps from zero, preconditioned by the 3 × 3 blocks on the diagonal.
    /// They do not depend on the number of threads. In single precision but for sums: a move is right to a
    /// millionth of its length.
    pub fn solve(&self, steps: u32) -> Vec<DVec3> {
        let matrix = self.matrix();
        let mut residual: Vec<Vec3A> = matrix.rows.iter().flat_map(|rows| &rows.right).copied().collect();
        let mut moves = vec![Vec3A::ZERO; residual.len()];
        let mut z = matrix.precondition(&residual);
        let mut direction = z.clone();
        let mut rho = dot(&residual, &z);
        for _ in 0..steps {
            let product = matrix.apply(&direction);
            let curvature = dot(&direction, &product);
            if rho <= 0.0 || curvature <= 0.0 {
                break;
            }
            let step = rho / curvature;
            add(&mut moves, step, &direction);
            add(&mut residual, -step, &product);
            z = matrix.precondition(&residual);
            let before = rho;
            rho = dot(&residual, &z);
            let share = (rho / before) as f32;
            let onward = |(d, z): (&mut Vec3A, &Vec3A)| *d = *z + *d * share;
            direction.par_iter_mut().zip(&z).with_min_len(ROWS).for_each(onward);
        }
        moves.into_iter().map(|step| step.as_dvec3()).collect()
    }

    /// The matrix, and the right-hand side. Those of vertices that stay are zero.
    fn matrix(&self) -> Matrix {
        let triangles = self.half_edges.triangles.len();
        let inward = self.samples.inward.iter().map(|inward| inward.triangle);
        let inward = Csr::group(triangles, inward.zip(0..));
        let count = self.fixed.len();
        let starts = (0..count.div_ceil(ROWS)).into_par_iter().map(|chunk| chunk * ROWS);
        Matrix { rows: starts.map(|start| self.rows(start..count.min(start + ROWS), &inward)).collect() }
    }

    fn rows(&self, vertices: std::ops::Range<usize>, inward: &Csr) -> Rows {
        let edges = vertices.clone().map(|v| self.half_edges.valence(v as u32) as usize).sum();
        let mut rows = Rows::with_capacity(vertices.len(), edges);
        for v in vertices {
            let (mut own, mut right) = (Symmetric::default(), DVec3::ZERO);
            if !self.fixed[v] {
                let sample = &self.samples.corners[v];
                own += Symmetric::outer(sample, 1.0);
                own += Symmetric::scale(self.stiffness[v]);
                right += along(sample, 1.0);
                for h in self.half_edges.ring(v as u32) {
                    own += Symmetric::scale(2.0 * self.coupling[h as usize / 3]);
                    self.each(h, inward, |sample, weight, _| {
                        own += Symmetric::outer(sample, weight * weight);
                        right += along(sample, weight);
                    });
                    let mut beside = self.beside(h, inward);
                    if let Some(twin) = self.half_edges.twin(h) {
                        beside += self.beside(twin, inward);
                    }
                    rows.neighbours.push(self.half_edges.origin(next(h)));
                    rows.beside.push(beside.rounded());
                }
            }
            rows.ends.push(rows.beside.len() as u32);
            rows.own.push(own.rounded());
            rows.inverse.push(own.inverse().rounded());
            rows.right.push(right.as_vec3a());
        }
        rows
    }

    /// What the triangle of a half-edge adds to the block of its edge.
    fn beside(&self, h: u32, inward: &Csr) -> Symmetric {
        let mut block = Symmetric::scale(-self.coupling[h as usize / 3]);
        self.each(h, inward, |sample, weight, next| {
            block += Symmetric::outer(sample, weight * next);
        });
        block
    }

    /// Calls `visit` with each sample on the triangle of a half-edge, but not at its corners, and the
    /// barycentric weights of both ends of the half-edge.
    fn each(&self, h: u32, inward: &Csr, mut visit: impl FnMut(&Sample, f64, f64)) {
        let (triangle, corner) = (h / 3, h as usize % 3);
        let next = (corner + 1) % 3;
        for (sample, weights) in self.samples.faces[triangle as usize].iter().zip(WEIGHTS) {
            // The sample of an edge is in only one of its triangles.
            if sample.direction != Vec3::ZERO {
                visit(sample, weights[corner], weights[next]);
            }
        }
        for i in inward.of(triangle) {
            let Inward { weights, sample, .. } = &self.samples.inward[*i as usize];
            visit(sample, weights[corner], weights[next]);
        }
    }
}

/// What a sample of this weight adds to the right-hand side.
fn along(sample: &Sample, weight: f64) -> DVec3 {
    sample.direction.as_dvec3() * (f64::from(sample.distance) * weight)
}

fn dot(x: &[Vec3A], y: &[Vec3A]) -> f64 {
    let product = |(x, y): (&Vec3A, &Vec3A)| x.as_dvec3().dot(y.as_dvec3());
    let of_chunk = |(x, y): (&[Vec3A], &[Vec3A])| x.iter().zip(y).map(product).sum::<f64>();
    x.par_chunks(SUMMED).zip(y.par_chunks(SUMMED)).map(of_chunk).collect::<Vec<f64>>().into_iter().sum()
}

/// Adds a multiple of `y` to `x`.
fn add(x: &mut [Vec3A], factor: f64, y: &[Vec3A]) {
    x.par_iter_mut().zip(y).with_min_len(ROWS).for_each(|(x, y)| *x += *y * factor as f32);
}

/// A symmetric matrix of 3 × 3 blocks, and the right-hand side.
struct Matrix {
    /// The matrix's rows, of [`ROWS`] vertices each.
    rows: Vec<Rows>,
}

/// Rows of the matrix: for each vertex the block on the diagonal, its inverse, and the other blocks of its
/// row.
struct Rows {
    own: Vec<Block>,
    inverse: Vec<Block>,
    /// The neighbours of all vertices, one vertex after the other.
    neighbours: Vec<u32>,
    /// The block off the diagonal for each entry of `neighbours`.
    beside: Vec<Block>,
    /// Where the entries of each vertex end in `neighbours` and `beside`.
    ends: Vec<u32>,
    right: Vec<Vec3A>,
}

impl Rows {
    fn with_capacity(vertices: usize, edges: usize) -> Self {
        Self {
            own: Vec::with_capacity(vertices),
            inverse: Vec::with_capacity(vertices),
            neighbours: Vec::with_capacity(edges),
            beside: Vec::with_capacity(edges),
            ends: Vec::with_capacity(vertices),
            right: Vec::with_capacity(vertices),
        }
    }
}

impl Matrix {
    fn apply(&self, x: &[Vec3A]) -> Vec<Vec3A> {
        self.by_rows(x, |rows, own, y| {
            let mut start = 0;
            for (k, y) in y.iter_mut().enumerate() {
                let end = rows.ends[k] as usize;
                *y = rows.own[k].apply(own[k]);
                for (v, block) in rows.neighbours[start..end].iter().zip(&rows.beside[start..end]) {
                    *y += block.apply(x[*v as usize]);
                }
                start = end;
            }
        })
    }

    /// The product with the inverse of the diagonal.
    fn precondition(&self, x: &[Vec3A]) -> Vec<Vec3A> {
        self.by_rows(x, |rows, own, y| {
            for ((y, x), inverse) in y.iter_mut().zip(own).zip(&rows.inverse) {
                *y = inverse.apply(*x);
            }
        })
    }

    /// What `set` makes of the rows, their part of `x`, and their part of the result.
    fn by_rows(&self, x: &[Vec3A], set: impl Fn(&Rows, &[Vec3A], &mut [Vec3A]) + Sync) -> Vec<Vec3A> {
        let mut y = vec![Vec3A::ZERO; x.len()];
        let parts = y.par_chunks_mut(ROWS).zip(x.par_chunks(ROWS));
        parts.zip(&self.rows).for_each(|((y, own), rows)| set(rows, own, y));
        y
    }
}

/// A symmetric 3 × 3 matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Symmetric {
    /// xx, yy and zz.
    diagonal: DVec3,
    /// yz, zx and xy.
    off_diagonal: DVec3,
}

impl Symmetric {
    /// `weight` times the product of a sample's direction with itself.
    fn outer(sample: &Sample, weight: f64) -> Self {
        let d = sample.direction.as_dvec3();
        let scaled = d * weight;
        Self { diagonal: scaled * d, off_diagonal: scaled.yzx() * d.zxy() }
    }

    fn scale(factor: f64) -> Self {
        Self { diagonal: DVec3::splat(factor), off_diagonal: DVec3::ZERO }
    }

    /// The inverse; 0 for a matrix that is not positive definite.
    fn inverse(&self) -> Self {
        let (on, off) = (self.diagonal, self.off_diagonal);
        let full = DMat3::from_cols(
            DVec3::new(on.x, off.z, off.y),
            DVec3::new(off.z, on.y, off.x),
            DVec3::new(off.y, off.x, on.z),
        );
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } =
            if full.determinant() > 0.0 { full.inverse() } else { DMat3::ZERO };
        Self { diagonal: DVec3::new(x.x, y.y, z.z), off_diagonal: DVec3::new(y.z, z.x, x.y) }
    }

    fn rounded(&self) -> Block {
        Block { diagonal: self.diagonal.as_vec3a(), off_diagonal: self.off_diagonal.as_vec3a() }
    }
}

/// A [`Symmetric`] in single precision.
#[derive(Debug, Clone, Copy)]
struct Block {
    diagonal: Vec3A,
    off_diagonal: Vec3A,
}

impl Block {
    fn apply(&self, x: Vec3A) -> Vec3A {
        let off = self.off_diagonal;
        self.diagonal * x + off.zxy() * x.yzx() + off.yzx() * x.zxy()
    }
}

impl AddAssign for Symmetric {
    fn add_assign(&mut self, other: Self) {
        self.diagonal += other.diagonal;
        self.off_diagonal += other.off_diagonal;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// The cost of a sample that moves, with its distance multiplied by a factor.
    fn square(sample: &Sample, moved: DVec3, distances: f64) -> f64 {
        (sample.direction.as_dvec3().dot(moved) - distances * f64::from(sample.distance)).powi(2)
    }

    /// The matrix is that of the sum of squares that the fit minimizes, on the vertices that move.
    #[test]
    fn the_matrix_is_that_of_the_costs() {
        // Two vertices inside, next to each other: only their triangles count.
        let triangles = vec![[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 2], [1, 3, 4], [1, 4, 5]];
        let half_edges = HalfEdgeMesh::new(triangles.clone(), 6, &[]);
        let fixed = [false, false, true, true, true, true];
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
        let mut sample = || Sample { direction: vector().as_vec3(), distance: 0.5 };
        let inward = |triangle, weights, sample| Inward { triangle, weights, sample };
        let mut samples = Samples {
            corners: (0..6).map(|_| sample()).collect(),
            faces: (0..6).map(|_| std::array::from_fn(|_| sample())).collect(),
            inward: vec![
                inward(1, [0.2, 0.5, 0.3], sample()),
                inward(4, [0.1, 0.7, 0.2], sample()),
                inward(1, [0.6, 0.4, 0.0], sample()),
            ],
        };
        samples.faces[1][0] = Sample::default();
        let system = System {
            half_edges: &half_edges,
            samples: &samples,
            stiffness: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
            coupling: &[0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
            fixed: &fixed,
        };
        // The costs less those of no move at all, which are linear in the distances.
        let cost = |x: &[DVec3], distances: f64| -> f64 {
            let square = |s: &Sample, moved: DVec3| square(s, moved, distances);
            let mut cost = 0.0;
            for ((s, k), x) in samples.corners.iter().zip(system.stiffness).zip(x) {
                cost += square(s, *x) + k * x.length_squared();
            }
            let at = |t: usize, weights: [f64; 3]| -> DVec3 {
                (0..3).map(|k| x[triangles[t][k] as usize] * weights[k]).sum()
            };
            for (t, coupling) in system.coupling.iter().enumerate() {
                for (s, weights) in samples.faces[t].iter().zip(WEIGHTS) {
                    cost += if s.direction == Vec3::ZERO { 0.0 } else { square(s, at(t, weights)) };
                }
                let [a, b, c] = triangles[t].map(|v| x[v as usize]);
                cost += coupling
                    * ((a - b).length_squared() + (b - c).length_squared() + (c - a).length_squared());
            }
            samples.inward.iter().for_each(|s| cost += square(&s.sample, at(s.triangle as usize, s.weights)));
            cost
        };
        let mut x: Vec<DVec3> = (0..6).map(|_| vector()).collect();
        x[2..].fill(DVec3::ZERO);
        let matrix = system.matrix();
        let rounded: Vec<Vec3A> = x.iter().map(|x| x.as_vec3a()).collect();
        let product = dot(&matrix.apply(&rounded), &rounded);
        assert!((product - cost(&x, 0.0)).abs() < 1e-5 * product, "{product} {}", cost(&x, 0.0));
        let linear = cost(&x, 1.0) - cost(&x, 0.0) - cost(&[DVec3::ZERO; 6], 1.0);
        let right = dot(&matrix.rows[0].right, &rounded);
        assert!((linear + 2.0 * right).abs() < 1e-5 * product, "{linear} {right}");
        // In every direction, not only along `x`: the blocks on the diagonal, and symmetry.
        for v in 0..2 {
            for unit in [Vec3A::X, Vec3A::Y, Vec3A::Z] {
                let mut e = vec![Vec3A::ZERO; 6];
                e[v] = unit;
                let column = matrix.apply(&e);
                assert!((matrix.precondition(&column)[v] - unit).length() < 1e-4);
                let row = dot(&matrix.apply(&rounded), &e);
                assert!((row - dot(&column, &rounded)).abs() < 1e-5 * product);
            }
        }
        assert_eq!(matrix.apply(&rounded)[2..], [Vec3A::ZERO; 4]);
        // All steps of so small a system lead to its solution, from which every way goes up.
        let moves = system.solve(20);
        let least = cost(&moves, 1.0);
        for k in 0..6 {
            for by in [-1e-3, 1e-3] {
                let mut beside = moves.clone();
                beside[k / 3][k % 3] += by;
                assert!(cost(&beside, 1.0) > least);
            }
        }
    }
}
