//! Minimization of the CVT energy by L-BFGS (Liu et al. 2009): the energy is the integral of the squared
//! distance to the site over all cells, its gradient twice the cell's area times the vector from the centroid
//! to the site. Each trial takes one evaluation of the cells, and the full step is always tried first.

use super::lbfgs::{Memory, dot};
use glam::{DVec3, Vec4};

/// Longest move of a site along a direction that is not Lloyd's, in spacings.
const LONGEST_MOVE: f64 = 0.5;
/// A step is accepted if the energy falls by this fraction of what the gradient predicts (Armijo's
/// condition).
const ARMIJO: f64 = 1e-4;
/// Armijo's condition may be missed by this fraction of the energy, for rounding in f32.
const NOISE: f64 = 1e-7;
/// A step that is not accepted is shortened by a factor in this range.
const SHORTER: [f64; 2] = [0.1, 0.5];
/// If more steps than this are refused, Lloyd's step is taken, along which the energy never rises.
const MOST_REFUSED: u32 = 2;

/// Sites with the energy of their cells.
struct Evaluated {
    sites: Vec<DVec3>,
    energy: f64,
    gradient: Vec<DVec3>,
    /// Lloyd's step over minus the gradient; 0 without a cell.
    inverse: Vec<f64>,
}

impl Evaluated {
    fn new(sites: &[Vec4], cells: &[Vec4], energies: &[f32]) -> Self {
        let lloyd = |cell: &Vec4| if cell.w > 0.0 { 0.5 / f64::from(cell.w) } else { 0.0 };
        Self {
            sites: sites.iter().map(|s| s.truncate().as_dvec3()).collect(),
            energy: energies.iter().map(|e| f64::from(*e)).sum(),
            gradient: cells.iter().map(|c| -2.0 * c.truncate().as_dvec3()).collect(),
            inverse: cells.iter().map(lloyd).collect(),
        }
    }

    /// The vectors to the centroids.
    fn lloyd(&self) -> Vec<DVec3> {
        self.gradient.iter().zip(&self.inverse).map(|(g, inverse)| -*inverse * *g).collect()
    }
}

/// State of the minimization.
pub(crate) struct Descent {
    memory: Memory,
    longest: f64,
    /// The sites to be evaluated next, w = 0.
    trial: Vec<Vec4>,
    /// The last accepted sites, the search direction from there, and the energy's derivative along it.
    best: Option<Evaluated>,
    direction: Vec<DVec3>,
    slope: f64,
    /// Step length of the trial, as a fraction of the direction.
    fraction: f64,
    refused: u32,
}

impl Descent {
    /// From `sites` with this spacing, with a memory of at most `most` motions.
    pub fn new(sites: Vec<Vec4>, spacing: f64, most: u32) -> Self {
        Self {
            memory: Memory::new(most as usize),
            longest: LONGEST_MOVE * spacing,
            trial: sites,
            best: None,
            direction: Vec::new(),
            slope: 0.0,
            fraction: 1.0,
            refused: 0,
        }
    }

    /// Evaluates the last trial from its cells and returns the next trial. `cells` has for each site the
    /// integral of the vector from the site over its cell (xyz) and the area (w), `energies` the integral of
    /// the squared distance.
    pub fn next_trial(&mut self, cells: &[Vec4], energies: &[f32]) -> &[Vec4] {
        let trial = Evaluated::new(&self.trial, cells, energies);
        match self.best.take() {
            Some(best) if !self.accepts(&trial, &best) => self.shorten(&trial, best),
            best => self.advance(trial, best),
        }
        if let Some(best) = &self.best {
            self.trial = move_sites(&best.sites, self.fraction, &self.direction);
        }
        &self.trial
    }

    /// Root mean square distance of the best sites to their centroids.
    pub fn distance_to_centroids(&self) -> f64 {
        let Some(best) = &self.best else { return 0.0 };
        let lloyd = best.lloyd();
        (dot(&lloyd, &lloyd) / lloyd.len().max(1) as f64).sqrt()
    }

    /// The result: the centroids of the best cells.
    pub fn final_sites(&self) -> Vec<Vec4> {
        self.best
            .as_ref()
            .map_or_else(|| self.trial.clone(), |best| move_sites(&best.sites, 1.0, &best.lloyd()))
    }

