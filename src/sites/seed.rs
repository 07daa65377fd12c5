//! Initial sites: random points on the surface.

use super::morton::morton_order;
use super::on_surface::SitesOnSurface;
use super::surface::Surface;
use crate::mesh::sizing::SizeField;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// `count` points, uniform over the surface's area, in Morton order; the same for the same seed on every
/// machine. Where `sizes` has short edges, area counts for more.
pub fn random(surface: &Surface, sizes: &SizeField, count: usize, seed: u64) -> SitesOnSurface {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut sum = 0.0;
    let cumulative: Vec<f64> = surface
        .areas
        .iter()
        .enumerate()
        .map(|(t, area)| {
            sum += area * sizes.density(t);
            sum
        })
        .collect();
    let mut sites = SitesOnSurface::with_capacity(count);
    for _ in 0..count {
        let [pick, r, s] = std::array::from_fn(|_| rng.random::<f64>());
        // The clamp only matters where rounding puts the pick past the last sum.
        let t = cumulative.partition_point(|c| *c <= pick * sum).min(cumulative.len() - 1);
        let [a, b, c] = surface.triangles[t].map(|v| surface.vertices[v as usize]);
        let q = r.sqrt();
        sites.push(a * (1.0 - q) + b * (q * (1.0 - s)) + c * (q * s), t as u32);
    }
    sites.in_morton_order()
}

/// `count` points in Morton order, one for each equal share of the surface's area when its triangles are
/// passed in Morton order: more evenly spread than [`random`] ones. Where `sizes` has short edges, area
/// counts for more.
pub fn stratified(surface: &Surface, sizes: &SizeField, count: usize, seed: u64) -> SitesOnSurface {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let centres: Vec<DVec3> = surface
        .triangles
        .iter()
        .map(|t| t.iter().map(|v| surface.vertices[*v as usize]).sum::<DVec3>() / 3.0)
        .collect();
    let weight = |t: usize| surface.areas[t] * sizes.density(t);
    let share = (0..surface.areas.len()).map(weight).sum::<f64>() / count as f64;
    let mut sites = SitesOnSurface::with_capacity(count);
    let mut passed = 0.0;
    for t in morton_order(&centres) {
        passed += weight(t as usize);
        let [a, b, c] = surface.triangles[t as usize].map(|v| surface.vertices[v as usize]);
        // Half a share off, so that rounding cannot lose the last site.
        while sites.len() < count && (sites.len() as f64 + 0.5) * share <= passed {
            let position = loop {
                let [r, s] = std::array::from_fn(|_| rng.random::<f64>());
                let q = r.sqrt();
                let position = a * (1.0 - q) + b * (q * (1.0 - s)) + c * (q * s);
                // Rejection sampling: the fewest points stay where the triangle's edges are to be longest.
                if sizes.is_uniform()
                    || rng.random::<f64>() * sizes.at(position, t).powi(2) <= sizes.least_in(t).powi(2)
                {
                    break position;
                }
            };
            sites.push(position, t);
        }
    }
    sites.in_morton_order()
}
