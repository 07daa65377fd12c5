//! Attempts with fewer features: those of longer edges.
//!
//! Where sharp edges are closer to each other than the edges of the mesh, either they leave too few vertices
//! for the rest, or the triangles between them are narrow. With the features of longer edges, the less sharp
//! ones give way, and sites on the ridges that they were hold the shape as well as they can (`ridges.rs`).

use super::attempts::Runner;
use crate::Result;
use crate::mesh::distance::distances_sampled;
use crate::mesh::quality::quality;
use crate::pipeline::outcome::{FaultKind, Outcome};
use crate::{Error, ProgressToken, TriMesh};

/// Where curves leave too few vertices for the rest, features of edges this many times as long are tried, one
/// after the other.
const FOR_ROOM: [f64; 3] = [1.5, 2.0, 3.0];
/// So are these, where triangles are bad.
const FOR_SHAPE: [f64; 2] = [2.0, 3.0];
/// Meshes with more vertices are not made again for the shape of a few triangles, since that takes too long.
const MOST_VERTICES: usize = 2_500;
/// Triangles are bad if one of them has an angle below this many degrees.
const SMALL: f64 = 15.0;
/// They are bad, too, if more than this fraction of them has an angle below 30 degrees.
const MANY: f64 = 0.02;
/// A better mesh has at most this fraction of the other's triangles with an angle below 30 degrees.
const FEWER: f64 = 0.5;
/// The root mean square distance of a better mesh from the surface is at most this many times that of the
/// first.
const FARTHER: f64 = 1.25;
/// If a larger fraction of the triangles has an angle below 30 degrees, features are too close to each other
/// nearly everywhere for fewer of them to help.
const NEARLY_ALL: f64 = 0.12;
/// Even fewer features are not tried if these left more than this fraction of the bad triangles.
const HARDLY_FEWER: f64 = 0.8;
/// Sample points of distances for each vertex.
const SAMPLES: usize = 8;

impl Runner<'_, '_> {
    /// The first attempt with fewer curves that leave enough vertices for the rest. Later attempts have no
    /// more curves. `None` if there is none.
    pub(super) fn with_fewer_curves(&mut self, vertices: usize, seed: u64) -> Result<Option<Outcome>> {
        for coarseness in FOR_ROOM {
            if self.progress.leave_out() {
                break;
            }
            self.coarseness = coarseness;
            let attempted = self.model_for(vertices).and_then(|model| self.attempt(&model, vertices, seed));
            match attempted {
                Err(Error::Usage { .. }) => {}
                attempted => return attempted.map(Some),
            }
        }
        self.coarseness = 1.0;
        Ok(None)
    }

    /// The outcome; or, if its triangles are bad, a better one with fewer features.
    pub(super) fn with_coarser_features(&mut self, first: Outcome, vertices: usize) -> Result<Outcome> {
        let plan = self.shared.context.plan;
        let is_free = !plan.has_kept() && plan.pinned.vertices.is_empty();
        let mut sharp_length = first.features.map_or(0.0, |features| features.sharp_length);
        let is_small = first.vertices == vertices && vertices <= MOST_VERTICES;
        if !is_free || !is_small || sharp_length == 0.0 || !has_bad_triangles(&first) {
            return Ok(first);
        }
        let seed = self.shared.context.options.seed;
        let mut best = (self.standing_of(&first)?, first);
        let farthest = FARTHER * best.0.rms;
        if best.0.narrow > NEARLY_ALL {
            return Ok(best.1);
        }
        for coarseness in FOR_SHAPE {
            if coarseness <= self.coarseness {
                continue;
            }
            if self.progress.leave_out() {
                break;
            }
            self.coarseness = coarseness;
            let model = self.model_for(vertices)?;
            if model.features.sharp_length >= sharp_length {
                continue;
            }
            sharp_length = model.features.sharp_length;
            let outcome = match self.attempt(&model, vertices, seed) {
                Err(Error::Usage { .. }) => continue,
                outcome => outcome?,
            };
            drop(model);
            // With even fewer features, it would only be farther away.
            if self.standing_of(&outcome)?.rms > farthest {
                break;
            }
            let outcome = self.with_shorter_edges(outcome, vertices)?;
            let standing = self.standing_of(&outcome)?;
            let hardly_helps = standing.narrow > HARDLY_FEWER * best.0.narrow;
            if standing.rms <= farthest && standing.is_better_than(&best.0) {
                best = (standing, outcome);
            }
            if hardly_helps || !has_bad_triangles(&best.1) {
                break;
            }
        }
        Ok(Outcome { attempts: self.attempts, ..best.1 })
    }

    fn standing_of(&mut self, outcome: &Outcome) -> Result<Standing> {
        let surface = self.shared.context.surface.mesh();
        self.progress.during(|progress| Standing::of(outcome, &surface, progress))
    }
}

/// Whether a mesh has narrow triangles, or a fault for which it may be refused.
fn has_bad_triangles(outcome: &Outcome) -> bool {
    let is_bad = quality(&outcome.mesh)
        .is_some_and(|quality| quality.min_angle < SMALL || quality.fraction_below_30 > MANY);
    is_bad || outcome.is_refused()
}

/// What attempts are compared by.
#[derive(Debug, Clone, Copy)]
struct Standing {
    fault: Option<FaultKind>,
    /// The root mean square distance between mesh and surface, the larger of both directions.
    rms: f64,
    /// The smallest angle in degrees.
    smallest: f64,
    /// The fraction of triangles with an angle below 30 degrees.
    narrow: f64,
}

impl Standing {
    fn of(outcome: &Outcome, surface: &TriMesh, progress: &ProgressToken) -> Result<Self> {
        let samples = SAMPLES * outcome.mesh.vertices.len();
        let quality = quality(&outcome.mesh);
        Ok(Self {
            fault: outcome.fault.as_ref().map(|fault| fault.kind),
            rms: distances_sampled(&outcome.mesh, surface, samples, progress)?.rms,
            smallest: quality.as_ref().map_or(0.0, |quality| quality.min_angle),
            narrow: quality.map_or(1.0, |quality| quality.fraction_below_30),
        })
    }

    /// Whether its triangles are much better.
    fn is_better_than(&self, other: &Self) -> bool {
        self.fault <= other.fault
            && self.smallest >= other.smallest.min(SMALL)
            && self.narrow <= FEWER * other.narrow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_better_if_at_most_half_as_many_are_narrow_and_none_is_narrower() {
        let first = Standing { fault: None, rms: 1.0, smallest: 8.0, narrow: 0.04 };
        for (second, is_better) in [
            (Standing { smallest: 20.0, narrow: 0.02, ..first }, true),
            (Standing { smallest: 7.0, narrow: 0.01, ..first }, false),
            (Standing { smallest: 20.0, narrow: 0.03, ..first }, false),
            (Standing { fault: Some(FaultKind::Missing), smallest: 20.0, narrow: 0.0, ..first }, false),
        ] {
            assert_eq!(second.is_better_than(&first), is_better, "{second:?}");
        }
    }
}
