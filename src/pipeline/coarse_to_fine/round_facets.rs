//! Another attempt that takes creases between narrow facets for those of a round surface.
//!
//! A cylinder with eight sides is a prism to some and a coarse tube to others. Where its facets are wider
//! than an edge, good triangles follow the creases, and they stay. Where they are narrower, triangles between
//! the creases are narrow, too, and the reading that gives good triangles is preferred, with a warning.

use super::attempts::Runner;
use crate::Result;
use crate::mesh::quality::quality;
use crate::pipeline::outcome::Outcome;
use crate::{Error, TriMesh};

/// Another attempt is made if more than this fraction of the triangles has an angle below 30 degrees.
const MANY: f64 = 0.05;
/// The other attempt is better if it has at most this many times the first one's fraction of triangles with
/// an angle below 30 degrees.
const BETTER: f64 = 0.5;

impl Runner<'_, '_> {
    /// The outcome, or one without creases between narrow facets if its triangles are much better.
    pub(super) fn with_round_facets(&mut self, first: Outcome, vertices: usize) -> Result<Outcome> {
        let narrow = share_of_narrow(&first.mesh);
        if narrow <= MANY || self.progress.leave_out() {
            return Ok(first);
        }
        let model = self.model_of_round_facets(vertices)?;
        if model.features.discarded.facet_edges == 0 {
            return Ok(first);
        }
        let round = match self.attempt(&model, vertices, self.shared.context.options.seed) {
            // There are too many other curves.
            Err(Error::Usage { .. }) => return Ok(first),
            round => round?,
        };
        let kind = |outcome: &Outcome| outcome.fault.as_ref().map(|fault| fault.kind);
        let is_better = kind(&round) <= kind(&first) && share_of_narrow(&round.mesh) <= BETTER * narrow;
        Ok(Outcome { attempts: self.attempts, ..if is_better { round } else { first } })
    }
}

/// The share of triangles with an angle below 30 degrees.
fn share_of_narrow(mesh: &TriMesh) -> f64 {
    quality(mesh).map_or(0.0, |quality| quality.fraction_below_30)
}
