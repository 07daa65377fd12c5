//! The normal equations of the fit, solved by conjugate gradients.

use std::ops::AddAssign;

use glam::{DMat3, DVec3, Vec3Swizzles};

use super::samples::{Inward, Sample, Samples};
use crate::mesh::half_edge_mesh::HalfEdgeMesh;
use crate::mesh::half_edges::next;

/// Barycentric weights of the samples at a face's edge midpoints and centroid.
const WEIGHTS: [[f64; 3]; 4] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0; 3]];

/// The sum of squares that is minimized.
pub(crate) struct System<'a> {
    pub half_edges: &'a HalfEdgeMesh,
    pub samples: &'a Samples,
    /// Weight of the squared move of each vertex.
    pub stiffness: &'a [f64],
    /// Weight of the squared differences between the moves of each triangle's corners.
    pub coupling: &'a [f64],
    /// Vertices that stay.
    pub fixed: &'a [bool],
}

impl System<'_> {
    /// The moves after at most `steps` steps from zero, preconditioned by the 3 × 3 blocks on the diagonal.
    /// In one thread, so that the order of summation is always the same.
    pub fn solve(&self, steps: u32) -> Vec<DVec3> {
        let matrix = self.matrix();
        let inverse: Vec<DMat3> = matrix.vertices.iter().map(Symmetric::inverse).collect();
        let dot = |x: &[DVec3], y: &[DVec3]| -> f64 { x.iter().zip(y).map(|(a, b)| a.dot(*b)).sum() };
        let scaled = |r: &[DVec3]| -> Vec<DVec3> { r.iter().zip(&inverse).map(|(r, m)| *m * *r).collect() };
        let mut residual = self.right_hand_side();
        let mut moves = vec![DVec3::ZERO; residual.len()];
        let mut z = scaled(&residual);
        let mut direction = z.clone();
        let mut rho = dot(&residual, &z);
        for _ in 0..steps {
            let product = self.zero_fixed(matrix.apply(&direction));
            let curvature = dot(&direction, &product);
            if rho <= 0.0 || curvature <= 0.0 {
                break;
            }
            let step = rho / curvature;
            for v in 0..moves.len() {
                moves[v] += direction[v] * step;
                residual[v] -= product[v] * step;
            }
            z = scaled(&residual);
            let before = rho;
            rho = dot(&residual, &z);
            for v in 0..moves.len() {
                direction[v] = z[v] + direction[v] * (rho / before);
            }
        }
        moves
    }

    /// Calls `visit` with the triangle and barycentric weights of each sample that is not at a vertex of the
    /// mesh.
    fn each(&self, mut visit: impl FnMut(usize, [f64; 3], &Sample)) {
        for (triangle, samples) in self.samples.faces.iter().enumerate() {
            for (sample, weights) in samples.iter().zip(WEIGHTS) {
                // The sample of an edge is in only one of its triangles.
                if sample.direction != DVec3::ZERO {
                    visit(triangle, weights, sample);
                }
            }
        }
        for Inward { triangle, weights, sample } in &self.samples.inward {
            visit(*triangle as usize, *weights, sample);
        }
    }

    fn right_hand_side(&self) -> Vec<DVec3> {
        let mut right: Vec<DVec3> = self.samples.corners.iter().map(|s| s.direction * s.distance).collect();
        self.each(|triangle, weights, s| {
            for (v, w) in self.half_edges.triangles[triangle].into_iter().zip(weights) {
                right[v as usize] += s.direction * (s.distance * w);
            }
        });
        self.zero_fixed(right)
    }

    fn zero_fixed(&self, mut x: Vec<DVec3>) -> Vec<DVec3> {
        x.iter_mut().zip(self.fixed).filter(|(_, fixed)| **fixed).for_each(|(x, _)| *x = DVec3::ZERO);
        x
    }

    fn matrix(&self) -> Matrix {
        let triangles = &self.half_edges.triangles;
        let (edges, of_half_edges) = self.edges();
        let on_vertices = self.samples.corners.iter().zip(self.stiffness);
        let vertices = on_vertices.map(|(s, k)| {
            let mut block = Symmetric::outer(s.direction, 1.0);
            block += Symmetric::scale(*k);
            block
        });
        let mut matrix = Matrix { vertices: vertices.collect(), edges };
        self.each(|triangle, weights, s| {
            for k in 0..3 {
                let (w, next) = (weights[k], weights[(k + 1) % 3]);
                matrix.vertices[triangles[triangle][k] as usize] += Symmetric::outer(s.direction, w * w);
                matrix.edges[of_half_edges[3 * triangle + k] as usize].1 +=
                    Symmetric::outer(s.direction, w * next);
            }
        });
        for (triangle, coupling) in self.coupling.iter().enumerate() {
            for k in 0..3 {
                matrix.vertices[triangles[triangle][k] as usize] += Symmetric::scale(2.0 * coupling);
                matrix.edges[of_half_edges[3 * triangle + k] as usize].1 += Symmetric::scale(-coupling);
            }
        }
        matrix
    }

    /// The edges with empty blocks, and the edge of each half-edge.
    fn edges(&self) -> (Vec<([u32; 2], Symmetric)>, Vec<u32>) {
        let corners = self.half_edges.triangles.as_flattened();
        let mut edges = Vec::with_capacity(corners.len() / 2);
        let mut of_half_edges: Vec<u32> = Vec::with_capacity(corners.len());
        for h in 0..corners.len() as u32 {
            let edge = match self.half_edges.twin(h) {
                Some(twin) if twin < h => of_half_edges[twin as usize],
                _ => {
                    edges.push(([h, next(h)].map(|h| corners[h as usize]), Symmetric::default()));
                    edges.len() as u32 - 1
                }
            };
            of_half_edges.push(edge);
        }
        (edges, of_half_edges)
    }
}