    fn accepts(&self, trial: &Evaluated, best: &Evaluated) -> bool {
        // Lloyd's step is the last resort, and never raises the energy.
        let lloyd = self.memory.is_empty() && self.fraction == 1.0;
        lloyd || trial.energy <= best.energy * (1.0 + NOISE) + ARMIJO * self.fraction * self.slope
    }

    /// Accepts the trial and chooses a new direction from there.
    fn advance(&mut self, trial: Evaluated, last: Option<Evaluated>) {
        if let Some(last) = last {
            let of = |new: &[DVec3], old: &[DVec3]| new.iter().zip(old).map(|(n, o)| *n - *o).collect();
            self.memory.remember(of(&trial.sites, &last.sites), of(&trial.gradient, &last.gradient));
        }
        self.direction = self.memory.direction(&trial.gradient, &trial.inverse);
        if !self.memory.is_empty() {
            self.direction.iter_mut().for_each(|step| *step = step.clamp_length_max(self.longest));
        }
        self.slope = dot(&self.direction, &trial.gradient);
        (self.fraction, self.refused) = (1.0, 0);
        if self.slope.is_nan() || self.slope >= 0.0 {
            self.take_lloyd(&trial);
        }
        self.best = Some(trial);
    }

    /// Shortens the step from the best sites along the same direction, or changes to Lloyd's step.
    fn shorten(&mut self, trial: &Evaluated, best: Evaluated) {
        self.refused += 1;
        if self.refused > MOST_REFUSED {
            self.take_lloyd(&best);
        } else {
            // The minimum of the parabola through both energies with the slope at the best.
            let predicted = self.fraction * self.slope;
            let bend = trial.energy - best.energy - predicted;
            let lowest = -0.5 * predicted / bend;
            self.fraction *=
                if lowest.is_finite() { lowest.clamp(SHORTER[0], SHORTER[1]) } else { SHORTER[0] };
        }
        self.best = Some(best);
    }

    fn take_lloyd(&mut self, best: &Evaluated) {
        self.memory.forget();
        self.direction = best.lloyd();
        self.slope = dot(&self.direction, &best.gradient);
        (self.fraction, self.refused) = (1.0, 0);
    }
}

fn move_sites(sites: &[DVec3], fraction: f64, direction: &[DVec3]) -> Vec<Vec4> {
    sites.iter().zip(direction).map(|(site, d)| (*site + fraction * *d).as_vec3().extend(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One site with a cell of area 1 whose centroid is `off` away along x; returns the x of the next trial.
    fn next_x(descent: &mut Descent, off: f32, energy: f32) -> f32 {
        descent.next_trial(&[Vec4::new(off, 0.0, 0.0, 1.0)], &[energy])[0].x
    }

    #[test]
    fn steps_that_raise_the_energy_get_shorter_and_then_lloyds() {
        let mut descent = Descent::new(vec![Vec4::ZERO], 1.0, 7);
        assert_eq!(next_x(&mut descent, 0.3, 1.0), 0.3, "first Lloyd's");
        assert!((descent.distance_to_centroids() - 0.3).abs() < 1e-6);
        // The gradient falls by a third, so its zero is twice as far again; no step is longer than half a
        // spacing.
        assert!((next_x(&mut descent, 0.2, 0.9) - 0.8).abs() < 1e-6);
        let shorter = next_x(&mut descent, -0.3, 2.0);
        assert!((0.349..0.551).contains(&shorter), "{shorter}");
        let shortest = next_x(&mut descent, -0.3, 1.5);
        assert!(shortest < shorter && shortest > 0.3, "{shortest} after {shorter}");
        assert!((next_x(&mut descent, -0.3, 1.5) - 0.5).abs() < 1e-6, "Lloyd's from the best");
        assert!(
            (descent.distance_to_centroids() - 0.2).abs() < 1e-6
                && (descent.final_sites()[0].x - 0.5).abs() < 1e-6
        );
        // Lloyd's step is accepted at any energy, and the result is the centroid of the best.
        next_x(&mut descent, 0.1, 0.95);
        assert!((descent.final_sites()[0].x - 0.6).abs() < 1e-6);
    }

    #[test]
    fn sites_without_a_cell_stay() {
        let mut descent = Descent::new(vec![Vec4::X], 1.0, 7);
        assert_eq!(descent.next_trial(&[Vec4::ZERO], &[0.0]), [Vec4::X]);
        assert_eq!((descent.final_sites(), descent.distance_to_centroids()), (vec![Vec4::X], 0.0));
    }
}
