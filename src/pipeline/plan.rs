//! What a run makes of the options for its input. The options are the user's request and never change.

use super::RunInput;
use super::bends::{Bends, divide_planes, find_bends};
use super::kept::Kept;
use super::pinned::{Pinned, WholeEdges};
use super::refined::{Refined, parts_of};
use super::user_curves::UserCurves;
use crate::mesh::correspondence::vertex_values_after;
use crate::mesh::repair::Repaired;
use crate::mesh::topology::topology;
use crate::options::{Length, Method, Sizing};
use crate::{ProgressToken, Result, TriMesh};

/// Where lengths hold in parts of the surface, the coarsest level has at least one of this many vertices.
const COARSEN: usize = 5;

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
    /// If edges are to be shorter at the bends of a CAD part.
    pub bends: Option<Bends>,
    /// The user's curves on the repaired mesh.
    pub curves: UserCurves,
    /// Vertices that stay where they are.
    pub pinned: Pinned,
    /// Lengths that hold in parts of it, at its vertices as `sizing`.
    pub refined: Refined,
}

impl Plan {
    /// The edges that are curves whatever their angle, on `mesh`, which is the repaired one: the user's, and
    /// those that stay whole.
    ///
    /// # Errors
    /// As [`UserCurves::edges`].
    pub fn edges(&self, mesh: &TriMesh) -> Result<Vec<[u32; 2]>> {
        let mut edges = self.curves.edges(mesh)?;
        edges.extend(self.pinned.whole.iter().map(|(a, b)| [*a, *b]));
        Ok(edges)
    }

    /// Whether the user wants edges or vertices that local operations in single components do not know of.
    pub fn has_kept(&self) -> bool {
        !self.curves.is_empty() || !self.pinned.is_empty()
    }

    /// For all components of the mesh that `repaired` was made from, or for what of it is not `kept`. Ragged
    /// borders of labels become smooth in it, and parts to be refined are divided.
    ///
    /// # Errors
    /// Those of [`Kept::rest_of`], [`Pinned::new`], [`Refined::new`], and of the user's lines.
    pub fn new(
        input: &RunInput,
        repaired: &mut Repaired,
        kept: Option<&Kept>,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let vertices =
            kept.map_or(Ok(input.vertices), |kept| kept.rest_of(input.vertices, input.options.shortage))?;
        let plan = Self::of_rest(input, (repaired, vertices), kept, progress);
        plan.map_err(|error| kept.map_or(error.clone(), |kept| kept.of_rest(error)))
    }

    fn of_rest(
        input: &RunInput,
        (repaired, vertices): (&mut Repaired, usize),
        kept: Option<&Kept>,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let RunInput { mesh, options, lengths, .. } = *input;
        let method = &options.coarse_to_fine;
        let mut curves = UserCurves::new(mesh, repaired, options, input.gives_up_fixed);
        if let Some(kept) = kept {
            curves = curves.with_lines(kept.lines.clone());
        }
        let wanted = (options, vertices);
        let may_divide = !method.points.is_empty() || method.keep_boundary || kept.is_some();
        let before = may_divide.then(|| repaired.mesh.clone());
        let (pinned, divided) = Pinned::new(repaired, wanted, kept, progress)?;
        let before = before.filter(|_| !divided.1.is_empty());
        if let Some(before) = &before {
            for half_edges in curves.half_edges(before)? {
                *half_edges = parts_of(half_edges, before, &repaired.mesh, &divided);
            }
        }
        let mut refined = Refined::default();
        if !method.refine.is_empty() {
            let half_edges = curves.half_edges(&repaired.mesh)?;
            let whole = WholeEdges::new(&repaired.mesh, &pinned.whole);
            let wanted = (options, Some(vertices));
            refined = Refined::new(repaired, wanted, (half_edges, &whole), progress)?;
        }
        refined.undivided = before.as_ref().map(topology).or(refined.undivided);
        if !refined.is_empty() && !pinned.whole.is_empty() {
            let wanted = refined.wanted(&repaired.mesh, method.growth, vertices)?;
            refined.least = pinned.least_lengths(&repaired.mesh, &wanted)?;
        }
        refined.keep_shorter(&pinned.boundary_lengths, repaired.mesh.vertices.len());
        pinned.refuse_coarse(&repaired.mesh, &refined.lengths, vertices)?;
        let may_be_shorter = options.method == Method::CoarseToFine
            && method.sizing == Sizing::Automatic
            && !method.local
            && lengths.is_none()
            && refined.is_empty();
        let bends = if may_be_shorter { find_bends(&repaired.mesh, vertices, progress)? } else { None };
        if bends.is_some() {
            let half_edges = curves.half_edges(&repaired.mesh)?;
            let whole = WholeEdges::new(&repaired.mesh, &pinned.whole);
            let divided = divide_planes(repaired, vertices, (half_edges, &whole), progress)?;
            refined.undivided = refined.undivided.or(divided);
        }
        let sizing = match (lengths, &method.sizing) {
            (Some(lengths), _) => Sizing::Given(lengths.values.to_vec()),
            // Further attempts would have lengths of their own.
            (None, Sizing::Automatic) if !refined.is_empty() => Sizing::Uniform,
            (None, Sizing::Given(values)) => Sizing::Given(vertex_values_after(mesh, repaired, values)),
            (None, sizing) => sizing.clone(),
        };
        Ok(Self {
            vertices,
            // On much coarser levels, lengths would change by too much from site to site.
            coarsest: if refined.is_empty() {
                method.coarsest
            } else {
                method.coarsest.max(vertices / COARSEN)
            },
            sizing,
            min_edge: method.min_edge.or(lengths.map(|lengths| lengths.shortest)),
            bends,
            curves,
            pinned,
            refined,
        })
    }
}
