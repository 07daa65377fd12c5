//! The input made ready for a run: cleaned, divided into what cells can do and what is too small for them,
//! uploaded.

use super::coarse_to_fine::Ground;
use super::coarse_to_fine::level::Level;
use super::coarse_to_fine::size_field::{SizeRequest, size_field};
use super::collapse::Wish;
use super::collapse::components::{Divided, Parts};
use super::memory::{MOST_HALVED, check_memory, longest_edge};
use super::user_curves::{has_user_curves, user_curve_edges};
use crate::gpu::Device;
use crate::mesh::correspondence::{CorrespondenceRequest, Search, half_edges_after, vertex_values_after};
use crate::mesh::features::FeatureOptions;
use crate::mesh::repair::{Repaired, repair_with};
use crate::mesh::spacing;
use crate::mesh::subdivide::halved;
use crate::mesh::submesh::extract;
use crate::mesh::topology::{Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{Method, Options, Shortage, Sizing};
use crate::sites::surface::Surface;
use crate::sites::surface_curves::SurfaceCurves;
use crate::stages::face::planar::PlanarFaces;
use crate::{Error, ProgressToken, Result, TriMesh};

/// With [`Shortage::AddVertices`], each further try to divide the components has this many times the vertices
/// of the last,
const GROWTH: f64 = 1.5;
/// in no more than so many tries.
const GROWTHS: usize = 60;
/// The input, ready for a run.
pub(crate) struct Prepared {
    pub repaired: Repaired,
    pub frame: UnitFrame,
    /// Topology of the repaired input.
    pub input: Topology,
    /// Components too small for cells, done, in the unit-diagonal frame.
    pub small: Vec<TriMesh>,
    /// The others, in the file's units, with their topology; nothing if there are no small ones.
    rest: Option<(TriMesh, Topology)>,
    /// The others on the device, in the unit-diagonal frame.
    pub surface: Surface,
    /// For [`Method::CoarseToFine`] only.
    pub ground: Option<Ground>,
    /// As asked for, but for the vertices: those left for the others.
    pub options: Options,
}

impl Prepared {
    /// # Errors
    /// [`Error::Input`] for a mesh that [`repair_with`] cannot clean, [`Error::Usage`] for too few vertices,
    /// [`Error::OutOfMemory`], [`Error::Cancelled`].
    pub fn new(
        device: &Device,
        (mesh, repaired): (&TriMesh, Option<Repaired>),
        options: &Options,
        progress: &ProgressToken,
    ) -> Result<Self> {
        let repaired = cleaned(mesh, repaired, options)?;
        progress.poll()?;
        let frame = UnitFrame::of(&repaired.mesh)?;
        check_memory(device, &repaired.mesh, options)?;
        let halved = with_vertices_near(&repaired.mesh, options, progress)?;
        progress.poll()?;
        let divided = divide(&repaired.mesh, &frame, options, progress)?;
        progress.poll()?;
        let mut options = for_repaired(mesh, &repaired, options);
        let (small, kept) = divided.map_or((Vec::new(), None), |divided| {
            options.vertices = divided.left;
            options.coarse_to_fine.coarsest = options.coarse_to_fine.coarsest.max(divided.coarsest);
            let rest = (!divided.small.is_empty()).then(|| extract(&repaired.mesh, &divided.large));
            if let (Some(rest), Sizing::Given(values)) = (&rest, &mut options.coarse_to_fine.sizing) {
                *values = values_of_part(values, (&repaired.mesh, &divided.large), rest);
            }
            (divided.small, rest)
        });
        let rest = kept.map(|mesh| {
            let topology = topology(&mesh);
            (mesh, topology)
        });
        let on = rest.as_ref().map(|(mesh, _)| mesh).or(halved.as_ref()).unwrap_or(&repaired.mesh);
        let (input, surface) = rayon::join(|| topology(&repaired.mesh), || Surface::new(device, on, &frame));
        let surface = surface?;
        progress.poll()?;
        let ground = match options.method {
            Method::CoarseToFine => Some(ground(device, (on, &frame), &surface, &options, progress)?),
            _ => None,
        };
        Ok(Self { repaired, frame, input, small, rest, surface, ground, options })
    }

    /// What is not too small for cells, in the file's units, and its topology.
    pub fn large(&self) -> (&TriMesh, &Topology) {
        self.rest.as_ref().map_or((&self.repaired.mesh, &self.input), |(mesh, topology)| (mesh, topology))
    }

    /// The triangles of the repaired mesh in the unit-diagonal frame, ready for searches, as long as there is
    /// the ground and the result's correspondence is asked for.
    pub fn searched(&self) -> Option<Search> {
        let ground = self
            .ground
            .as_ref()
            .filter(|_| self.rest.is_none() && self.options.correspondence != CorrespondenceRequest::NONE);
        ground.map(|ground| ground.target.searched())
    }

    /// Vertices of the components that are done.
    pub fn done(&self) -> usize {
        self.small.iter().map(|part| part.vertices.len()).sum()
    }
}

/// The surface with edges of at most a spacing, for sites that look for triangles at vertices near them: of a
/// long one they would miss the middle. Nothing if that is how it is, or nobody looks.
fn with_vertices_near(
    mesh: &TriMesh,
    options: &Options,
    progress: &ProgressToken,
) -> Result<Option<TriMesh>> {
    let Some(length) = longest_edge(mesh, options)? else { return Ok(None) };
    halved(mesh, length, mesh.triangles.len() + MOST_HALVED * options.vertices, progress)
}

/// The mesh as the options want it cleaned; `repaired` if there is one.
///
/// # Errors
/// As [`repair_with`] and [`check_given`]; [`Error::Usage`] if `repaired` is another mesh.
pub(crate) fn cleaned(mesh: &TriMesh, repaired: Option<Repaired>, options: &Options) -> Result<Repaired> {
    check_given(mesh, options)?;
    let Some(repaired) = repaired else { return repair_with(mesh, &options.repairs()) };
    let is_of_mesh = |t: &u32| (*t as usize) < mesh.triangles.len();
    if repaired.origin.len() == repaired.mesh.triangles.len() && repaired.origin.iter().all(is_of_mesh) {
        return Ok(repaired);
    }
    Err(Error::usage("the repaired mesh was made from another one", "give what repair made of this mesh"))
}

/// The options for a mesh as repair leaves it: sides are those of its triangles, and lengths those at its
/// vertices.
pub(crate) fn for_repaired(mesh: &TriMesh, repaired: &Repaired, options: &Options) -> Options {
    let mut options = options.clone();
    options.coarse_to_fine.fixed_half_edges =
        half_edges_after(mesh, repaired, &options.coarse_to_fine.fixed_half_edges);
    if let Sizing::Given(values) = &mut options.coarse_to_fine.sizing {
        *values = vertex_values_after(mesh, repaired, values);
    }
    options
}

/// Refuses numbers of the input's vertices that are no lengths.
fn check_given(mesh: &TriMesh, options: &Options) -> Result<()> {
    let Sizing::Given(values) = &options.coarse_to_fine.sizing else { return Ok(()) };
    if values.len() != mesh.vertices.len() {
        let problem = format!("{} edge lengths for {} vertices", values.len(), mesh.vertices.len());
        return Err(Error::usage(problem, "give one for each vertex of the input"));
    }
    let Some(v) = values.iter().position(|value| !(*value > 0.0 && value.is_finite())) else { return Ok(()) };
    let problem = format!("vertex {v} wants edges of length {}", values[v]);
    Err(Error::input(None, problem, "give lengths above 0"))
}

/// Numbers of the vertices of `mesh` as those of the part of it with these triangles.
fn values_of_part(values: &[f64], (mesh, triangles): (&TriMesh, &[u32]), part: &TriMesh) -> Vec<f64> {
    let mut of_part = vec![1.0; part.vertices.len()];
    let whole = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
    for (from, to) in whole.zip(part.triangles.as_flattened()) {
        of_part[*to as usize] = values[from as usize];
    }
    of_part
}

/// The components that are too small for cells; nothing if there is one, or if none may be.
fn divide(
    mesh: &TriMesh,
    frame: &UnitFrame,
    options: &Options,
    progress: &ProgressToken,
) -> Result<Option<Divided>> {
    // The user's lines may be on a small component, and the other methods are to stay what they are.
    if options.method != Method::CoarseToFine || has_user_curves(options) {
        return Ok(None);
    }
    if Parts::new(mesh).count() == 1 {
        return Ok(None);
    }
    let mut unit = mesh.clone();
    unit.vertices.iter_mut().for_each(|p| *p = frame.to_unit(*p));
    let parts = Parts::new(&unit);
    let mut vertices = options.vertices;
    let mut tries = 0;
    loop {
        let wish = Wish { vertices, ..Wish::of(options, spacing(parts.area(), vertices), progress) };
        match parts.divide(&unit, &wish) {
            Err(Error::Usage { .. })
                if options.coarse_to_fine.shortage == Shortage::AddVertices && tries < GROWTHS =>
            {
                vertices = (GROWTH * vertices as f64).ceil() as usize;
                tries += 1;
            }
            divided => return divided.map(Some),
        }
    }
}

/// What the default pipeline needs of a surface, which is that of `mesh`, for as many vertices.
///
/// # Errors
/// As [`Ground::new`].
pub(crate) fn ground(
    device: &Device,
    (mesh, frame): (&TriMesh, &UnitFrame),
    surface: &Surface,
    options: &Options,
    progress: &ProgressToken,
) -> Result<Ground> {
    let place = places_on(surface, mesh);
    let wanted = user_curve_edges(mesh, options)?;
    let user_edges = wanted.into_iter().map(|edge| edge.map(|v| place[v as usize])).collect();
    let spacing = spacing(surface.area(), options.vertices);
    let wanted = FeatureOptions { feature_angle: options.coarse_to_fine.feature_angle, spacing, user_edges };
    let mut given = Vec::new();
    if let Sizing::Given(values) = &options.coarse_to_fine.sizing {
        given = vec![1.0; values.len()];
        place.iter().zip(values).for_each(|(v, value)| given[*v as usize] = *value);
    }
    let sized = |curves: Option<&SurfaceCurves>| {
        let wish = SizeRequest { options, given: &given, diagonal: frame.scale };
        size_field(&surface.mesh(), curves, &wish)
    };
    Ground::new(device, surface, &wanted, sized, progress)
}

/// Where the mesh's vertices are on the surface, which has its triangles in their order, but not its
/// vertices.
fn places_on(surface: &Surface, mesh: &TriMesh) -> Vec<u32> {
    let mut place = vec![0; mesh.vertices.len()];
    for (from, to) in mesh.triangles.as_flattened().iter().zip(surface.triangles.as_flattened()) {
        place[*from as usize] = *to;
    }
    place
}

/// Compiles the kernels with which the default pipeline begins; other methods compile theirs themselves.
pub(crate) fn compile(device: &Device, method: Method) -> Result<()> {
    match method {
        Method::CoarseToFine => Level::compile(device),
        _ => Ok(()),
    }
}

/// Compiles what the default pipeline needs later: the kernel for what lists do not decide, which takes as
/// long as all others.
pub(crate) fn compile_later(device: &Device, method: Method) -> Result<()> {
    match method {
        Method::CoarseToFine => PlanarFaces::compile_exact(device),
        _ => Ok(()),
    }
}
