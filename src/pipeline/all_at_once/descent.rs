//! Sites on their way to the least energy by L-BFGS (Liu et al. 2009): the energy is the sum over all cells of the squared
//! distance to the site, its gradient twice the cell's area times the way from the centroid. One evaluation of the cells a
//! trial, and always the whole step first.

use super::lbfgs::{Memory, dot};
use glam::{DVec3, Vec4};

/// Longest move of a site on a way that is not Lloyd's, in spacings.
const LONGEST_MOVE: f64 = 0.5;
/// Share of the fall that the gradient promises which a step must keep (Armijo's condition),
const KEPT: f64 = 1e-4;
/// and the share of the energy that f32 may add to it.
const NOISE: f64 = 1e-7;
/// A step that does not is made shorter by a factor in this range,
const SHORTER: [f64; 2] = [0.1, 0.5];
/// and after so many of them Lloyd's is taken, along which the energy never rises.
const MOST_REFUSED: u32 = 2;

/// Sites whose cells are known.
struct Known {
    sites: Vec<DVec3>,
    energy: f64,
    gradient: Vec<DVec3>,
    /// Lloyd's step over minus the gradient; 0 without a cell.
    inverse: Vec<f64>,
}

impl Known {
    fn new(sites: &[Vec4], cells: &[Vec4], energies: &[f32]) -> Self {
        let lloyd = |cell: &Vec4| if cell.w > 0.0 { 0.5 / f64::from(cell.w) } else { 0.0 };
        Self {
            sites: sites.iter().map(|s| s.truncate().as_dvec3()).collect(),
            energy: energies.iter().map(|e| f64::from(*e)).sum(),
            gradient: cells.iter().map(|c| -2.0 * c.truncate().as_dvec3()).collect(),
            inverse: cells.iter().map(lloyd).collect(),
        }
    }

    /// The ways to the centroids.
    fn lloyd(&self) -> Vec<DVec3> {
        self.gradient.iter().zip(&self.inverse).map(|(g, inverse)| -*inverse * *g).collect()
    }
}

/// Where the search stands.
pub(crate) struct Descent {
    memory: Memory,
    longest: f64,
    /// The sites whose cells are asked for, w = 0.
    trial: Vec<Vec4>,
    /// The last ones that were taken, and the way from there.
    best: Option<Known>,
    way: Vec<DVec3>,
    slope: f64,
    share: f64,
    refused: u32,
}

impl Descent {
    /// From `sites` that are `spacing` apart, with a memory of `most` motions.
    pub fn new(sites: Vec<Vec4>, spacing: f64, most: u32) -> Self {
        Self {
            memory: Memory::new(most as usize),
            longest: LONGEST_MOVE * spacing,
            trial: sites,
            best: None,
            way: Vec::new(),
            slope: 0.0,
            share: 1.0,
            refused: 0,
        }
    }

    /// Takes the cells of the sites that were asked for, and asks for others. `cells` has for each the integral of the way
    /// from the site over its cell (xyz) and the area (w), `energies` that of the squared distance.
    pub fn next(&mut self, cells: &[Vec4], energies: &[f32]) -> &[Vec4] {
        let known = Known::new(&self.trial, cells, energies);
        match self.best.take() {
            Some(best) if !self.takes(&known, &best) => self.go_back(&known, best),
            best => self.go_on(known, best),
        }
        if let Some(best) = &self.best {
            self.trial = moved(&best.sites, self.share, &self.way);
        }
        &self.trial
    }

    /// Root mean square distance of the best sites to their centroids.
    pub fn off(&self) -> f64 {
        let Some(best) = &self.best else { return 0.0 };
        let lloyd = best.lloyd();
        (dot(&lloyd, &lloyd) / lloyd.len().max(1) as f64).sqrt()
    }

    /// The end: the centroids of the best cells.
    pub fn rest(&self) -> Vec<Vec4> {
        self.best.as_ref().map_or_else(|| self.trial.clone(), |best| moved(&best.sites, 1.0, &best.lloyd()))
    }

