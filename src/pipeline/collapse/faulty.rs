//! Faulty results of cells, repaired by simplifying components or the whole surface.

use super::components::{Components, RepairInput, Spread};
use super::simplify::SimplifyTarget;
use crate::mesh::simplify::Site;
use crate::mesh::spacing;
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Options, Sizing};
use crate::pipeline::intersections::{input_intersections, intersecting_in_units};
use crate::pipeline::outcome::Outcome;
use crate::pipeline::result::FeatureSummary;
use crate::pipeline::user_curves::has_user_curves;
use crate::sites::connect::ConnectCounts;
use crate::sites::surface::Surface;
use crate::{Error, ProgressToken, Result, TriMesh};
use std::sync::OnceLock;

/// The surface of a run, to be simplified where cells fail.
#[derive(Clone, Copy)]
pub(crate) struct Fallback<'a> {
    /// The repaired input, in its units.
    pub mesh: &'a TriMesh,
    pub frame: &'a UnitFrame,
    pub surface: &'a Surface,
    pub options: &'a Options,
    /// Number of faces of the repaired input that intersect others, once counted.
    pub input_intersections: &'a OnceLock<usize>,
}

/// A mesh with simplified components.
struct RepairedMesh {
    mesh: TriMesh,
    simplified_components: usize,
    intersecting_faces: usize,
}

impl Fallback<'_> {
    /// The outcome with its faulty components simplified to as many vertices; `None` if that does not help.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn repaired(&self, faulty: &Outcome, progress: &ProgressToken) -> Result<Option<Outcome>> {
        // Edge collapses do not know the user's curves.
        if has_user_curves(self.options) {
            return Ok(None);
        }
        let mut repaired = self.repaired_mesh(faulty, Spread::AsBefore, progress)?;
        // Short edges where faces of the input intersect others make more faces that do so.
        if repaired.is_none() && self.options.coarse_to_fine.sizing != Sizing::Uniform {
            repaired = self.repaired_mesh(faulty, Spread::Evenly, progress)?;
        }
        let Some(RepairedMesh { mesh, simplified_components, intersecting_faces }) = repaired else {
            return Ok(None);
        };
        Ok(Some(Outcome {
            mesh,
            // Faces that could not be filled were in those components, since a hole changes the topology.
            counts: ConnectCounts { unfilled_faces: 0, ..faulty.counts },
            simplified_components,
            intersecting_faces: Some(intersecting_faces),
            flags: faulty.flags,
            edge_lengths: faulty.edge_lengths,
            steps: faulty.steps.clone(),
            features: faulty.features,
            vertices: faulty.vertices,
            attempts: faulty.attempts,
            ..Outcome::default()
        }))
    }

    fn repaired_mesh(
        &self,
        faulty: &Outcome,
        spread: Spread,
        progress: &ProgressToken,
    ) -> Result<Option<RepairedMesh>> {
        let surface = self.surface.mesh();
        let sites = faulty.sites.positions.iter().zip(&faulty.sites.triangles);
        let sites: Vec<Site> = sites.map(|(at, triangle)| Site { at: *at, triangle: *triangle }).collect();
        let of_input = self.input_intersections(progress)?;
        let intersecting = intersecting_in_units(&faulty.mesh, self.frame, progress)?;
        let faulty_faces = if intersecting.len() > of_input { intersecting.as_slice() } else { &[] };
        let mut mesh = faulty.mesh.clone();
        let input = RepairInput { surface: &surface, sites: &sites, faulty_faces, spread };
        let target = self.simplify_target(faulty.vertices, progress);
        let repaired = Components::new(&surface).repair(&mut mesh, &input, &target);
        let Some(simplified_components) = if_enough_vertices(repaired)? else { return Ok(None) };
        let intersecting_faces = intersecting_in_units(&mesh, self.frame, progress)?.len();
        let is_better = simplified_components > 0 && intersecting_faces <= of_input;
        Ok(is_better.then_some(RepairedMesh { mesh, simplified_components, intersecting_faces }))
    }

    /// The whole surface simplified; `None` if that does not reach so few vertices.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn whole(
        &self,
        features: FeatureSummary,
        vertices: usize,
        progress: &ProgressToken,
    ) -> Result<Option<Outcome>> {
        let surface = self.surface.mesh();
        let components = Components::new(&surface);
        let simplified = components.simplify(&surface, &self.simplify_target(vertices, progress));
        let Some(mesh) = if_enough_vertices(simplified)? else { return Ok(None) };
        let intersecting_faces = intersecting_in_units(&mesh, self.frame, progress)?.len();
        let is_valid = intersecting_faces <= self.input_intersections(progress)?;
        Ok(is_valid.then_some(Outcome {
            mesh,
            simplified_components: components.count(),
            intersecting_faces: Some(intersecting_faces),
            features: Some(features),
            vertices,
            attempts: 1,
            ..Outcome::default()
        }))
    }

    fn simplify_target<'p>(&self, vertices: usize, progress: &'p ProgressToken) -> SimplifyTarget<'p> {
        SimplifyTarget::new(self.options, vertices, spacing(self.surface.area(), vertices), progress)
    }

    fn input_intersections(&self, progress: &ProgressToken) -> Result<usize> {
        input_intersections(self.input_intersections, self.mesh, progress)
    }
}

/// `None` if there were too few vertices.
fn if_enough_vertices<T>(simplified: Result<T>) -> Result<Option<T>> {
    match simplified {
        Err(Error::Usage { .. }) => Ok(None),
        simplified => simplified.map(Some),
    }
}
