//! Curves that the user asks for: fixed half-edges, borders of labels and lines from a file.

use crate::mesh::correspondence::half_edges_after;
use crate::mesh::features::user_edges;
use crate::mesh::half_edges::{EdgeSet, edge_key, next};
use crate::mesh::repair::{BorderSmoothing, Repaired, smooth_borders};
use crate::options::{FeatureLines, Options, Shortage};
use crate::{Error, Result, TriMesh};

/// The user's curves on a repaired mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct UserCurves {
    fixed_half_edges: Vec<u32>,
    label_borders: Vec<u32>,
    lines: Option<FeatureLines>,
}

impl UserCurves {
    /// The curves that the options name on `mesh`, as those of the mesh that was `repaired` from it, in which
    /// ragged borders of labels become smooth; with `gives_up_fixed`, no fixed half-edges.
    pub fn new(mesh: &TriMesh, repaired: &mut Repaired, options: &Options, gives_up_fixed: bool) -> Self {
        let method = &options.coarse_to_fine;
        let fixed: &[u32] = if gives_up_fixed { &[] } else { &method.fixed_half_edges };
        let fixed_half_edges = half_edges_after(mesh, repaired, fixed);
        let mut label_borders = half_edges_after(mesh, repaired, &method.label_borders);
        if !label_borders.is_empty() && method.smooth_labels > 0.0 {
            let by = BorderSmoothing {
                edges: method.smooth_labels,
                feature_angle: method.feature_angle,
                fixed: &fixed_half_edges,
            };
            label_borders = smooth_borders(&mut repaired.mesh, &mut repaired.origin, &label_borders, &by);
        }
        Self { fixed_half_edges, label_borders, lines: method.features.clone() }
    }

    /// With these lines instead of the options'.
    #[must_use]
    pub fn with_lines(self, lines: Option<FeatureLines>) -> Self {
        Self { lines, ..self }
    }

    /// Their half-edges on `mesh`, which is the repaired one, to be changed together with it; lines are among
    /// the fixed ones from now on.
    ///
    /// # Errors
    /// As [`user_edges`].
    pub fn half_edges(&mut self, mesh: &TriMesh) -> Result<[&mut Vec<u32>; 2]> {
        if let Some(lines) = self.lines.take() {
            let wanted: EdgeSet = drawn(mesh, &lines)?.iter().map(|[a, b]| edge_key(*a, *b)).collect();
            let corners = mesh.triangles.as_flattened();
            let key = |half: u32| edge_key(corners[half as usize], corners[next(half) as usize]);
            self.fixed_half_edges
                .extend((0..corners.len() as u32).filter(|half| wanted.contains(&key(*half))));
        }
        Ok([&mut self.fixed_half_edges, &mut self.label_borders])
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.lines.is_none() && self.fixed_half_edges.is_empty() && self.label_borders.is_empty()
    }

    /// Their edges on `mesh`, which is the repaired one.
    ///
    /// # Errors
    /// As [`user_edges`].
    pub fn edges(&self, mesh: &TriMesh) -> Result<Vec<[u32; 2]>> {
        let corners = mesh.triangles.as_flattened();
        let ends = |half: u32| [half, next(half)].map(|corner| corners[corner as usize]);
        let fixed = self.fixed_half_edges.iter().chain(&self.label_borders).map(|half| ends(*half));
        let Some(features) = &self.lines else { return Ok(fixed.collect()) };
        Ok(fixed.chain(drawn(mesh, features)?).collect())
    }

    /// Whether a surface may be simplified without its curves if there are too few vertices: not with curves
    /// of the user.
    pub fn may_be_lost(&self, options: &Options) -> bool {
        self.is_empty() && options.shortage != Shortage::AddVertices
    }

    /// An error of too few vertices for curves, with borders of labels among them if there are some.
    pub fn name_borders(&self, error: Error) -> Error {
        match error {
            Error::Usage { problem, remedy, field } if !self.label_borders.is_empty() => {
                let problem = problem
                    .replace("sharp edges and boundaries", "borders of labels, sharp edges and boundaries");
                let remedy = remedy.replace("raise `feature_angle`", "keep the borders of fewer labels");
                Error::Usage { problem, remedy, field }
            }
            error => error,
        }
    }
}

/// The edges along a user's lines.
pub(super) fn drawn(mesh: &TriMesh, features: &FeatureLines) -> Result<Vec<[u32; 2]>> {
    user_edges(mesh, &features.lines).map_err(|error| match &features.file {
        Some(file) => error.in_file(file),
        None => error,
    })
}

/// Whether a run may be tried again without fixed half-edges.
pub(crate) fn may_give_up_fixed(options: &Options) -> bool {
    let method = &options.coarse_to_fine;
    method.may_give_up_fixed && !method.fixed_half_edges.is_empty()
}
