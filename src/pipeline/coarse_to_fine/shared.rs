//! What all levels of an attempt share.

use super::surface_model::SurfaceModel;
use crate::pipeline::run_context::RunContext;

/// An attempt of the default pipeline.
pub(crate) struct CoarseToFine<'a> {
    /// With the attempt's vertices and seed.
    pub context: RunContext<'a>,
    pub model: &'a SurfaceModel,
}
