//! Preparation of the input: repaired, divided into small and large components, and uploaded.

use super::RunInput;
use super::all_at_once::sizes::{halve_values, sizes};
use super::coarse_to_fine::device_polish;
use super::coarse_to_fine::level::Level;
use super::coarse_to_fine::surface_model::{ModelRequest, SurfaceModel};
use super::fallback::components::{Components, Division};
use super::fallback::remesh::ComponentTarget;
use super::intersections::InputIntersections;
use super::kept::Kept;
use super::memory::{MOST_HALVED, check_memory, longest_edge};
use super::messages::describe_cracks;
use super::outcome::Outcome;
use super::plan::Plan;
use super::run_context::RunContext;
use super::sides::face_as;
use super::warning::Warning;
use crate::gpu::Device;
use crate::grammar::counted;
use crate::mesh::coincident::separate_coincident;
use crate::mesh::correspondence::{CorrespondenceRequest, SurfaceSearch};
use crate::mesh::repair::{Repaired, cracks, repair_with_progress};
use crate::mesh::sizing::SizeField;
use crate::mesh::spacing;
use crate::mesh::subdivide::{Halved, halve_edges};
use crate::mesh::submesh::{append, extract};
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Method, Options, Shortage, Sizing};
use crate::sites::surface::Surface;
use crate::{Error, ProgressToken, Result, TriMesh};
use glam::DVec3;
use rayon::prelude::*;

/// With [`Shortage::AddVertices`], each further try to divide the components has this many times the vertices
/// of the last.
const GROWTH: f64 = 1.5;
/// Maximum number of further tries to divide the components.
const GROWTHS: usize = 60;

/// The input, ready for a run.
pub(crate) struct Prepared {
    /// What stays as it is; the rest of this is about what does not.
    pub kept: Option<Kept>,
    pub repaired: Repaired,
    pub frame: UnitFrame,
    /// Topology of the repaired input.
    pub input: Topology,
    /// Components too small for cells, simplified, in the unit-diagonal frame.
    pub small: Vec<TriMesh>,
    /// The other components, in the input's units; `None` if there are no small ones.
    large: Option<(TriMesh, Topology)>,
    /// The large components on the device, in the unit-diagonal frame.
    pub surface: Surface,
    /// For [`Method::CoarseToFine`] only.
    pub model: Option<SurfaceModel>,
    /// Edge lengths over the surface, for [`Method::AllAtOnce`]; the model has those of the other.
    pub sizes: SizeField,
    /// For the large components.
    pub plan: Plan,
    pub input_intersections: InputIntersections,
}

impl Prepared {
    /// # Errors
    /// [`Error::Input`] for a mesh that cannot be repaired, [`Error::Usage`] for too few vertices,
    /// [`Error::OutOfMemory`], [`Error::Cancelled`].
    pub fn new(device: &Device, mut input: RunInput, progress: &ProgressToken) -> Result<Self> {
        let options = input.options;
        let mut repaired = repaired_for(input.mesh, input.repaired.take(), options, progress)?;
        let kept = Kept::cut_off(&mut repaired, options, input.mesh)?;
        let mut plan = Plan::new(&input, &mut repaired, kept.as_ref(), progress)?;
        progress.poll()?;
        let frame = UnitFrame::of(&repaired.mesh)?;
        // Curves are not known yet.
        check_memory(device, &repaired.mesh, options, plan.vertices, false)?;
        let subdivided = subdivide(&repaired.mesh, options, plan.vertices, progress)?;
        if let Some(halved) = &subdivided {
            halve_values(&mut plan.sizing, halved);
        }
        progress.poll()?;
        let division = divide(&repaired.mesh, &frame, options, &plan, progress);
        let division = division.map_err(|error| name_cracks(error, &repaired.mesh))?;
        progress.poll()?;
        let (small, large) = division.map_or((Vec::new(), None), |division| {
            plan.vertices = division.vertices_left;
            plan.coarsest = plan.coarsest.max(division.coarsest);
            let large = (!division.small.is_empty()).then(|| extract(&repaired.mesh, &division.large));
            if let (Some(large), Sizing::Given(values)) = (&large, &mut plan.sizing) {
                *values = submesh_values(values, &repaired.mesh, &division.large, large);
            }
            if let (Some(large), false) = (&large, plan.refined.is_empty()) {
                plan.refined.keep(&repaired.mesh, &division.large, large);
            }
            (division.small, large)
        });
        let large = large.map(|mesh| {
            let topology = topology(&mesh);
            (mesh, topology)
        });
        let on = large
            .as_ref()
            .map(|(mesh, _)| mesh)
            .or(subdivided.as_ref().map(|halved| &halved.mesh))
            .unwrap_or(&repaired.mesh);
        let (input, surface) = rayon::join(|| topology(&repaired.mesh), || Surface::new(on, &frame));
        progress.poll()?;
        let sizes = sizes(&surface, on, &plan, options, frame.scale)?;
        let input_intersections = InputIntersections::default();
        let mut prepared = Self {
            kept,
            repaired,
            frame,
            input,
            small,
            large,
            surface,
            model: None,
            sizes,
            plan,
            input_intersections,
        };
        if options.method == Method::CoarseToFine {
            let context = prepared.context(device, options, None);
            let model = SurfaceModel::new(&context, &ModelRequest::of(context.plan), None, progress)?;
            if model.curves.is_some() {
                check_memory(device, context.mesh, options, context.plan.vertices, true)?;
            }
            prepared.model = Some(model);
        }
        Ok(prepared)
    }

