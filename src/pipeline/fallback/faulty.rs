//! Faulty results of cells, whose components are remeshed by local operations; or the whole surface is.

use super::components::{Components, RepairInput};
use super::remesh::{ComponentTarget, remesh_locally};
use crate::mesh::features::FeatureOptions;
use crate::mesh::quality::quality;
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::pipeline::intersections::{Intersections, intersecting_in_units};
use crate::pipeline::missing::missing_vertices;
use crate::pipeline::outcome::{Fault, FaultKind, Outcome, SLIVER, is_bad_all_over, slivers};
use crate::pipeline::result::FeatureSummary;
use crate::pipeline::run_context::RunContext;
use crate::pipeline::sides::face_as;
use crate::sites::connect::ConnectCounts;
use crate::{Error, ProgressToken, Result, TriMesh};

/// Slivers are few up to this share of all triangles.
const FEW_SLIVERS: f64 = 0.02;

/// Faces that intersect others are few up to this share of all.
const FEW_INTERSECTING: f64 = 0.01;
/// Triangles with a lower mean quality are poor.
const POOR: f64 = 0.8;
/// They are much better if their mean quality is higher by this.
const MUCH_BETTER: f64 = 0.05;

/// More broken cells than this share of all are many.
const MANY_BROKEN: f64 = 0.03;

/// The surface of a run, for other ways where cells fail.
#[derive(Clone, Copy)]
pub(crate) struct Fallback<'a> {
    pub context: RunContext<'a>,
    pub sizes: &'a SizeField,
}

