//! Another mesh by local operations that keep it close to the surface, where one of even edges has melted.

use super::attempts::Runner;
use super::coarser_features::is_small;
use super::score::Score;
use crate::mesh::spacing;
use crate::pipeline::fallback::closer::{CLOSER, MELTED, may_come_closer};
use crate::pipeline::fallback::faulty::Fallback;
use crate::pipeline::given_up::gives_up_many;
use crate::pipeline::outcome::Outcome;
use crate::pipeline::result::FeatureSummary;
use crate::{Error, Result};

/// The smallest angle of a closer mesh is at least this many degrees, or this fraction of the other's.
const SMALL: f64 = 15.0;
/// See [`SMALL`].
const SMALLER: f64 = 0.5;
/// A closer mesh has at most this many times the other's triangles with an angle below 30 degrees, and
/// [`FEW`] more.
const MORE: f64 = 2.0;
/// A fraction of all triangles.
const FEW: f64 = 0.01;
/// Its mean quality is lower by this at most.
const LESS_QUALITY: f64 = 0.05;

impl Runner<'_, '_> {
    /// If an outcome has given up sharp edges and melted, one that is much closer to the surface and hardly
    /// worse otherwise; `None` if there is none.
    pub(super) fn closer(
        &mut self,
        first: &Outcome,
        fallback: &Fallback,
        (features, vertices): (FeatureSummary, usize),
    ) -> Result<Option<Outcome>> {
        let context = &self.shared.context;
        let is_even = context.options.coarse_to_fine.feature_angle < 180.0
            && context.deviation.is_none()
            && fallback.sizes.is_uniform();
        // Local operations have tried to come closer themselves.
        let may_be = is_small(first, vertices)
            && first.simplified_components == 0
            && gives_up_many(&features)
            && may_come_closer(&context.surface.mesh(), vertices)
            && context.may_simplify()
            && is_even;
        if !may_be || self.progress.leave_out() {
            return Ok(None);
        }
        let edge = spacing(context.surface.area(), vertices);
        let before = self.score_of(first)?;
        if before.rms <= MELTED * edge {
            return Ok(None);
        }
        let whole = self.progress.during(|progress| fallback.whole_closely(features, vertices, progress));
        let closer = match whole {
            Err(Error::Usage { .. }) => return Ok(None),
            closer => closer?,
        };
        let is_better = self.score_of(&closer)?.is_much_closer_than(&before);
        Ok(is_better.then_some(Outcome { attempts: self.attempts, ..closer }))
    }
}

impl Score {
    fn is_much_closer_than(&self, other: &Self) -> bool {
        self.fault <= other.fault
            && self.rms <= CLOSER * other.rms
            && self.smallest >= SMALL.min(SMALLER * other.smallest)
            && self.narrow <= MORE * other.narrow + FEW
            && self.quality >= other.quality - LESS_QUALITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::outcome::FaultKind;

    #[test]
    fn a_closer_mesh_may_be_somewhat_less_even() {
        let first = Score { fault: None, rms: 1.0, smallest: 20.0, narrow: 0.02, quality: 0.85 };
        let closer = Score { rms: 0.5, smallest: 11.0, narrow: 0.045, quality: 0.81, ..first };
        for (second, is_better) in [
            (closer, true),
            (Score { rms: 0.65, ..closer }, false),
            (Score { smallest: 9.0, ..closer }, false),
            (Score { narrow: 0.055, ..closer }, false),
            (Score { quality: 0.79, ..closer }, false),
            (Score { fault: Some(FaultKind::Missing), ..closer }, false),
        ] {
            assert_eq!(second.is_much_closer_than(&first), is_better, "{second:?}");
        }
    }
}
