//! The two-loop recursion of L-BFGS (Nocedal 1980): search directions from the gradient's change over the
//! last motions.

use glam::DVec3;
use std::collections::VecDeque;

/// A motion and the change of the gradient over it.
struct Motion {
    displacement: Vec<DVec3>,
    change: Vec<DVec3>,
    /// Their product, above 0.
    curvature: f64,
}

/// The last motions of as many points as there are.
pub(crate) struct Memory {
    most: usize,
    motions: VecDeque<Motion>,
}

impl Memory {
    /// Of at most `most` motions.
    pub fn new(most: usize) -> Self {
        Self { most, motions: VecDeque::with_capacity(most) }
    }

    /// Forgets all motions.
    pub fn forget(&mut self) {
        self.motions.clear();
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Remembers a motion, unless the gradient did not grow along it: then there is no minimum along it.
    pub fn remember(&mut self, displacement: Vec<DVec3>, change: Vec<DVec3>) {
        let curvature = dot(&displacement, &change);
        if curvature <= 0.0 || !curvature.is_finite() || self.most == 0 {
            return;
        }
        if self.motions.len() == self.most {
            self.motions.pop_front();
        }
        self.motions.push_back(Motion { displacement, change, curvature });
    }

    /// The displacement to where the gradient vanishes by the remembered motions. `inverse` is the diagonal
    /// of an estimate of the inverse Hessian, at least 0 for each point: without any motion the displacement
    /// is that times minus the gradient.
    pub fn direction(&self, gradient: &[DVec3], inverse: &[f64]) -> Vec<DVec3> {
        let mut rest: Vec<DVec3> = gradient.iter().map(|g| -*g).collect();
        let mut factors = Vec::with_capacity(self.motions.len());
        for motion in self.motions.iter().rev() {
            let factor = dot(&motion.displacement, &rest) / motion.curvature;
            add(&mut rest, -factor, &motion.change);
            factors.push(factor);
        }
        let scale = self.motions.back().map_or(1.0, |last| scale(last, inverse));
        rest.iter_mut().zip(inverse).for_each(|(r, inverse)| *r *= scale * inverse);
        for (motion, factor) in self.motions.iter().zip(factors.into_iter().rev()) {
            let excess = dot(&motion.change, &rest) / motion.curvature;
            add(&mut rest, factor - excess, &motion.displacement);
        }
        rest
    }
}

/// The factor by which the estimate is too small along the last motion.
fn scale(last: &Motion, inverse: &[f64]) -> f64 {
    let estimated: f64 =
        last.change.iter().zip(inverse).map(|(c, inverse)| inverse * c.length_squared()).sum();
    if estimated > 0.0 { last.curvature / estimated } else { 1.0 }
}

/// The dot product of two displacements, summed in order.
pub(crate) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn add(to: &mut [DVec3], factor: f64, what: &[DVec3]) {
    to.iter_mut().zip(what).for_each(|(to, what)| *to += factor * *what);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points in a row, each connected to the next by a spring, the end points to fixed places: the Hessian
    /// is not diagonal.
    fn gradient(at: &[DVec3]) -> Vec<DVec3> {
        let ends = [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)];
        let stiff = |i: usize| 1.0 + (i % 5) as f64;
        let near = |i: usize| {
            let before = if i == 0 { ends[0] } else { at[i - 1] };
            let after = *at.get(i + 1).unwrap_or(&ends[1]);
            stiff(i) * (at[i] - before) + stiff(i + 1) * (at[i] - after)
        };
        (0..at.len()).map(near).collect()
    }

    /// What is left of the gradient after `rounds` full steps from 0.
    fn left(count: usize, most: usize, rounds: usize) -> f64 {
        let mut memory = Memory::new(most);
        let mut at = vec![DVec3::ZERO; count];
        let inverse: Vec<f64> = (0..count).map(|i| 1.0 / (2.0 + (i % 5 + (i + 1) % 5) as f64)).collect();
        let mut g = gradient(&at);
        for _ in 0..rounds {
            let displacement = memory.direction(&g, &inverse);
            assert!(dot(&displacement, &g) < 0.0, "uphill");
            add(&mut at, 1.0, &displacement);
            let new = gradient(&at);
            let change = new.iter().zip(&g).map(|(new, old)| *new - *old).collect();
            memory.remember(displacement, change);
            g = new;
        }
        dot(&g, &g).sqrt()
    }

    #[test]
    fn the_first_direction_is_the_estimates() {
        let g = [DVec3::X, DVec3::new(0.0, 2.0, -4.0)];
        assert_eq!(Memory::new(7).direction(&g, &[0.5, 0.25]), [-0.5 * DVec3::X, DVec3::new(0.0, -0.5, 1.0)]);
    }

    #[test]
    fn what_the_gradient_does_not_grow_along_is_not_remembered() {
        let mut memory = Memory::new(7);
        memory.remember(vec![DVec3::X], vec![-DVec3::X]);
        memory.remember(vec![DVec3::X], vec![DVec3::Y]);
        memory.remember(vec![DVec3::X], vec![DVec3::NAN]);
        assert!(memory.is_empty());
        memory.remember(vec![DVec3::X], vec![DVec3::X]);
        assert!(!memory.is_empty());
        memory.forget();
        assert!(memory.is_empty());
    }

    #[test]
    fn a_quadratic_is_solved_sooner_than_by_steps_down() {
        let [plain, short, long] = [0, 3, 20].map(|most| left(20, most, 60));
        assert!(short < 1e-2 * plain && long < 1e-6 * plain, "{plain}, {short}, {long}");
    }
}