    fn takes(&self, known: &Known, best: &Known) -> bool {
        // Lloyd's step is the last resort, and right.
        let lloyd = self.memory.is_empty() && self.share == 1.0;
        lloyd || known.energy <= best.energy * (1.0 + NOISE) + KEPT * self.share * self.slope
    }

    /// From the trial along a new way.
    fn go_on(&mut self, known: Known, last: Option<Known>) {
        if let Some(last) = last {
            let of = |new: &[DVec3], old: &[DVec3]| new.iter().zip(old).map(|(n, o)| *n - *o).collect();
            self.memory.remember(of(&known.sites, &last.sites), of(&known.gradient, &last.gradient));
        }
        self.way = self.memory.direction(&known.gradient, &known.inverse);
        if !self.memory.is_empty() {
            self.way.iter_mut().for_each(|way| *way = way.clamp_length_max(self.longest));
        }
        self.slope = dot(&self.way, &known.gradient);
        (self.share, self.refused) = (1.0, 0);
        if self.slope.is_nan() || self.slope >= 0.0 {
            self.take_lloyd(&known);
        }
        self.best = Some(known);
    }

    /// From the best along the same way, not as far; or Lloyd's.
    fn go_back(&mut self, known: &Known, best: Known) {
        self.refused += 1;
        if self.refused > MOST_REFUSED {
            self.take_lloyd(&best);
        } else {
            // Where the parabola through both energies with the slope at the best is lowest.
            let promised = self.share * self.slope;
            let bend = known.energy - best.energy - promised;
            let lowest = -0.5 * promised / bend;
            self.share *= if lowest.is_finite() { lowest.clamp(SHORTER[0], SHORTER[1]) } else { SHORTER[0] };
        }
        self.best = Some(best);
    }

    fn take_lloyd(&mut self, best: &Known) {
        self.memory.forget();
        self.way = best.lloyd();
        self.slope = dot(&self.way, &best.gradient);
        (self.share, self.refused) = (1.0, 0);
    }
}

fn moved(sites: &[DVec3], share: f64, way: &[DVec3]) -> Vec<Vec4> {
    sites.iter().zip(way).map(|(site, way)| (*site + share * *way).as_vec3().extend(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One site with a cell of area 1 whose centroid is that far away along x; gives where it is to go.
    fn told(descent: &mut Descent, off: f32, energy: f32) -> f32 {
        descent.next(&[Vec4::new(off, 0.0, 0.0, 1.0)], &[energy])[0].x
    }

    #[test]
    fn steps_that_raise_the_energy_get_shorter_and_then_lloyds() {
        let mut descent = Descent::new(vec![Vec4::ZERO], 1.0, 7);
        assert_eq!(told(&mut descent, 0.3, 1.0), 0.3, "first Lloyd's");
        assert!((descent.off() - 0.3).abs() < 1e-6);
        // The gradient falls by a third, so its end is twice as far again; no step is longer than half a spacing.
        assert!((told(&mut descent, 0.2, 0.9) - 0.8).abs() < 1e-6);
        let shorter = told(&mut descent, -0.3, 2.0);
        assert!((0.349..0.551).contains(&shorter), "{shorter}");
        let shortest = told(&mut descent, -0.3, 1.5);
        assert!(shortest < shorter && shortest > 0.3, "{shortest} after {shorter}");
        assert!((told(&mut descent, -0.3, 1.5) - 0.5).abs() < 1e-6, "Lloyd's from the best");
        assert!((descent.off() - 0.2).abs() < 1e-6 && (descent.rest()[0].x - 0.5).abs() < 1e-6);
        // That is taken whatever the energy is, and the end is the centroid of the best.
        told(&mut descent, 0.1, 0.95);
        assert!((descent.rest()[0].x - 0.6).abs() < 1e-6);
    }

    #[test]
    fn sites_without_a_cell_stay() {
        let mut descent = Descent::new(vec![Vec4::X], 1.0, 7);
        assert_eq!(descent.next(&[Vec4::ZERO], &[0.0]), [Vec4::X]);
        assert_eq!((descent.rest(), descent.off()), (vec![Vec4::X], 0.0));
    }
}
