//! Another attempt at a CAD part with edges of equal length where shorter ones at its bends do not help.
//!
//! Mostly shorter edges at fillets halve the distance to the surface. Where a fillet is much narrower than
//! even these, as at the rim of a thin wall, one vertex on its ridge is closer than two beside it; and where
//! features are close to each other, changes of the length make narrow triangles.

use super::attempts::Runner;
use super::coarser_features::is_small;
use super::score::Score;
use super::surface_model::ModelRequest;
use crate::mesh::spacing;
use crate::options::Sizing;
use crate::pipeline::fallback::closer::MELTED;
use crate::pipeline::outcome::Outcome;
use crate::{Error, Result};

/// Another attempt is made if the smallest angle is below this many degrees, or if the mesh has melted.
const SMALL: f64 = 25.0;
/// The other attempt is closer with at most this many times the distance.
const CLOSER: f64 = 0.8;
/// Its smallest angle then is at least this fraction of the first one's, or [`SMALL`].
const NARROWER: f64 = 0.7;
/// Its angles are better if the smallest one is larger by this many degrees.
const WIDER: f64 = 4.0;
/// Its distance then is at most this many times the first one's.
const FARTHER: f64 = 1.25;
/// The fraction of its triangles with an angle below 30 degrees may be larger by this.
const MORE_NARROW: f64 = 0.005;

impl Runner<'_, '_> {
    /// The outcome; or, if it has melted or has a small angle, a better one whose edges are not shorter at
    /// bends.
    pub(super) fn with_even_lengths(&mut self, first: Outcome, vertices: usize) -> Result<Outcome> {
        let plan = self.shared.context.plan;
        let has_shorter = plan.bends.is_some() && plan.sizing == Sizing::Automatic;
        if !has_shorter || !is_small(&first, vertices) || self.progress.leave_out() {
            return Ok(first);
        }
        let score = self.score_of(&first)?;
        let edge = spacing(self.shared.context.surface.area(), vertices);
        if score.smallest >= SMALL && score.rms <= MELTED * edge {
            return Ok(first);
        }
        let request = ModelRequest { vertices, sizing: &Sizing::Uniform, ..ModelRequest::of(plan) };
        let seed = self.shared.context.options.seed;
        let even = match self.model(&request).and_then(|model| self.attempt(&model, vertices, seed)) {
            // There are too few vertices for the curves.
            Err(Error::Usage { .. }) => return Ok(first),
            even => even?,
        };
        let is_better = self.score_of(&even)?.is_better_when_even(&score);
        Ok(Outcome { attempts: self.attempts, ..if is_better { even } else { first } })
    }
}

impl Score {
    fn is_better_when_even(&self, first: &Self) -> bool {
        let is_closer =
            self.rms <= CLOSER * first.rms && self.smallest >= SMALL.min(NARROWER * first.smallest);
        let has_wider = self.smallest >= first.smallest.min(SMALL) + WIDER && self.rms <= FARTHER * first.rms;
        self.fault <= first.fault
            && self.narrow <= first.narrow + MORE_NARROW
            && (is_closer || (first.smallest < SMALL && has_wider))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::outcome::FaultKind;

    #[test]
    fn even_edges_are_better_if_much_closer_or_if_the_smallest_angle_is_larger() {
        let melted = Score { fault: None, rms: 1.0, smallest: 30.0, narrow: 0.0, quality: 0.9 };
        let narrow = Score { smallest: 16.0, narrow: 0.01, ..melted };
        for (first, second, is_better) in [
            (melted, Score { rms: 0.8, ..melted }, true),
            (melted, Score { rms: 0.81, ..melted }, false),
            (melted, Score { rms: 0.8, smallest: 20.0, ..melted }, false),
            (melted, Score { smallest: 40.0, ..melted }, false),
            (narrow, Score { smallest: 20.0, rms: 1.25, ..narrow }, true),
            (narrow, Score { smallest: 20.0, rms: 1.26, ..narrow }, false),
            (narrow, Score { smallest: 19.0, ..narrow }, false),
            (narrow, Score { smallest: 30.0, narrow: 0.02, ..narrow }, false),
            (narrow, Score { fault: Some(FaultKind::Missing), smallest: 30.0, rms: 0.5, ..narrow }, false),
        ] {
            assert_eq!(second.is_better_when_even(&first), is_better, "{first:?} {second:?}");
        }
    }
}
