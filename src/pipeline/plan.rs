//! What a run makes of the options for its input. The options are the user's request and never change.

use super::RunInput;
use super::user_curves::UserCurves;
use crate::mesh::correspondence::vertex_values_after;
use crate::mesh::repair::Repaired;
use crate::options::{Length, Sizing};

/// What is derived from the options for the repaired mesh. It holds for all attempts of a run.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Vertices of the result, without those of components that are too small for cells.
    pub vertices: usize,
    /// Minimum number of sites of the coarsest level.
    pub coarsest: usize,
    /// Values are at the vertices of the repaired mesh without those components.
    pub sizing: Sizing,
    /// The shortest edge length.
    pub min_edge: Option<Length>,
    /// The user's curves on the repaired mesh.
    pub curves: UserCurves,
}

impl Plan {
    /// For all components of the mesh that `repaired` was made from. Ragged borders of labels become smooth
    /// in it.
    pub fn new(input: &RunInput, repaired: &mut Repaired) -> Self {
        let RunInput { mesh, options, vertices, lengths, .. } = *input;
        let method = &options.coarse_to_fine;
        let sizing = match (lengths, &method.sizing) {
            (Some(lengths), _) => Sizing::Given(lengths.values.to_vec()),
            (None, Sizing::Given(values)) => Sizing::Given(vertex_values_after(mesh, repaired, values)),
            (None, sizing) => sizing.clone(),
        };
        Self {
            vertices,
            coarsest: method.coarsest,
            sizing,
            min_edge: method.min_edge.or(lengths.map(|lengths| lengths.shortest)),
            curves: UserCurves::new(mesh, repaired, options, input.gives_up_fixed),
        }
    }
}
