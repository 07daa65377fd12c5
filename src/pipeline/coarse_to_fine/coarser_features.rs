//! Attempts with fewer features: those of longer edges.
//!
//! Where sharp edges are closer to each other than the edges of the mesh, triangles between them are narrow.
//! With the features of longer edges, the less sharp ones give way, and sites on the ridges that they were
//! hold the shape (`ridges.rs`). Where they cannot, narrow triangles are better than a shape that melts.

use super::attempts::Runner;
use super::score::Score;
use crate::mesh::quality::quality;
use crate::pipeline::outcome::Outcome;
use crate::{Error, Result};

/// Features of edges this many times as long are tried, one after the other.
const COARSER: [f64; 2] = [2.0, 3.0];
/// Meshes with more vertices are not made again for the shape of a few triangles, since that takes too long.
const MOST_VERTICES: usize = 2_500;
/// Triangles are bad if one of them has an angle below this many degrees.
const SMALL: f64 = 15.0;
/// They are bad, too, if more than this fraction of them has an angle below 30 degrees.
const MANY: f64 = 0.02;
/// So they are if their mean quality is lower, as that of local operations may be.
const POOR: f64 = 0.8;
/// A better mesh has at most this fraction of the other's triangles with an angle below 30 degrees.
const FEWER: f64 = 0.5;
/// Or its mean quality is higher by this, and it is no farther from the surface.
const MORE_QUALITY: f64 = 0.05;
/// The root mean square distance of a better mesh from the surface is at most this many times that of the
/// first.
const FARTHER: f64 = 1.25;
/// If a larger fraction of the triangles has an angle below 30 degrees, features are too close to each other
/// nearly everywhere for fewer of them to help.
const NEARLY_ALL: f64 = 0.12;
/// Even fewer features are not tried if these left more than this fraction of the bad triangles.
const HARDLY_FEWER: f64 = 0.8;

impl Runner<'_, '_> {
    /// The outcome; or, if its triangles are bad, a better one with fewer features.
    pub(super) fn with_coarser_features(&mut self, first: Outcome, vertices: usize) -> Result<Outcome> {
        let sharp_length = first.features.map_or(0.0, |features| features.sharp_length);
        if sharp_length == 0.0 || !self.may_be_coarser(&first, vertices) || !has_bad_triangles(&first) {
            return Ok(first);
        }
        let mut best = (self.score_of(&first)?, first);
        let farthest = FARTHER * best.0.rms;
        let mut sharp_length = sharp_length;
        for coarseness in COARSER {
            if self.progress.leave_out() {
                break;
            }
            self.coarseness = coarseness;
            let model = self.model_for(vertices)?;
            if model.features.sharp_length >= sharp_length {
                continue;
            }
            sharp_length = model.features.sharp_length;
            let outcome = match self.attempt(&model, vertices, self.shared.context.options.seed) {
                Err(Error::Usage { .. }) => continue,
                outcome => outcome?,
            };
            drop(model);
            let score = self.score_of(&outcome)?;
            // With even fewer features, it would only be farther away, or hardly better.
            let is_last = score.rms > farthest || score.narrow > HARDLY_FEWER * best.0.narrow;
            if score.rms <= farthest && score.has_better_triangles_than(&best.0) {
                best = (score, self.with_shorter_edges(outcome, vertices)?);
            }
            if is_last || !has_bad_triangles(&best.1) {
                break;
            }
        }
        Ok(Outcome { attempts: self.attempts, ..best.1 })
    }

    /// Whether the mesh is small, features are free to go, and not nearly all of its triangles are narrow.
    fn may_be_coarser(&self, first: &Outcome, vertices: usize) -> bool {
        let plan = self.shared.context.plan;
        let is_free = !plan.has_kept() && plan.pinned.vertices.is_empty();
        is_free
            && is_small(first, vertices)
            && quality(&first.mesh).is_some_and(|q| q.fraction_below_30 <= NEARLY_ALL)
    }

    pub(super) fn score_of(&mut self, outcome: &Outcome) -> Result<Score> {
        let surface = self.shared.context.surface.mesh();
        let fault = outcome.fault.as_ref();
        self.progress.during(|progress| Score::of(&outcome.mesh, fault, &surface, progress))
    }
}

/// Whether a mesh has the number of vertices that were asked for, and so few that it may be made again for
/// its shape.
pub(super) fn is_small(first: &Outcome, vertices: usize) -> bool {
    first.vertices == vertices && vertices <= MOST_VERTICES
}

/// Whether a mesh has narrow triangles, or a fault for which it may be refused.
fn has_bad_triangles(outcome: &Outcome) -> bool {
    let is_bad = quality(&outcome.mesh).is_some_and(|quality| {
        quality.min_angle < SMALL || quality.fraction_below_30 > MANY || quality.mean_quality < POOR
    });
    is_bad || outcome.is_refused()
}

impl Score {
    fn has_better_triangles_than(&self, other: &Self) -> bool {
        self.fault <= other.fault
            && self.smallest >= other.smallest.min(SMALL)
            && (self.narrow <= FEWER * other.narrow
                || (self.narrow <= other.narrow
                    && self.quality >= other.quality + MORE_QUALITY
                    && self.rms <= other.rms))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::outcome::FaultKind;

    #[test]
    fn triangles_are_better_if_half_as_many_are_narrow_or_all_are_much_more_even() {
        let first = Score { fault: None, rms: 1.0, smallest: 8.0, narrow: 0.04, quality: 0.8 };
        for (second, is_better) in [
            (Score { smallest: 20.0, narrow: 0.02, ..first }, true),
            (Score { quality: 0.86, ..first }, true),
            (Score { quality: 0.84, ..first }, false),
            (Score { quality: 0.86, rms: 1.01, ..first }, false),
            (Score { smallest: 7.0, narrow: 0.01, ..first }, false),
            (Score { smallest: 20.0, narrow: 0.03, ..first }, false),
            (Score { fault: Some(FaultKind::Missing), smallest: 20.0, narrow: 0.0, ..first }, false),
        ] {
            assert_eq!(second.has_better_triangles_than(&first), is_better, "{second:?}");
        }
    }
}
