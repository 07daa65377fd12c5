//! The normal equations of the fit, by conjugate gradients.

use glam::{DMat3, DVec3};

use super::samples::{Inward, Sample, Samples};

/// Weights of a face's corners at the samples on its edges and in its middle.
const WEIGHTS: [[f64; 3]; 4] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0; 3]];

/// What is to be as small as possible.
pub(super) struct System<'a> {
    pub triangles: &'a [[u32; 3]],
    pub samples: &'a Samples,
    /// What the square of a move costs, for each vertex.
    pub stiffness: &'a [f64],
    /// What the squared difference of the moves of two corners costs, for each triangle.
    pub coupling: &'a [f64],
    /// Vertices that stay.
    pub locked: &'a [bool],
}

impl System<'_> {
    /// The moves after at most `steps` steps from none, with the 3 × 3 blocks of the diagonal as preconditioner. In one
    /// thread, so that the order of the sums is always the same.
    pub fn solve(&self, steps: u32) -> Vec<DVec3> {
        let inverse = self.inverse_diagonal();
        let dot = |x: &[DVec3], y: &[DVec3]| -> f64 { x.iter().zip(y).map(|(a, b)| a.dot(*b)).sum() };
        let scaled = |r: &[DVec3]| -> Vec<DVec3> { r.iter().zip(&inverse).map(|(r, m)| *m * *r).collect() };
        let mut residual = self.right();
        let mut moves = vec![DVec3::ZERO; residual.len()];
        let mut z = scaled(&residual);
        let mut direction = z.clone();
        let mut rho = dot(&residual, &z);
        for _ in 0..steps {
            let product = self.apply(&direction);
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

    /// Calls `visit` with the corners, their weights, and each sample on faces.
    fn each(&self, mut visit: impl FnMut([u32; 3], [f64; 3], &Sample)) {
        for (triangle, samples) in self.triangles.iter().zip(&self.samples.faces) {
            for (sample, weights) in samples.iter().zip(WEIGHTS) {
                visit(*triangle, weights, sample);
            }
        }
        for Inward { triangle, weights, sample } in &self.samples.inward {
            visit(self.triangles[*triangle as usize], *weights, sample);
        }
    }

    fn right(&self) -> Vec<DVec3> {
        let mut right: Vec<DVec3> = self.samples.corners.iter().map(|s| s.direction * s.distance).collect();
        self.each(|triangle, weights, s| {
            for (v, w) in triangle.into_iter().zip(weights) {
                right[v as usize] += s.direction * (s.distance * w);
            }
        });
        self.hold(right)
    }

    fn hold(&self, mut x: Vec<DVec3>) -> Vec<DVec3> {
        x.iter_mut().zip(self.locked).filter(|(_, locked)| **locked).for_each(|(x, _)| *x = DVec3::ZERO);
        x
    }

    /// The matrix times `x`.
    fn apply(&self, x: &[DVec3]) -> Vec<DVec3> {
        let on_vertices = self.samples.corners.iter().zip(self.stiffness).zip(x);
        let mut y: Vec<DVec3> =
            on_vertices.map(|((s, k), x)| s.direction * s.direction.dot(*x) + *x * *k).collect();
        self.each(|triangle, [p, q, r], s| {
            let [a, b, c] = triangle.map(|v| v as usize);
            let along = s.direction.dot(x[a] * p + x[b] * q + x[c] * r);
            y[a] += s.direction * (along * p);
            y[b] += s.direction * (along * q);
            y[c] += s.direction * (along * r);
        });
        for (triangle, coupling) in self.triangles.iter().zip(self.coupling) {
            let [a, b, c] = triangle.map(|v| v as usize);
            let sum = x[a] + x[b] + x[c];
            for v in [a, b, c] {
                y[v] += (x[v] * 3.0 - sum) * *coupling;
            }
        }
        self.hold(y)
    }

    fn inverse_diagonal(&self) -> Vec<DMat3> {
        let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        let mut diagonal: Vec<DMat3> = (self.samples.corners.iter().zip(self.stiffness))
            .map(|(s, k)| outer(s.direction) + DMat3::IDENTITY * *k)
            .collect();
        self.each(|triangle, weights, s| {
            for (v, w) in triangle.into_iter().zip(weights) {
                diagonal[v as usize] += outer(s.direction * w);
            }
        });
        for (triangle, coupling) in self.triangles.iter().zip(self.coupling) {
            triangle.iter().for_each(|v| diagonal[*v as usize] += DMat3::IDENTITY * (2.0 * coupling));
        }
        let invert = |m: DMat3| if m.determinant() > 0.0 { m.inverse() } else { DMat3::ZERO };
        diagonal.into_iter().map(invert).collect()
    }
}