    /// What a run on the components that are not too small for cells shares; `deviation` as there.
    pub fn context<'a>(
        &'a self,
        device: &'a Device,
        options: &'a Options,
        deviation: Option<f64>,
    ) -> RunContext<'a> {
        let Self { repaired, frame, input, large, surface, plan, input_intersections, .. } = self;
        let whole = (&repaired.mesh, input);
        let (mesh, input) = large.as_ref().map_or(whole, |(mesh, topology)| (mesh, topology));
        RunContext { device, mesh, frame, surface, input, input_intersections, options, plan, deviation }
    }

    /// A search over the repaired mesh in the unit-diagonal frame, if the result's correspondence is asked
    /// for and the model has one.
    pub fn search(&self, options: &Options) -> Option<SurfaceSearch> {
        let is_needed = self.large.is_none()
            && self.kept.is_none()
            && options.correspondence != CorrespondenceRequest::NONE;
        self.model.as_ref().filter(|_| is_needed).map(|model| model.target.searched(&self.surface.origin))
    }

    /// Vertices of the small components, and of the kept triangles alone.
    pub fn other_vertices(&self) -> usize {
        let kept = self.kept.as_ref().map_or(0, Kept::own_vertices);
        kept + self.small.iter().map(|part| part.vertices.len()).sum::<usize>()
    }

    /// Takes the mesh of an outcome and adds the small components, which count as simplified, and the kept
    /// triangles, in the input's units. Also what is to be said of vertices that the user wanted to be kept.
    /// From then on, the repaired input and its topology are those of the whole, the latter before any
    /// division.
    ///
    /// # Errors
    /// Those of [`Kept::join`].
    pub fn assemble(&mut self, outcome: &mut Outcome) -> Result<(TriMesh, Vec<Warning>)> {
        let mut mesh = outcome.take_mesh();
        let pinned = self.plan.pinned.among(&mesh.vertices);
        face_as(&mut mesh, &self.surface.mesh());
        self.small.iter().for_each(|part| append(&mut mesh, part));
        outcome.simplified_components += self.small.len();
        mesh.vertices.par_iter_mut().for_each(|p| *p = self.frame.to_input_units(*p));
        // Exactly, and not there and back.
        pinned.iter().for_each(|(v, position)| mesh.vertices[*v] = *position);
        separate_coincident(&mut mesh);
        if let Some(kept) = &mut self.kept {
            kept.join(&mut mesh, &pinned)?;
            std::mem::swap(&mut self.repaired, &mut kept.whole);
            std::mem::swap(&mut self.input, &mut kept.topology);
            self.plan.refined.undivided = None;
        }
        if let Some(undivided) = &self.plan.refined.undivided {
            self.input = undivided.clone();
        }
        let warnings = self.plan.pinned.warnings(&mesh);
        Ok((mesh, warnings))
    }
}

/// The surface with edges of at most a spacing, for sites that search for triangles at nearby vertices and
/// would miss the middle of long ones; `None` if it has no longer edges or there is no such search.
fn subdivide(
    mesh: &TriMesh,
    options: &Options,
    vertices: usize,
    progress: &ProgressToken,
) -> Result<Option<Halved>> {
    let Some(length) = longest_edge(mesh, options, vertices)? else { return Ok(None) };
    let most = mesh.triangles.len() + MOST_HALVED * vertices;
    halve_edges(mesh, (length, DVec3::distance), most, progress)
}

