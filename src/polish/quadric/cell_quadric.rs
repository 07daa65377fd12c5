//! The integrals over a cell from which its site's best place follows.

use glam::{DMat3, DVec3};

/// The integrals over a cell, with positions relative to its site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CellQuadric {
    /// `∫ dA`.
    pub area: f64,
    /// `∫ x dA`.
    pub first: DVec3,
    /// `∫ n dA`.
    pub normal: DVec3,
    /// `∫ n nᵀ dA`.
    normals: DMat3,
    /// `∫ n (n·x) dA`.
    offsets: DVec3,
}

impl CellQuadric {
    pub const ZERO: Self = Self {
        area: 0.0,
        first: DVec3::ZERO,
        normal: DVec3::ZERO,
        normals: DMat3::ZERO,
        offsets: DVec3::ZERO,
    };

    /// Adds a piece of the cell at `x`, with its unit normal and area.
    pub fn add(&mut self, x: DVec3, normal: DVec3, area: f64) {
        let n = normal * area;
        self.area += area;
        self.first += x * area;
        self.normal += n;
        self.normals += DMat3::from_cols(n * normal.x, n * normal.y, n * normal.z);
        self.offsets += n * normal.dot(x);
    }

    /// Where `∫ |x − s|² + weight (n·(x − s))² dA` is least; the site itself for an empty cell.
    pub fn minimum(&self, weight: f64) -> DVec3 {
        if self.area <= 0.0 {
            return DVec3::ZERO;
        }
        let matrix = DMat3::from_diagonal(DVec3::splat(self.area)) + self.normals * weight;
        matrix.inverse() * (self.first + self.offsets * weight)
    }

    /// How much the surface turns in the cell: the mean squared sine of the angle to the mean normal.
    pub fn turn(&self) -> f64 {
        let mean = self.normal.normalize_or_zero();
        1.0 - mean.dot(self.normals * mean) / self.area.max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// The energy as it is written, of pieces with position, normal and area.
    fn energy(pieces: &[(DVec3, DVec3, f64)], weight: f64, s: DVec3) -> f64 {
        let of = |(x, n, area): &(DVec3, DVec3, f64)| {
            area * ((*x - s).length_squared() + weight * n.dot(*x - s).powi(2))
        };
        pieces.iter().map(of).sum()
    }

    #[test]
    fn the_energy_is_least_at_the_minimum() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
        let pieces: Vec<(DVec3, DVec3, f64)> =
            (0..20).map(|_| (vector(), vector().normalize(), vector().x.abs() + 0.1)).collect();
        let mut quadric = CellQuadric::ZERO;
        pieces.iter().for_each(|(x, n, area)| quadric.add(*x, *n, *area));
        for weight in [0.0, 1.0, 10.0] {
            let least = quadric.minimum(weight);
            for _ in 0..20 {
                // Quadratic, so the same step either way costs the same.
                let step = vector() * 0.1;
                let [one, other] = [least + step, least - step].map(|s| energy(&pieces, weight, s));
                assert!(one > energy(&pieces, weight, least));
                assert!((one - other).abs() < 1e-12 * one, "{weight}: {one} {other}");
            }
        }
    }

    #[test]
    fn a_cell_across_a_ridge_has_its_minimum_near_it() {
        // Two sides that meet at the z axis at a right angle.
        let mut quadric = CellQuadric::ZERO;
        for k in 0..10 {
            let off = 0.1 * (f64::from(k) + 0.5);
            quadric.add(DVec3::new(off, 0.0, 0.0), DVec3::Y, 0.1);
            quadric.add(DVec3::new(0.0, off, 0.0), DVec3::X, 0.1);
        }
        // The centroid is at a quarter; planes hold it back by half the weight in each direction.
        for weight in [0.0, 4.0, 10.0] {
            let expected = 0.25 / (1.0 + 0.5 * weight);
            assert!((quadric.minimum(weight) - DVec3::new(expected, expected, 0.0)).length() < 1e-12);
        }
        assert!((quadric.turn() - 0.5).abs() < 1e-12);
        assert_eq!(CellQuadric::ZERO.minimum(10.0), DVec3::ZERO);
    }
}
