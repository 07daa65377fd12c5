//! Normals by principal components: the direction in which the points around one vary least (Hoppe et al.
//! 1992, "Surface reconstruction from unorganized points").

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::neighbours::median;
use crate::mesh::kd_tree::KdTree;
use crate::{ProgressToken, Result};

/// Points that a thread does at a time.
const CHUNK: usize = 1 << 9;
/// Points at which a cloud is judged, at most.
const SAMPLES: usize = 1000;
/// Rounds of Jacobi's method; it converges quadratically, in 4 to 6.
const ROUNDS: usize = 12;

/// Points thicker than most by this many spacings may be on one of two sheets.
const MORE: f64 = 0.1;
/// A sheet without noise is as thick as this, in spacings.
pub(super) const WIDTH: f64 = 0.2;
/// One less than the points that planes are tried through.
const CORNERS: usize = 8;
/// Two edges span a plane only if the sine of the angle between them is larger than this.
const NARROW: f64 = 0.1;
/// A plane of one sheet has at least this many more points on it than the plane through all points, as a
/// fraction of the points: less is curvature.
const GAIN: f64 = 0.2;
/// How often a plane is fitted to the points near it.
const REFITS: usize = 4;

/// Axes of a point's surroundings.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    /// Of length 1 and either sign.
    pub normal: DVec3,
    /// Standard deviations along the normal and the two other axes, ascending.
    pub extents: [f64; 3],
}

/// The plane through the `count` nearest points of each; if there are `normals`, of those on the same side.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn planes(
    points: &[DVec3],
    normals: &[DVec3],
    tree: &KdTree,
    count: usize,
    progress: &ProgressToken,
) -> Result<Vec<Plane>> {
    let chunks: Vec<Vec<Plane>> = points
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, here)| {
            progress.poll()?;
            let mut found = Vec::new();
            let plane = |(k, p): (usize, &DVec3)| {
                tree.nearest_few(*p, count, &mut found);
                if let Some(own) = normals.get(chunk * CHUNK + k) {
                    // That of a neighbour may be unknown.
                    found.retain(|(_, i)| normals[*i as usize].dot(*own) >= 0.0);
                }
                plane(found.iter().map(|(_, i)| points[*i as usize] - *p))
            };
            Ok(here.iter().enumerate().map(plane).collect())
        })
        .collect::<Result<_>>()?;
    Ok(chunks.concat())
}

/// Where two sheets touch, the plane through all points around one is that of neither. There, the plane of
/// the point's own sheet takes its place: of planes through the point and two others, the one that most lie
/// on, fitted to those.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn with_own_sheets(
    points: &[DVec3],
    tree: &KdTree,
    count: usize,
    spacing: &[f64],
    shapes: &mut [Plane],
    progress: &ProgressToken,
) -> Result<()> {
    let thickness = noise(shapes, spacing);
    let width = WIDTH + thickness;
    let chunks = shapes.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).zip(spacing.par_chunks(CHUNK));
    chunks.try_for_each(|((shapes, points_here), spacing)| {
        progress.poll()?;
        let (mut found, mut around) = (Vec::new(), Vec::new());
        for ((shape, p), spacing) in shapes.iter_mut().zip(points_here).zip(spacing) {
            if shape.extents[0] < (MORE + 1.5 * thickness) * spacing {
                continue;
            }
            tree.nearest_few(*p, count, &mut found);
            around.clear();
            around.extend(found.iter().map(|(_, i)| points[*i as usize] - *p));
            *shape = own_sheet(&around, *shape, width * spacing);
        }
        Ok(())
    })
}

/// The plane of the points near the origin's own sheet, which is about as thick as `width`.
fn own_sheet(around: &[DVec3], all: Plane, width: f64) -> Plane {
    let on = |normal: DVec3, d: &DVec3| 1.0 / (1.0 + (normal.dot(*d) / width).powi(2));
    let score = |normal: DVec3| around.iter().map(|d| on(normal, d)).sum::<f64>();
    let some: Vec<DVec3> = (1..CORNERS).map(|k| around[k * around.len() / CORNERS]).collect();
    let first = score(all.normal);
    let mut best = (first, all.normal);
    for (k, a) in some.iter().enumerate() {
        for b in &some[k + 1..] {
            let across = a.cross(*b);
            // Points almost in a line with the origin say little.
            if across.length() > NARROW * a.length() * b.length() {
                let normal = across.normalize();
                let score = score(normal);
                if score > best.0 {
                    best = (score, normal);
                }
            }
        }
    }
    if best.0 < first + GAIN * around.len() as f64 {
        return all;
    }
    let mut found = Plane { normal: best.1, ..all };
    for _ in 0..REFITS {
        let weighted = around.iter().map(|d| (*d, on(found.normal, d).powi(2)));
        found = weighted_plane(weighted);
    }
    found
}

/// How thick the `count` points around one are: their least extent relative to the next, the median of some.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub(super) fn relative_thickness(
    points: &[DVec3],
    tree: &KdTree,
    count: usize,
    progress: &ProgressToken,
) -> Result<f64> {
    let some: Vec<DVec3> = points.iter().step_by(points.len().div_ceil(SAMPLES)).copied().collect();
    let ratio = |p: &DVec3| {
        progress.poll()?;
        let mut found = Vec::new();
        tree.nearest_few(*p, count, &mut found);
        let [least, next, _] = plane(found.iter().map(|(_, i)| points[*i as usize] - *p)).extents;
        Ok(least / next.max(f64::MIN_POSITIVE))
    };
    let ratios: Vec<f64> = some.par_iter().map(ratio).collect::<Result<_>>()?;
    Ok(median(ratios.into_iter()))
}

/// The standard deviation of points from their planes, in spacings: what noise or curvature there is.
pub(super) fn noise(planes: &[Plane], spacing: &[f64]) -> f64 {
    median(planes.iter().zip(spacing).map(|(plane, spacing)| plane.extents[0] / spacing))
}

fn plane(points: impl Iterator<Item = DVec3> + Clone) -> Plane {
    weighted_plane(points.map(|p| (p, 1.0)))
}

/// Of points with weights.
fn weighted_plane(points: impl Iterator<Item = (DVec3, f64)> + Clone) -> Plane {
    let (mut weight, mut centre) = (0.0, DVec3::ZERO);
    for (p, w) in points.clone() {
        weight += w;
        centre += w * p;
    }
    centre /= weight;
    let mut spread = DMat3::ZERO;
    for (p, w) in points {
        let d = p - centre;
        spread += w * DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let (values, axes) = eigen(spread * (1.0 / weight));
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
