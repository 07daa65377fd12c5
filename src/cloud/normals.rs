//! Normals by principal components: the direction in which the points around one vary least (Hoppe et al.
//! 1992, "Surface reconstruction from unorganized points").

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::neighbours::median;
use crate::mesh::kd_tree::KdTree;
use crate::{ProgressToken, Result};

/// Points that a thread does at a time.
const CHUNK: usize = 1 << 9;
/// Rounds of Jacobi's method; it converges quadratically, in 4 to 6.
const ROUNDS: usize = 12;

/// Axes of a point's surroundings.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    /// Of length 1 and either sign.
    pub normal: DVec3,
    /// Standard deviations along the normal and the two other axes, ascending.
    pub extents: [f64; 3],
}

/// The plane through the `count` nearest points of each.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn planes(
    points: &[DVec3],
    tree: &KdTree,
    count: usize,
    progress: &ProgressToken,
) -> Result<Vec<Plane>> {
    let chunks: Vec<Vec<Plane>> = points
        .par_chunks(CHUNK)
        .map(|chunk| {
            progress.poll()?;
            let mut found = Vec::new();
            let plane = |p: &DVec3| {
                tree.nearest_few(*p, count, &mut found);
                plane(found.iter().map(|(_, i)| points[*i as usize] - *p))
            };
            Ok(chunk.iter().map(plane).collect())
        })
        .collect::<Result<_>>()?;
    Ok(chunks.concat())
}

/// The standard deviation of points from their planes, in spacings: what noise or curvature there is.
pub(super) fn noise(planes: &[Plane], spacing: &[f64]) -> f64 {
    median(planes.iter().zip(spacing).map(|(plane, spacing)| plane.extents[0] / spacing))
}

fn plane(points: impl Iterator<Item = DVec3> + Clone) -> Plane {
    let count = points.clone().count() as f64;
    let centre = points.clone().sum::<DVec3>() / count;
    let mut spread = DMat3::ZERO;
    for p in points {
        let d = p - centre;
        spread += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let (values, axes) = eigen(spread * (1.0 / count));
    let extents = values.map(|value| value.max(0.0).sqrt());
    Plane { normal: axes[0], extents }
}

/// Eigenvalues of a symmetric matrix, ascending, and their vectors of length 1, by Jacobi's rotations (Golub
/// and Van Loan, "Matrix Computations", section 8.5).
pub(super) fn eigen(matrix: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let mut a = matrix.to_cols_array_2d();
    let mut axes = DMat3::IDENTITY;
    for _ in 0..ROUNDS {
        let off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        let on = a[0][0] * a[0][0] + a[1][1] * a[1][1] + a[2][2] * a[2][2];
        if off <= 1e-30 * on {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let s = t * c;
            for row in &mut a {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (x, y) = (a[p], a[q]);
            a[p] = [0, 1, 2].map(|k| c * x[k] - s * y[k]);
            a[q] = [0, 1, 2].map(|k| s * x[k] + c * y[k]);
            let (x, y) = (axes.col(p), axes.col(q));
            *axes.col_mut(p) = c * x - s * y;
            *axes.col_mut(q) = s * x + c * y;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]));
    (order.map(|k| a[k][k]), order.map(|k| axes.col(k)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_are_those_of_a_rotated_diagonal() {
        let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        let matrix = turn * DMat3::from_diagonal(DVec3::new(4.0, 0.25, 1.0)) * turn.transpose();
        let (values, axes) = eigen(matrix);
        for ((value, axis), (want, column)) in values.iter().zip(axes).zip([(0.25, 1), (1.0, 2), (4.0, 0)]) {
            assert!((value - want).abs() < 1e-12, "{values:?}");
            assert!((axis.dot(turn.col(column)).abs() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn points_of_a_plane_have_its_normal() {
        let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let (u, v) = normal.any_orthonormal_pair();
        let at = |i: i32| f64::from(i % 5) * u + f64::from(i / 5) * v;
        let found = plane((0..25).map(at));
        assert!(found.normal.dot(normal).abs() > 1.0 - 1e-12 && found.extents[0] < 1e-7);
        assert!((found.extents[2] - 2_f64.sqrt()).abs() < 1e-12);
    }
}
