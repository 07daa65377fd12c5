//! Maximal Poisson-disk sampling of a surface (Guo et al. 2015), on the host in f64: points that keep a
//! distance from each other, so many that no further point fits between them.
//!
//! Distances are Euclidean, not along the surface, so two sheets closer than a radius share their points.

use super::on_surface::SitesOnSurface;
use super::surface::Surface;
use crate::mesh::hash_grid::HashGrid;
use crate::mesh::triangle::area;
use crate::{ProgressToken, Result};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::Serialize;

/// Points times radius squared over area of a maximal sampling of a plane, about (Torquato et al. 2006).
const DENSITY: f64 = 0.7;
/// Darts thrown at the whole surface, for each expected point, before gaps are searched.
const DARTS: f64 = 4.0;
/// At most this many radii are tried; then the best of them is taken.
const TRIALS: usize = 12;
/// A radius aims below the target count by this fraction, since points can be added but not removed.
const SHORT: f64 = 0.002;
/// How many points may be missing: a number, and a fraction of all.
const FEW: (usize, f64) = (2, 0.006);
/// If points are missing, the radius shrinks by this factor, again and again.
const SHRINK: f64 = 0.97;
/// Gaps smaller than this fraction of a radius count as points.
const FINE: f64 = 0.005;
/// Fragments are quartered at most this often; what is still uncovered then is below the precision of f64.
const ROUNDS: usize = 40;
/// Darts between two polls of the progress token.
const DARTS_PER_POLL: usize = 1 << 14;

/// A maximal Poisson-disk sampling of a surface.
pub struct Disks {
    /// The points in Morton order.
    pub sites: SitesOnSurface,
    /// Its figures.
    pub summary: DiskSummary,
}

/// Figures of a Poisson-disk sampling.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct DiskSummary {
    /// No two points are closer, in the surface's units.
    pub radius: f64,
    /// No point of the surface is farther from all points.
    pub covered: f64,
    /// Points that were added where the surface was farthest from all others, to reach the count; the others
    /// are random.
    pub added: usize,
    /// Radii that were tried.
    pub trials: usize,
}

impl DiskSummary {
    /// This summary in a unit of length that is `scale` times smaller.
    pub fn scaled(self, scale: f64) -> Self {
        Self { radius: scale * self.radius, covered: scale * self.covered, ..self }
    }
}

/// Exactly `count` points, at least 1, the same for the same seed on every machine.
///
/// The search is for a radius with which at most `count` random points fit, and few of them are missing.
/// Those are added one by one where the surface is farthest from all points, at a distance slightly less than
/// the radius. So both bounds, [`DiskSummary::radius`] and [`DiskSummary::covered`], hold for all points, and
/// they differ by some percent.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn disks(surface: &Surface, count: usize, seed: u64, progress: &ProgressToken) -> Result<Disks> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let area = surface.area();
    let mut radius = (DENSITY * area / count as f64).sqrt();
    let few = FEW.0 + (FEW.1 * count as f64) as usize;
    let mut best: Option<Sampling> = None;
    let mut trials = 0;
    // With a radius as large as the surface only one point fits, so the second condition comes true.
    while trials < TRIALS || best.is_none() {
        let sampling = Sampling::maximal(surface, radius, &mut rng, progress)?;
        trials += 1;
        let got = sampling.sites.len();
        let missing = count.checked_sub(got);
        if missing.is_some() && best.as_ref().is_none_or(|best| got > best.sites.len()) {
            best = Some(sampling);
        }
        if missing.is_some_and(|missing| missing <= few) {
            break;
        }
        let ratio = (got as f64 / (count as f64 * (1.0 - SHORT))).sqrt();
        // The last radii must not be too small.
        radius *= if trials < TRIALS / 2 { ratio } else { ratio.max(1.0 + 0.01 * trials as f64) };
    }
    let mut sampling = best.unwrap_or_else(|| Sampling::none(radius));
    let random = sampling.sites.len();
    let covered = sampling.fill(surface, count, progress)?;
    let summary = DiskSummary { radius: sampling.radius, covered, added: count - random, trials };
    Ok(Disks { sites: sampling.sites.in_morton_order(), summary })
}

/// Points that are at least a radius apart.
struct Sampling {
    radius: f64,
    sites: SitesOnSurface,
    grid: HashGrid<DVec3>,
}

/// A part of a triangle.
#[derive(Clone, Copy)]
struct Fragment {
    corners: [DVec3; 3],
    triangle: u32,
}

impl Fragment {
    fn area(&self) -> f64 {
        area(self.corners)
    }

    fn middle(&self) -> DVec3 {
        self.corners.iter().sum::<DVec3>() / 3.0
    }

    /// Distance of the farthest corner from the middle.
    fn reach(&self) -> f64 {
        let middle = self.middle();
        self.corners.iter().map(|c| c.distance(middle)).fold(0.0, f64::max)
    }

    fn quarters(&self) -> [Self; 4] {
        let [a, b, c] = self.corners;
        let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|corners| Self { corners, ..*self })
    }
}

impl Sampling {
    fn none(radius: f64) -> Self {
        Self { radius, sites: SitesOnSurface::default(), grid: HashGrid::new(radius, 16) }
    }

