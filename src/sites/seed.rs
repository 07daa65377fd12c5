//! The start: random points on the surface.

use super::morton::morton_order;
use super::surface::Surface;
use crate::mesh::sizing::SizeField;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Sites before the first iteration, in Morton order.
pub struct Seeds {
    /// Positions in the unit-diagonal frame.
    pub sites: Vec<DVec3>,
    /// The surface triangle under each.
    pub triangles: Vec<u32>,
}

/// `count` points, uniform over the surface's area, the same for the same seed on every machine.
pub fn random(surface: &Surface, count: usize, seed: u64) -> Seeds {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut sum = 0.0;
    let cumulative: Vec<f64> = surface
        .areas
        .iter()
        .map(|a| {
            sum += a;
            sum
        })
        .collect();
    let mut sites = Vec::with_capacity(count);
    let mut triangles = Vec::with_capacity(count);
    for _ in 0..count {
        let [pick, r, s] = std::array::from_fn(|_| rng.random::<f64>());
        // The clamp only matters where rounding puts the pick past the last sum.
        let t = cumulative.partition_point(|c| *c <= pick * sum).min(cumulative.len() - 1);
        let [a, b, c] = surface.triangles[t].map(|v| surface.vertices[v as usize]);
        let q = r.sqrt();
        sites.push(a * (1.0 - q) + b * (q * (1.0 - s)) + c * (q * s));
        triangles.push(t as u32);
    }
    Seeds { sites, triangles }.in_space_order()
}

/// `count` points, one for each equal share of the surface's area when its triangles are passed in Morton order: more
/// evenly spread than [`random`] ones. Where `sizes` has short edges, area counts for more.
pub fn stratified(surface: &Surface, sizes: &SizeField, count: usize, seed: u64) -> Seeds {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let centres: Vec<DVec3> = surface
        .triangles
        .iter()
        .map(|t| t.iter().map(|v| surface.vertices[*v as usize]).sum::<DVec3>() / 3.0)
        .collect();
    let worth = |t: usize| surface.areas[t] * sizes.crowd(t);
    let share = (0..surface.areas.len()).map(worth).sum::<f64>() / count as f64;
    let mut seeds = Seeds { sites: Vec::with_capacity(count), triangles: Vec::with_capacity(count) };
    let mut passed = 0.0;
    for t in morton_order(&centres) {
        passed += worth(t as usize);
        let [a, b, c] = surface.triangles[t as usize].map(|v| surface.vertices[v as usize]);
        // Half a share off, so that rounding cannot lose the last site.
        while seeds.sites.len() < count && (seeds.sites.len() as f64 + 0.5) * share <= passed {
            let site = loop {
                let [r, s] = std::array::from_fn(|_| rng.random::<f64>());
                let q = r.sqrt();
                let site = a * (1.0 - q) + b * (q * (1.0 - s)) + c * (q * s);
                // Where edges are longest in the triangle, the least of the points stay.
                if sizes.is_uniform()
                    || rng.random::<f64>() * sizes.at(site, t).powi(2) <= sizes.least_in(t).powi(2)
                {
                    break site;
                }
            };
            seeds.sites.push(site);
            seeds.triangles.push(t);
        }
    }
    seeds.in_space_order()
}

impl Seeds {
    /// The same sites in Morton order.
    pub fn in_space_order(self) -> Self {
        let order = morton_order(&self.sites);
        Self {
            sites: order.iter().map(|i| self.sites[*i as usize]).collect(),
            triangles: order.iter().map(|i| self.triangles[*i as usize]).collect(),
        }
    }
}
