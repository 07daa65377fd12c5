//! Maximal Poisson-disk sampling of a surface (Guo et al. 2015), on the host in f64: points that keep a distance from each
//! other and leave no room for another one.
//!
//! Distances are straight ones, so two sheets nearer than a radius share their points.

use super::seed::Seeds;
use super::surface::Surface;
use crate::Result;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::Serialize;

/// Points times radius squared over area of a maximal sampling of a plane, about (Torquato et al. 2006).
const DENSITY: f64 = 0.7;
/// Darts that are thrown at the whole surface, for each point to be expected, before the gaps are looked at.
const DARTS: f64 = 4.0;
/// Radii that are tried at most before the best of them is taken.
const TRIALS: usize = 12;
/// The count that a radius should give is less than the one asked for by this share, since points can be added but not
/// taken away.
const SHORT: f64 = 0.002;
/// How many points may be missing: so many, and this share of all.
const FEW: (usize, f64) = (2, 0.006);
/// If points are missing, the radius shrinks by this factor at a time.
const SHRINK: f64 = 0.97;
/// Gaps smaller than this share of a radius are points.
const FINE: f64 = 0.005;
/// Fragments are quartered at most so often; what is not covered then is smaller than f64 can tell.
const ROUNDS: usize = 40;
/// Darts between two looks at whether to go on.
const DARTS_PER_LOOK: usize = 1 << 14;

/// Points on a surface that keep their distance.
pub struct Disks {
    /// The points in Morton order.
    pub seeds: Seeds,
    /// What they are.
    pub summary: DiskSummary,
}

/// How points keep their distance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct DiskSummary {
    /// No two points are closer, in the surface's units.
    pub radius: f64,
    /// No point of the surface is farther from all points.
    pub covered: f64,
    /// Points that were added at the farthest places to make up the count; the others are random.
    pub added: usize,
    /// Radii that were tried.
    pub trials: usize,
}

impl DiskSummary {
    /// The same if the unit of length is `scale` times smaller.
    pub fn scaled(self, scale: f64) -> Self {
        Self { radius: scale * self.radius, covered: scale * self.covered, ..self }
    }
}

/// Exactly `count` points, at least 1, the same for the same seed on every machine. `look` is asked several times a second
/// whether to go on.
///
/// The radius is sought that leaves room for no more than `count` random points; the few that are then missing are added
/// one by one where the surface is farthest from all points, which is nearer than a radius by as little as it takes. So both
/// promises hold for all points, with radii that differ by some percent: [`DiskSummary::radius`] and
/// [`DiskSummary::covered`].
///
/// # Errors
/// What `look` gives.
pub fn disks(
    surface: &Surface,
    count: usize,
    seed: u64,
    look: &mut dyn FnMut() -> Result<()>,
) -> Result<Disks> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let area = surface.area();
    let mut radius = (DENSITY * area / count as f64).sqrt();
    let few = FEW.0 + (FEW.1 * count as f64) as usize;
    let mut best: Option<Sampling> = None;
    let mut trials = 0;
    // A radius as large as the surface has room for one point only, so the second condition comes true.
    while trials < TRIALS || best.is_none() {
        let found = Sampling::maximal(surface, radius, &mut rng, look)?;
        trials += 1;
        let got = found.points.len();
        let missing = count.checked_sub(got);
        if missing.is_some() && best.as_ref().is_none_or(|best| got > best.points.len()) {
            best = Some(found);
        }
        if missing.is_some_and(|missing| missing <= few) {
            break;
        }
        let ratio = (got as f64 / (count as f64 * (1.0 - SHORT))).sqrt();
        // The last radii must not be too small.
        radius *= if trials < TRIALS / 2 { ratio } else { ratio.max(1.0 + 0.01 * trials as f64) };
    }
    let mut sampling = best.unwrap_or_else(|| Sampling::none(radius));
    let random = sampling.points.len();
    let covered = sampling.fill(surface, count, look)?;
    let summary = DiskSummary { radius: sampling.radius, covered, added: count - random, trials };
    let seeds = Seeds { sites: sampling.points, triangles: sampling.triangles }.in_space_order();
    Ok(Disks { seeds, summary })
}

/// Points that are at least a radius apart.
struct Sampling {
    radius: f64,
    points: Vec<DVec3>,
    triangles: Vec<u32>,
    grid: Cells,
}

/// A part of a triangle.
#[derive(Clone, Copy)]
struct Fragment {
    corners: [DVec3; 3],
    triangle: u32,
}