    /// Random points, until no further one fits.
    fn maximal(surface: &Surface, radius: f64, rng: &mut Pcg64Mcg, progress: &ProgressToken) -> Result<Self> {
        let expected = DENSITY * surface.area() / (radius * radius);
        let mut sampling = Self { grid: HashGrid::new(radius, expected as usize), ..Self::none(radius) };
        let mut gaps = whole(surface);
        sampling.throw(&gaps, (DARTS * expected).ceil() as usize, rng, progress)?;
        for _ in 0..ROUNDS {
            gaps = sampling.uncovered(&gaps, radius);
            if gaps.is_empty() {
                break;
            }
            sampling.throw(&gaps, gaps.len(), rng, progress)?;
            gaps = gaps.iter().flat_map(Fragment::quarters).collect();
        }
        Ok(sampling)
    }

    /// Throws darts at fragments, uniformly over their area; those farther than a radius from all points
    /// become points.
    fn throw(
        &mut self,
        at: &[Fragment],
        darts: usize,
        rng: &mut Pcg64Mcg,
        progress: &ProgressToken,
    ) -> Result<()> {
        let mut sum = 0.0;
        let cumulative: Vec<f64> = at
            .iter()
            .map(|fragment| {
                sum += fragment.area();
                sum
            })
            .collect();
        for dart in 0..darts {
            if dart % DARTS_PER_POLL == 0 {
                progress.poll()?;
            }
            let [pick, r, s] = std::array::from_fn(|_| rng.random::<f64>());
            let t = cumulative.partition_point(|c| *c <= pick * sum).min(at.len() - 1);
            let ([a, b, c], q) = (at[t].corners, r.sqrt());
            let p = a * (1.0 - q) + b * (q * (1.0 - s)) + c * (q * s);
            if !self.grid.any(p, |other| other.distance_squared(p) < self.radius * self.radius) {
                self.push(p, at[t].triangle);
            }
        }
        Ok(())
    }

    fn push(&mut self, p: DVec3, triangle: u32) {
        self.grid.insert(p, p);
        self.sites.push(p, triangle);
    }

    /// The fragments that no single ball of `radius`, at most that of the grid, around a point covers.
    fn uncovered(&self, fragments: &[Fragment], radius: f64) -> Vec<Fragment> {
        let covers = |f: &Fragment, p: DVec3| {
            f.corners.iter().all(|corner| corner.distance_squared(p) <= radius * radius)
        };
        fragments.par_iter().filter(|f| !self.grid.any(f.corners[0], |p| covers(f, p))).copied().collect()
    }

    /// Adds points where the surface is farthest from all until there are `count`; returns the largest
    /// distance of the surface from its nearest point, or a little more. The surface must be covered.
    fn fill(&mut self, surface: &Surface, count: usize, progress: &ProgressToken) -> Result<f64> {
        let mut covered = self.radius;
        while self.sites.len() < count {
            progress.poll()?;
            // Every point of the surface is within `covered`, and the grid has cells of that size.
            self.regrid(covered);
            let target = SHRINK * covered;
            let (fine, reach) = (FINE * covered, FINE * covered);
            let mut gaps = self.uncovered(&whole(surface), target);
            let mut candidates = Vec::new();
            while !gaps.is_empty() {
                let (small, large): (Vec<_>, Vec<_>) = gaps.iter().partition(|f| f.reach() <= fine);
                candidates.extend(small);
                let quarters: Vec<Fragment> = large.iter().flat_map(Fragment::quarters).collect();
                gaps = self.uncovered(&quarters, target);
            }
            let middles: Vec<DVec3> = candidates.iter().map(Fragment::middle).collect();
            let mut distances: Vec<f64> =
                middles.par_iter().map(|p| nearest(&self.grid, *p, covered)).collect();
            covered = loop {
                let farthest =
                    (0..middles.len()).max_by(|a, b| distances[*a].total_cmp(&distances[*b]).then(b.cmp(a)));
                let left = farthest.map_or(target, |at| (distances[at] + reach).max(target));
                let Some(at) = farthest.filter(|at| self.sites.len() < count && distances[*at] > target)
                else {
                    break left;
                };
                self.radius = self.radius.min(distances[at]);
                self.push(middles[at], candidates[at].triangle);
                let p = middles[at];
                distances.par_iter_mut().zip(&middles).for_each(|(d, middle)| *d = d.min(middle.distance(p)));
            };
        }
        Ok(covered)
    }

    fn regrid(&mut self, side: f64) {
        self.grid = HashGrid::new(side, self.sites.len());
        self.sites.positions.iter().for_each(|p| self.grid.insert(*p, *p));
    }
}

/// The triangles as fragments.
fn whole(surface: &Surface) -> Vec<Fragment> {
    let corners = |t: &[u32; 3]| t.map(|v| surface.vertices[v as usize]);
    let list = surface.triangles.iter().zip(0..);
    list.map(|(t, triangle)| Fragment { corners: corners(t), triangle }).collect()
}

/// Distance of the nearest point if it is below `far`, which is at most a side of the grid; else `far`.
fn nearest(grid: &HashGrid<DVec3>, p: DVec3, far: f64) -> f64 {
    let mut nearest_sq = far * far;
    grid.any(p, |q| {
        nearest_sq = nearest_sq.min(q.distance_squared(p));
        false
    });
    nearest_sq.sqrt()
}