impl Fallback<'_> {
    /// The outcome with its faulty components remeshed, with the same number of vertices; with a fault if
    /// faces still intersect, `None` if there are too few vertices or nothing could be replaced.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn repaired(&self, faulty: &Outcome, progress: &ProgressToken) -> Result<Option<Outcome>> {
        // Components are remeshed without the user's curves, and what local operations made has no sites.
        let has_sites = faulty.sites.triangles.len() >= faulty.mesh.vertices.len();
        if self.context.plan.has_kept() || !has_sites {
            return Ok(None);
        }
        let surface = self.context.surface.mesh();
        let mut faulty_faces = self.intersections(&faulty.mesh, progress)?.new;
        let feature_angle = self.context.options.coarse_to_fine.feature_angle;
        if faulty.fault.as_ref().is_some_and(|fault| matches!(fault.kind, FaultKind::Slivers(_))) {
            faulty_faces.extend(slivers(&faulty.mesh, &surface, feature_angle).into_iter().map(|(_, t)| t));
        }
        let missing = self.missing(&surface, &faulty.mesh, progress)?;
        let mut mesh = faulty.mesh.clone();
        let input = RepairInput {
            surface: &surface,
            under: &faulty.sites.triangles,
            faulty_faces: &faulty_faces,
            missing: &missing,
        };
        let broken = faulty.counts.cells.map_or(0, |cells| cells.broken_cells);
        let has_broken_cells = broken as f64 > MANY_BROKEN * faulty.vertices as f64;
        let target = ComponentTarget { has_broken_cells, ..self.component_target(faulty.vertices, progress) };
        let repaired = Components::new(&surface).repair(&mut mesh, &input, &target);
        let Some(simplified_components) = if_enough_vertices(repaired)? else { return Ok(None) };
        if simplified_components == 0 {
            return Ok(None);
        }
        let outcome = Outcome {
            // Faces that could not be filled were in those components, since a hole changes the topology.
            counts: ConnectCounts { unfilled_faces: 0, cells: None, ..faulty.counts },
            simplified_components,
            flags: faulty.flags,
            edge_lengths: faulty.edge_lengths,
            steps: faulty.steps.clone(),
            features: faulty.features,
            vertices: faulty.vertices,
            mended: faulty.mended,
            attempts: faulty.attempts,
            ..Outcome::default()
        };
        self.checked(mesh, outcome, progress).map(Some)
    }

    /// Whether nothing is wrong but a few slivers, and the input has such triangles, as CAD programs make
    /// them in strips narrower than an edge: local operations find no better ones there, and take long.
    pub fn has_usual_slivers(&self, outcome: &Outcome) -> bool {
        let Some(Fault { kind: FaultKind::Slivers(count), .. }) = outcome.fault else { return false };
        let are_few = count as f64 <= FEW_SLIVERS * outcome.mesh.triangles.len() as f64;
        let smallest = match self.context.plan.bends {
            Some(bends) => Some(bends.smallest_angle),
            None => quality(self.context.mesh).map(|quality| quality.min_angle),
        };
        are_few && smallest.is_some_and(|smallest| smallest <= 2.0 * SLIVER)
    }

    /// Number of components.
    pub fn components(&self) -> usize {
        Components::new(&self.context.surface.mesh()).count()
    }

    /// The whole surface remeshed by local operations; with a fault if faces intersect that did not in the
    /// input.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn whole(
        &self,
        features: FeatureSummary,
        vertices: usize,
        progress: &ProgressToken,
    ) -> Result<Outcome> {
        self.remeshed(features, &self.component_target(vertices, progress), progress)
    }

    /// Like [`Fallback::whole`], but close to the surface, whatever that costs in evenness; components for
    /// which that fails are simplified.
    ///
    /// # Errors
    /// As [`Fallback::whole`].
    pub fn whole_closely(
        &self,
        features: FeatureSummary,
        vertices: usize,
        progress: &ProgressToken,
    ) -> Result<Outcome> {
        let target = ComponentTarget { closely: true, ..self.component_target(vertices, progress) };
        self.remeshed(features, &target, progress)
    }

    /// The surface remeshed by local operations, with all features of these options, the user's curves among
    /// them, or `None` if there are too few vertices for that.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn with_all_features(
        &self,
        (features, options): (FeatureSummary, &FeatureOptions),
        vertices: usize,
        progress: &ProgressToken,
    ) -> Result<Option<Outcome>> {
        let surface = self.context.surface.mesh();
        let target = self.component_target(vertices, progress);
        let lengths: Vec<f64> = match self.sizes.is_uniform() {
            true => Vec::new(),
            false => (0..surface.vertices.len() as u32).map(|v| self.sizes.at_vertex(v)).collect(),
        };
        let made = remesh_locally(&surface, &lengths, (options, &target), &progress.silent())?;
        let Some(mut mesh) = made else { return Ok(None) };
        face_as(&mut mesh, &surface);
        let outcome = self.of_local_operations(features, vertices);
        let placed = self.checked_place(mesh, outcome, progress)?;
        Ok((!placed.is_refused()).then(|| self.with_shape(placed)))
    }

    fn remeshed(
        &self,
        features: FeatureSummary,
        target: &ComponentTarget,
        progress: &ProgressToken,
    ) -> Result<Outcome> {
        let vertices = target.vertices;
        let surface = self.context.surface.mesh();
        let mesh = Components::new(&surface).remesh(&surface, target)?;
        self.checked(mesh, self.of_local_operations(features, vertices), progress)
    }

    /// What is known of the whole surface made by local operations, without the mesh.
    fn of_local_operations(&self, features: FeatureSummary, vertices: usize) -> Outcome {
        Outcome {
            simplified_components: self.components(),
            features: Some(features),
            vertices,
            attempts: 1,
            ..Outcome::default()
        }
    }

    /// The outcome with this mesh, and with a fault if its faces intersect more than those of the input.
    pub fn checked(&self, mesh: TriMesh, outcome: Outcome, progress: &ProgressToken) -> Result<Outcome> {
        Ok(self.with_shape(self.checked_place(mesh, outcome, progress)?))
    }

    /// The outcome with a fault if its triangles are bad.
    fn with_shape(&self, mut outcome: Outcome) -> Outcome {
        if is_bad_all_over(&outcome.mesh) {
            outcome.fault = Some(Fault { kind: FaultKind::SliversAllOver, at: None });
        }
        if outcome.fault.is_none() {
            let feature_angle = self.context.options.coarse_to_fine.feature_angle;
            outcome.fault = Fault::sliver(&outcome.mesh, &self.context.surface.mesh(), feature_angle);
        }
        outcome
    }

    /// Like [`Fallback::checked`], whatever the shape of the triangles.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn checked_place(
        &self,
        mesh: TriMesh,
        outcome: Outcome,
        progress: &ProgressToken,
    ) -> Result<Outcome> {
        let Intersections { count, new } = self.intersections(&mesh, progress)?;
        let centre = |t: &u32| mesh.corners(*t as usize).into_iter().sum::<glam::DVec3>() / 3.0;
        let mut fault =
            new.first().map(|t| Fault { kind: FaultKind::Intersections(new.len()), at: Some(centre(t)) });
        let surface = self.context.surface.mesh();
        if let Some(v) = self.missing(&surface, &mesh, progress)?.first() {
            fault = Some(Fault { kind: FaultKind::Missing, at: Some(surface.vertices[*v as usize]) });
        }
        Ok(Outcome { fault, mesh, intersecting_faces: Some(count), ..outcome })
    }

    fn missing(&self, surface: &TriMesh, mesh: &TriMesh, progress: &ProgressToken) -> Result<Vec<u32>> {
        let spacing = spacing(self.context.surface.area(), mesh.vertices.len());
        missing_vertices(surface, (mesh, &[]), (spacing, self.sizes), progress)
    }

    fn intersections(&self, mesh: &TriMesh, progress: &ProgressToken) -> Result<Intersections> {
        let spacing = spacing(self.context.surface.area(), mesh.vertices.len());
        let intersecting = intersecting_in_units(mesh, self.context.frame, progress)?;
        self.context.input_intersections.compare(
            self.context.mesh,
            self.context.frame,
            (mesh, spacing, intersecting),
            progress,
        )
    }

    fn component_target<'p>(&'p self, vertices: usize, progress: &'p ProgressToken) -> ComponentTarget<'p> {
        let spacing = spacing(self.context.surface.area(), vertices);
        let target =
            ComponentTarget::new(self.context.options, vertices, spacing, self.context.frame, progress);
        ComponentTarget { sizes: Some(self.sizes), ..target }
    }
}

