//! Curves that the user asks for: fixed half-edges and lines from a file.

use crate::mesh::features::user_edges;
use crate::mesh::half_edges::next;
use crate::options::{Options, Shortage};
use crate::{Error, Result, TriMesh};

/// Whether the options ask for curves of the user.
pub(crate) fn has_user_curves(options: &Options) -> bool {
    let method = &options.coarse_to_fine;
    let half_edges = [&method.fixed_half_edges, &method.label_borders];
    method.features.is_some() || half_edges.iter().any(|list| !list.is_empty())
}

/// Whether a surface may be simplified without its curves if there are too few vertices: not with curves of
/// the user.
pub(crate) fn may_simplify(options: &Options) -> bool {
    !has_user_curves(options) && options.shortage != Shortage::AddVertices
}

/// An error of too few vertices for curves, with borders of labels among them if the options have some.
pub(crate) fn name_borders(error: Error, options: &Options) -> Error {
    match error {
        Error::Usage { problem, remedy, field } if !options.coarse_to_fine.label_borders.is_empty() => {
            let problem = problem
                .replace("sharp edges and boundaries", "borders of labels, sharp edges and boundaries");
            let remedy = remedy.replace("raise `feature_angle`", "keep the borders of fewer labels");
            Error::Usage { problem, remedy, field }
        }
        error => error,
    }
}

/// Whether a run may be tried again [`without_fixed`] half-edges.
pub(crate) fn may_give_up_fixed(options: &Options) -> bool {
    let method = &options.coarse_to_fine;
    method.may_give_up_fixed && !method.fixed_half_edges.is_empty()
}

/// The options without fixed half-edges.
pub(crate) fn without_fixed(options: &Options) -> Options {
    options.clone().fixed_half_edges(Vec::new())
}

/// The edges of `mesh`, which is repaired, on the user's curves.
///
/// # Errors
/// As [`user_edges`].
pub(crate) fn user_curve_edges(mesh: &TriMesh, options: &Options) -> Result<Vec<[u32; 2]>> {
    let corners = mesh.triangles.as_flattened();
    let ends = |half: u32| [half, next(half)].map(|corner| corners[corner as usize]);
    let method = &options.coarse_to_fine;
    let fixed = method.fixed_half_edges.iter().chain(&method.label_borders).map(|half| ends(*half));
    let Some(features) = &options.coarse_to_fine.features else { return Ok(fixed.collect()) };
    let drawn = user_edges(mesh, &features.lines).map_err(|error| match &features.file {
        Some(file) => error.in_file(file),
        None => error,
    })?;
    Ok(fixed.chain(drawn).collect())
}