impl Fragment {
    fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a).length()
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
        Self { radius, points: Vec::new(), triangles: Vec::new(), grid: Cells::new(radius, 16) }
    }

    /// Random points with room for no more.
    fn maximal(
        surface: &Surface,
        radius: f64,
        rng: &mut Pcg64Mcg,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<Self> {
        let expected = DENSITY * surface.area() / (radius * radius);
        let mut found = Self { grid: Cells::new(radius, expected as usize), ..Self::none(radius) };
        let mut gaps = whole(surface);
        found.throw(&gaps, (DARTS * expected).ceil() as usize, rng, look)?;
        for _ in 0..ROUNDS {
            gaps = found.uncovered(&gaps, radius);
            if gaps.is_empty() {
                break;
            }
            found.throw(&gaps, gaps.len(), rng, look)?;
            gaps = gaps.iter().flat_map(Fragment::quarters).collect();
        }
        Ok(found)
    }

    /// Throws darts at fragments, uniformly over their area; those that keep their distance become points.
    fn throw(
        &mut self,
        at: &[Fragment],
        darts: usize,
        rng: &mut Pcg64Mcg,
        look: &mut dyn FnMut() -> Result<()>,
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
            if dart % DARTS_PER_LOOK == 0 {
                look()?;
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
        self.grid.insert(p);
        self.points.push(p);
        self.triangles.push(triangle);
    }

    /// The fragments that no single ball of `radius`, at most that of the grid, around a point covers.
    fn uncovered(&self, fragments: &[Fragment], radius: f64) -> Vec<Fragment> {
        let covers = |f: &Fragment, p: DVec3| {
            f.corners.iter().all(|corner| corner.distance_squared(p) <= radius * radius)
        };
        fragments.par_iter().filter(|f| !self.grid.any(f.corners[0], |p| covers(f, p))).copied().collect()
    }

    /// Adds points where the surface is farthest from all until there are `count`, and gives the distance that no point of
    /// the surface exceeds. The surface must be covered.
    fn fill(&mut self, surface: &Surface, count: usize, look: &mut dyn FnMut() -> Result<()>) -> Result<f64> {
        let mut covered = self.radius;
        while self.points.len() < count {
            look()?;
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
                middles.par_iter().map(|p| self.grid.nearest(*p, covered)).collect();
            covered = loop {
                let farthest =
                    (0..middles.len()).max_by(|a, b| distances[*a].total_cmp(&distances[*b]).then(b.cmp(a)));
                let left = farthest.map_or(target, |at| (distances[at] + reach).max(target));
                let Some(at) = farthest.filter(|at| self.points.len() < count && distances[*at] > target)
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
        self.grid = Cells::new(side, self.points.len());
        self.points.iter().for_each(|p| self.grid.insert(*p));
    }
}

/// The triangles as fragments.
fn whole(surface: &Surface) -> Vec<Fragment> {
    let corners = |t: &[u32; 3]| t.map(|v| surface.vertices[v as usize]);
    let list = surface.triangles.iter().zip(0..);
    list.map(|(t, triangle)| Fragment { corners: corners(t), triangle }).collect()
}

/// Points by cubes of space; cubes may share a bucket.
struct Cells {
    side: f64,
    buckets: Vec<Vec<DVec3>>,
}

impl Cells {
    fn new(side: f64, expected: usize) -> Self {
        Self { side, buckets: vec![Vec::new(); expected.max(16).next_power_of_two()] }
    }

    fn bucket(&self, cell: [i64; 3]) -> usize {
        let mixed = cell
            .iter()
            .fold(0_u64, |hash, c| (hash ^ (*c as u64)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
        mixed as usize & (self.buckets.len() - 1)
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        (p / self.side).floor().to_array().map(|c| c as i64)
    }

    fn insert(&mut self, p: DVec3) {
        let bucket = self.bucket(self.cell(p));
        self.buckets[bucket].push(p);
    }

    /// Whether any point within a side of `p` is as asked for; points farther away may be asked for, too.
    fn any(&self, p: DVec3, mut as_asked: impl FnMut(DVec3) -> bool) -> bool {
        let [x, y, z] = self.cell(p);
        let around = (0..27).map(|i| [x + (i % 3) - 1, y + (i / 3 % 3) - 1, z + i / 9 - 1]);
        around.into_iter().any(|cell| self.buckets[self.bucket(cell)].iter().any(|q| as_asked(*q)))
    }

    /// Distance of the nearest point, if it is at most a side; else `far`.
    fn nearest(&self, p: DVec3, far: f64) -> f64 {
        let mut nearest_sq = far * far;
        self.any(p, |q| {
            nearest_sq = nearest_sq.min(q.distance_squared(p));
            false
        });
        nearest_sq.sqrt()
    }
}