/// The mesh repaired as the options say, or `repaired` if it is given.
///
/// # Errors
/// As [`repair_with_progress`] and [`check_given_sizes`]; [`Error::Usage`] if `repaired` is another mesh.
pub(crate) fn repaired_for(
    mesh: &TriMesh,
    repaired: Option<Repaired>,
    options: &Options,
    progress: &ProgressToken,
) -> Result<Repaired> {
    check_given_sizes(mesh, options)?;
    let Some(repaired) = repaired else { return repair_with_progress(mesh, &options.repairs(), progress) };
    let is_of_mesh = |t: &u32| (*t as usize) < mesh.triangles.len();
    if repaired.origin.len() == repaired.mesh.triangles.len() && repaired.origin.iter().all(is_of_mesh) {
        return Ok(repaired);
    }
    Err(Error::usage("the repaired mesh was made from another one", "give what repair made of this mesh"))
}

/// Refuses sizes that are not positive, or not one for each vertex.
fn check_given_sizes(mesh: &TriMesh, options: &Options) -> Result<()> {
    let Sizing::Given(values) = &options.coarse_to_fine.sizing else { return Ok(()) };
    if values.len() != mesh.vertices.len() {
        let lengths = counted(values.len(), ["edge length", "edge lengths"]);
        let vertices = counted(mesh.vertices.len(), ["vertex", "vertices"]);
        let problem = format!("{lengths} for {vertices}");
        return Err(Error::usage(problem, "give one for each vertex of the input"));
    }
    let Some(v) = values.iter().position(|value| !(*value > 0.0 && value.is_finite())) else { return Ok(()) };
    let problem = format!("vertex {v} has edge length {}", values[v]);
    Err(Error::input(None, problem, "give lengths above 0"))
}

/// Values at the vertices of `mesh` as those of `submesh`, which has these triangles of it.
pub(super) fn submesh_values<T: Copy + Default>(
    values: &[T],
    mesh: &TriMesh,
    triangles: &[u32],
    submesh: &TriMesh,
) -> Vec<T> {
    let mut result = vec![T::default(); submesh.vertices.len()];
    let corners = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
    for (from, to) in corners.zip(submesh.triangles.as_flattened()) {
        result[*to as usize] = values[from as usize];
    }
    result
}

/// The small components and the others; `None` if there is only one, or if none may be simplified.
fn divide(
    mesh: &TriMesh,
    frame: &UnitFrame,
    options: &Options,
    plan: &Plan,
    progress: &ProgressToken,
) -> Result<Option<Division>> {
    // The user's curves may be on a small component, and the other method's presets are never changed. Local
    // operations take components of any size.
    let is_local = options.coarse_to_fine.sizing.aspect().is_some();
    if options.method != Method::CoarseToFine || plan.has_kept() || is_local {
        return Ok(None);
    }
    if Components::new(mesh).count() == 1 {
        return Ok(None);
    }
    let mut unit = mesh.clone();
    unit.vertices.iter_mut().for_each(|p| *p = frame.to_unit(*p));
    let components = Components::new(&unit);
    let mut vertices = plan.vertices;
    let mut tries = 0;
    loop {
        let spacing = spacing(components.area(), vertices);
        let target = ComponentTarget::new(options, vertices, spacing, frame, progress);
        match components.divide(&unit, &plan.refined.lengths, &target) {
            Err(Error::Usage { .. }) if options.shortage == Shortage::AddVertices && tries < GROWTHS => {
                vertices = (GROWTH * vertices as f64).ceil() as usize;
                tries += 1;
            }
            division => return division.map(Some),
        }
    }
}

/// Says of too few vertices for many components that they may be one with cracks.
fn name_cracks(error: Error, mesh: &TriMesh) -> Error {
    let (Error::Usage { problem, remedy, field: None }, Some(cracks)) = (&error, cracks(mesh)) else {
        return error;
    };
    Error::usage(format!("{problem}; {}", describe_cracks(&cracks)), remedy)
}

/// Compiles the kernels with which the default pipeline begins; the other method compiles its kernels itself.
///
/// # Errors
/// Those of the device.
pub(crate) fn compile(device: &Device, method: Method) -> Result<()> {
    match method {
        Method::CoarseToFine => Level::compile(device),
        Method::AllAtOnce => Ok(()),
    }
}

/// Compiles what the default pipeline needs later: the kernels of the polish where the device does that.
///
/// # Errors
/// Those of the device.
pub(crate) fn compile_later(device: &Device, method: Method, vertices: usize) -> Result<()> {
    match method {
        Method::CoarseToFine if device.polishes(vertices) => device_polish::compile(device),
        Method::CoarseToFine | Method::AllAtOnce => Ok(()),
    }
}
