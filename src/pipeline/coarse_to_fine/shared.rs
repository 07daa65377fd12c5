//! What all levels of an attempt share.

use super::surface_model::SurfaceModel;
use crate::pipeline::run_context::RunContext;

/// An attempt of the default pipeline.
pub(crate) struct CoarseToFine<'a> {
    pub context: RunContext<'a>,
    /// The number of vertices, which may be more than planned.
    pub vertices: usize,
    pub seed: u64,
    pub model: &'a SurfaceModel,
}