/// The one with the lesser fault, of equals the first. If both have only a few intersecting faces, one has
/// poor triangles and the other one much better ones, that one.
pub(crate) fn better(one: Outcome, other: Outcome) -> Outcome {
    let severity = |outcome: &Outcome| outcome.fault.as_ref().map(|fault| fault.kind);
    if intersects_little(&one) && intersects_little(&other) {
        let mean = |outcome: &Outcome| quality(&outcome.mesh).map_or(0.0, |quality| quality.mean_quality);
        let [first, second] = [&one, &other].map(mean);
        if first.min(second) < POOR && (first - second).abs() > MUCH_BETTER {
            return if second > first { other } else { one };
        }
    }
    if severity(&other) < severity(&one) { other } else { one }
}

/// Whether nothing is known to be worse than that a few faces intersect others.
fn intersects_little(outcome: &Outcome) -> bool {
    let few = FEW_INTERSECTING * outcome.mesh.triangles.len() as f64;
    matches!(outcome.fault, Some(Fault { kind: FaultKind::Intersections(count), .. }) if count as f64 <= few)
}

/// `None` if there were too few vertices.
fn if_enough_vertices<T>(simplified: Result<T>) -> Result<Option<T>> {
    match simplified {
        Err(Error::Usage { .. }) => Ok(None),
        simplified => simplified.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Of 1,000 triangles, each as wide as high, or a tenth of that.
    fn outcome(kind: Option<FaultKind>, is_even: bool) -> Outcome {
        let height = if is_even { 0.9 } else { 0.1 };
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0)];
        let mesh = TriMesh {
            vertices: (0..1000).flat_map(|t| corners.map(|p| p + f64::from(t) * DVec3::Z)).collect(),
            triangles: (0..1000).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        };
        Outcome { mesh, fault: kind.map(|kind| Fault { kind, at: None }), ..Outcome::default() }
    }

    #[test]
    fn a_few_intersections_weigh_less_than_poor_triangles_and_all_else_more() {
        use FaultKind::{Intersections, Topology};
        let [few, fewer, many] = [8, 2, 50].map(|count| Some(Intersections(count)));
        for (one, other, second_is_better) in [
            ((few, true), (fewer, false), false),
            ((fewer, false), (few, true), true),
            ((few, true), (fewer, true), true),
            ((fewer, true), (few, true), false),
            ((many, true), (few, false), true),
            ((few, true), (None, false), true),
            ((Some(Topology), true), (many, false), true),
        ] {
            let [one, other] = [one, other].map(|(kind, is_even)| outcome(kind, is_even));
            let second = (other.fault.clone(), other.mesh.clone());
            let found = better(one, other);
            assert_eq!((found.fault, found.mesh) == second, second_is_better, "{:?}", second.0);
        }
    }
}
