//! Another attempt if the edges in the user's regions are not as long as they are to be.
//!
//! Where lengths change by much from site to site, sites come to be a little denser in regions of short edges
//! than their lengths say. The next attempt asks for lengths that make up for it.

use super::attempts::Runner;
use super::surface_model::ModelRequest;
use crate::mesh::spacing;
use crate::pipeline::outcome::Outcome;
use crate::{Error, Result, TriMesh};

/// Mean edge lengths in a region may differ from those asked for by this fraction.
const TOLERANCE: f64 = 0.04;
/// Maximum number of further attempts.
const ATTEMPTS: u32 = 2;

impl Runner<'_, '_> {
    /// The outcome, or one in which edges in the regions are more nearly as long as asked for.
    pub(super) fn with_refined_lengths(&mut self, first: Outcome, vertices: usize) -> Result<Outcome> {
        let context = &self.shared.context;
        let (refined, frame) = (&context.plan.refined, context.frame);
        if refined.is_empty() {
            return Ok(first);
        }
        let longest = frame.scale * spacing(context.surface.area(), vertices);
        let growth = context.options.coarse_to_fine.growth;
        let achieved = |mesh: &TriMesh| {
            let vertices = mesh.vertices.iter().map(|p| frame.to_input_units(*p)).collect();
            refined.achieved(&TriMesh { vertices, triangles: mesh.triangles.clone() }, growth, longest)
        };
        let mut ratios = achieved(&first.mesh);
        let (mut best, mut factors) = (first, vec![1.0; ratios.len()]);
        for _ in 0..ATTEMPTS {
            if best.fault.is_some() || worst(&ratios) <= TOLERANCE || self.progress.leave_out() {
                break;
            }
            factors.iter_mut().zip(&ratios).for_each(|(factor, ratio)| *factor /= ratio);
            let request = ModelRequest { vertices, ..ModelRequest::of(context.plan) };
            let model = match self.model(&ModelRequest { refined: &refined.scaled(&factors), ..request }) {
                // The rest would be left too few vertices, or too many.
                Err(Error::Usage { .. }) => break,
                model => model?,
            };
            let next = self.attempt(&model, vertices, context.options.seed)?;
            let now = achieved(&next.mesh);
            if next.fault.is_some() || worst(&now) >= worst(&ratios) {
                break;
            }
            (best, ratios) = (next, now);
        }
        Ok(Outcome { attempts: self.attempts, ..best })
    }
}

/// The largest difference from 1.
fn worst(ratios: &[f64]) -> f64 {
    ratios.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max)
}