/// A symmetric matrix of 3 × 3 blocks: one on the diagonal for each vertex, and one for each edge.
struct Matrix {
    vertices: Vec<Symmetric>,
    edges: Vec<([u32; 2], Symmetric)>,
}

impl Matrix {
    fn apply(&self, x: &[DVec3]) -> Vec<DVec3> {
        let mut y: Vec<DVec3> = self.vertices.iter().zip(x).map(|(block, x)| block.apply(*x)).collect();
        for ([a, b], block) in &self.edges {
            let [a, b] = [*a as usize, *b as usize];
            y[a] += block.apply(x[b]);
            y[b] += block.apply(x[a]);
        }
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
    /// `weight` times the product of `d` with itself.
    fn outer(d: DVec3, weight: f64) -> Self {
        let scaled = d * weight;
        Self { diagonal: scaled * d, off_diagonal: scaled.yzx() * d.zxy() }
    }

    fn scale(factor: f64) -> Self {
        Self { diagonal: DVec3::splat(factor), off_diagonal: DVec3::ZERO }
    }

    fn apply(&self, x: DVec3) -> DVec3 {
        self.diagonal * x + self.off_diagonal.zxy() * x.yzx() + self.off_diagonal.yzx() * x.zxy()
    }

    /// The inverse; 0 for a matrix that is not positive definite.
    fn inverse(&self) -> DMat3 {
        let (on, off) = (self.diagonal, self.off_diagonal);
        let full = DMat3::from_cols(
            DVec3::new(on.x, off.z, off.y),
            DVec3::new(off.z, on.y, off.x),
            DVec3::new(off.y, off.x, on.z),
        );
        if full.determinant() > 0.0 { full.inverse() } else { DMat3::ZERO }
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

    /// The matrix is that of the sum of squares that the fit minimizes.
    #[test]
    fn the_matrix_is_that_of_the_costs() {
        // The face 0 1 2 has a neighbour at one edge only.
        let half_edges = HalfEdgeMesh::new(vec![[0, 1, 2], [2, 1, 3]], 4, &[]);
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
        let mut sample = || Sample { direction: vector(), distance: 0.5 };
        let mut samples = Samples {
            corners: (0..4).map(|_| sample()).collect(),
            faces: (0..2).map(|_| std::array::from_fn(|_| sample())).collect(),
            inward: vec![Inward { triangle: 1, weights: [0.2, 0.5, 0.3], sample: sample() }],
        };
        samples.faces[1][0] = Sample::default();
        let system = System {
            half_edges: &half_edges,
            samples: &samples,
            stiffness: &[0.1, 0.2, 0.3, 0.4],
            coupling: &[0.5, 0.6],
            fixed: &[false; 4],
        };
        let x: Vec<DVec3> = (0..4).map(|_| vector()).collect();
        let mut cost = 0.0;
        for ((s, k), x) in samples.corners.iter().zip(system.stiffness).zip(&x) {
            cost += s.direction.dot(*x).powi(2) + k * x.length_squared();
        }
        system.each(|t, weights, s| {
            let moved: DVec3 = (0..3).map(|k| x[half_edges.triangles[t][k] as usize] * weights[k]).sum();
            cost += s.direction.dot(moved).powi(2);
        });
        for (t, coupling) in system.coupling.iter().enumerate() {
            let [a, b, c] = half_edges.triangles[t].map(|v| x[v as usize]);
            cost +=
                coupling * ((a - b).length_squared() + (b - c).length_squared() + (c - a).length_squared());
        }
        let matrix = system.matrix();
        let product: f64 = matrix.apply(&x).iter().zip(&x).map(|(y, x)| y.dot(*x)).sum();
        assert!((product - cost).abs() < 1e-12 * cost, "{product} {cost}");
        // In every direction, not only along `x`: the blocks on the diagonal.
        for v in 0..4 {
            for unit in [DVec3::X, DVec3::Y, DVec3::Z] {
                let mut x = vec![DVec3::ZERO; 4];
                x[v] = unit;
                let column = matrix.apply(&x)[v];
                assert!((matrix.vertices[v].inverse() * column - unit).length() < 1e-9);
            }
        }
    }
}
