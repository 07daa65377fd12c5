//! The least-squares plane through points.

use glam::{DMat3, DVec3};

/// Eigenvalues of the covariance in ascending order and the unit normal that belongs to the smallest.
pub struct Fit {
    pub eigenvalues: [f64; 3],
    pub normal: DVec3,
}

/// Fits a plane, by the closed form for the eigenvalues of a symmetric 3 × 3 matrix.
pub fn plane_fit(points: &[DVec3]) -> Fit {
    let mean = points.iter().sum::<DVec3>() / points.len() as f64;
    let mut m = DMat3::ZERO;
    for p in points {
        let d = *p - mean;
        m += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let eigenvalues = eigenvalues(m);
    // Every column of (M - b)(M - c) lies in the eigenspace of a, by Cayley and Hamilton.
    let shifted = |e: f64| m - DMat3::from_diagonal(DVec3::splat(e));
    let product = shifted(eigenvalues[1]) * shifted(eigenvalues[2]);
    let columns = [product.x_axis, product.y_axis, product.z_axis];
    let longest = columns.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    Fit { eigenvalues, normal: longest.unwrap().normalize_or_zero() }
}

fn eigenvalues(m: DMat3) -> [f64; 3] {
    let q = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let off = m - DMat3::from_diagonal(DVec3::splat(q));
    let p = ((off.x_axis.length_squared() + off.y_axis.length_squared() + off.z_axis.length_squared()) / 6.0)
        .sqrt();
    if p == 0.0 {
        return [q; 3];
    }
    let phi = (0.5 * (off * (1.0 / p)).determinant()).clamp(-1.0, 1.0).acos() / 3.0;
    let high = q + 2.0 * p * phi.cos();
    let low = q + 2.0 * p * (phi + 2.0 * std::f64::consts::PI / 3.0).cos();
    [low, 3.0 * q - high - low, high]
}
