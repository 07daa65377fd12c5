//! The job of remeshing one mesh: its surface, its number of vertices, its attributes, the run and the
//! warnings. `remesh`, `batch` and other programs' calls differ in where input and output are.

use super::attributes::{AttributeArgs, carry_attributes};
use super::cloud::{HoleArgs, size_by_points};
use super::files::tell_notes;
use super::method::{MethodArgs, refuse_messages};
use super::progress::RunProgress;
use super::target_count::count;
use super::volume::{VolumeArgs, settle_isovalues};
use super::wrap::{Around, wrapped};
use rtfmesh::cloud::PointCloud;
use rtfmesh::io::{Loaded, Volume};
use rtfmesh::mesh::attributes::{Attribute, Attributes};
use rtfmesh::mesh::correspondence::find_correspondence;
use rtfmesh::mesh::repair::{RepairOptions, Repaired};
use rtfmesh::report::Report;
use rtfmesh::{
    CorrespondenceRequest, Device, Error, Length, Method, Options, Preview, ProgressToken, Remeshed, Result,
    Shortage, Size, Sizing, Summary, TriMesh, WarningCode, preview_repaired, remesh_repaired,
};
use std::borrow::Cow;
use std::path::Path;
use std::time::Instant;

/// What is asked for.
pub struct Request<'a> {
    pub method: &'a MethodArgs,
    pub attributes: &'a AttributeArgs,
    pub size: Size,
    /// The options except those that depend on the mesh; the output's format is set if it goes to a file.
    pub options: Options,
    /// What `--sizing property:NAME` takes instead of an attribute of the mesh, with a number for each vertex
    /// or point. It is not carried over to the result.
    pub sizing: Option<Attribute>,
    /// The correspondence to compute in addition to what the attributes need.
    pub correspondence: CorrespondenceRequest,
    /// The name of the input in errors.
    pub file: Option<&'a Path>,
}

/// What the surface is made from.
pub enum SurfaceSource<'a> {
    /// A mesh, which is the surface.
    Mesh(Cow<'a, Loaded>),
    /// Points.
    Points { cloud: PointCloud, holes: &'a HoleArgs },
    /// Values on a grid; `closed` as the option `--closed`.
    Volume { volume: Cow<'a, Volume>, args: &'a VolumeArgs, closed: bool },
}

/// Notes on a mesh, in the order in which they come.
#[derive(Default)]
pub struct Notes<'a> {
    /// The notes for a report.
    pub list: Vec<String>,
    /// The file named in printed notes; nothing is printed if it is `None`.
    told: Option<&'a Path>,
}

impl<'a> Notes<'a> {
    /// Starts with the notes from reading, which have been printed already. Later ones are printed with the
    /// name of the file `told`.
    pub fn new(list: Vec<String>, told: Option<&'a Path>) -> Self {
        Self { list, told }
    }

    /// Adds a note.
    pub fn add(&mut self, note: impl Into<String>) {
        let note = note.into();
        self.mention(&note);
        self.list.push(note);
    }

    /// Prints a note without adding it to the report's list.
    pub fn mention(&self, note: &str) {
        if let Some(file) = self.told {
            tell_notes(file, &[note.to_owned()]);
        }
    }
}

/// A mesh that is ready for its run.
pub struct RemeshJob<'a> {
    attributes: &'a AttributeArgs,
    file: Option<&'a Path>,
    /// The surface, with its attributes and warnings.
    pub loaded: Cow<'a, Loaded>,
    /// The options for this mesh.
    pub options: Options,
    repaired: Option<Repaired>,
    /// Whether the surface is that of a volume.
    is_volume: bool,
    /// What the surface is around, if it was made by wrapping.
    wrapped: Option<WrappedInput>,
}

/// A mesh that was wrapped.
struct WrappedInput {
    mesh: TriMesh,
    repaired: Repaired,
}

/// A surface to be remeshed.
struct Surface<'a> {
    loaded: Cow<'a, Loaded>,
    wrapped: Option<WrappedInput>,
}

/// What a run gives.
pub struct Finished {
    /// With all warnings.
    pub result: Remeshed,
    /// The input's attributes for the result.
    pub attributes: Attributes,
    /// Whether Ctrl-C ended the run early.
    pub is_cut_short: bool,
}

impl<'a> RemeshJob<'a> {
    /// Makes the surface and finds out all that depends on it: the number of vertices, and what attributes
    /// need.
    ///
    /// # Errors
    /// Those of making surfaces and of repair; [`rtfmesh::Error::Input`] for an attribute that is missing.
    pub fn new(
        request: Request<'a>,
        source: SurfaceSource<'a>,
        notes: &mut Notes,
        run: &mut RunProgress,
    ) -> Result<Self> {
        let file = request.file;
        request.prepare(source, notes, run).map_err(|error| in_file(error, file))
    }

    /// The plan of the run, without running it.
    ///
    /// # Errors
    /// Those of [`preview_repaired`].
    pub fn preview(self) -> Result<Preview> {
        let plan = preview_repaired(&self.loaded.mesh, self.repaired, &self.options);
        plan.map_err(|error| in_file(error, self.file))
    }

    /// Runs, and collects the warnings.
    ///
    /// # Errors
    /// Those of [`remesh_repaired`] and [`refuse_messages`].
    pub fn remesh(&mut self, device: &Device, run: &mut RunProgress) -> Result<Finished> {
        let (mesh, repaired) = (&self.loaded.mesh, self.repaired.take());
        let result = remesh_repaired(device, mesh, repaired, &self.options, |now| run.update(now));
        run.end();
        let mut result = result.map_err(|error| in_file(error, self.file))?;
        refuse_messages(device)?;
        let is_cut_short = run.warn(&mut result.summary);
        result.summary.warn_all(self.loaded.warnings.iter().cloned());
        let format = self.options.format;
        if let Some(text) = format.and_then(|format| self.attributes.texture_warning(&self.loaded, format)) {
            result.summary.warn(WarningCode::Textures, text);
        }
        let mut attributes = match self.attributes.drops_all() {
            true => Attributes::default(),
            false => carry_attributes(mesh, &self.loaded.attributes, &result),
        };
        if self.is_volume {
            settle_isovalues(&self.loaded, &result.mesh, &mut attributes);
        }
        if let (Some(WrappedInput { mesh, repaired }), Some(found)) =
            (&self.wrapped, &mut result.correspondence)
        {
            // The places are wanted on what the user has.
            let (request, progress) = (self.options.correspondence, ProgressToken::default());
            *found = find_correspondence(mesh, repaired, &result.mesh, request, &progress)?;
        }
        Ok(Finished { result, attributes, is_cut_short })
    }

    /// The report on a result; `files` are the names of input and output, empty for meshes in memory.
    pub fn report<'r>(
        &'r self,
        device: &'r Device,
        summary: &'r Summary,
        notes: &'r Notes,
        files: [String; 2],
    ) -> Report<'r> {
        let [input_file, output_file] = files;
        Report {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            input_file,
            output_file,
            notes: &notes.list,
            options: &self.options,
            device: device.info(),
            summary,
        }
    }
}

impl<'a> Request<'a> {
    fn prepare(
        mut self,
        source: SurfaceSource<'a>,
        notes: &mut Notes,
        run: &mut RunProgress,
    ) -> Result<RemeshJob<'a>> {
        let is_volume = matches!(source, SurfaceSource::Volume { .. });
        // An attribute that is missing is reported before any long work.
        self.method.sizing_values(sizing_among(self.sizing.as_ref(), source.vertex_attributes()))?;
        let Surface { loaded, wrapped } = self.make_surface(source, notes, run)?;
        self.options.coarse_to_fine.refine = self.method.refinements(&loaded)?;
        let kept = self.method.kept(&loaded)?;
        if !kept.is_empty() {
            self.options.coarse_to_fine.keep = kept;
            self.options.validate()?;
        }
        let repaired = count(self.size, &loaded.mesh, &mut self.options, notes)?;
        let repaired = self.attributes.request(&loaded, repaired, &mut self.options, notes)?;
        self.options.correspondence.vertices |= self.correspondence.vertices;
        self.options.correspondence.faces |= self.correspondence.faces;
        let vertex = sizing_among(self.sizing.as_ref(), &loaded.attributes.vertex);
        if let Some(values) = self.method.sizing_values(vertex)? {
            self.options.coarse_to_fine.sizing = Sizing::Given(values.to_vec());
        }
        let Self { attributes, options, file, .. } = self;
        Ok(RemeshJob { attributes, file, loaded, options, repaired, is_volume, wrapped })
    }

    /// The surface. If it is made, from points, a volume or by wrapping, its sharp edges are artefacts or
    /// ragged, so the options get none unless the user set the feature angle.
    fn make_surface(
        &mut self,
        source: SurfaceSource<'a>,
        notes: &mut Notes,
        run: &mut RunProgress,
    ) -> Result<Surface<'a>> {
        let begin = Instant::now();
        let (mut rim, mut inside) = (None, None);
        let detail = self.method.wrap.detail();
        if detail.is_some() && !matches!(source, SurfaceSource::Mesh(_)) {
            let remedy = "remove it, or wrap a mesh that was made of it";
            return Err(Error::usage("--wrap works only with meshes", remedy));
        }
        let mut made = match source {
            SurfaceSource::Mesh(loaded) => match detail {
                Some(detail) => {
                    let (made, wrapped) = self.wrapped(loaded.into_owned(), detail, run)?;
                    inside = Some(wrapped);
                    made
                }
                None => return Ok(Surface { loaded, wrapped: None }),
            },
            SurfaceSource::Points { mut cloud, holes } => {
                self.size = size_by_points(self.size, cloud.points.len(), &self.options);
                let has_sizing = self.sizing.is_some();
                cloud.attributes.vertex.extend(self.sizing.take());
                let fill_holes = self.options.fill_holes;
                let mut made = holes.surface(&cloud, fill_holes, |now| run.update(now))?;
                if has_sizing {
                    self.sizing = made.attributes.vertex.pop();
                }
                made
            }
            SurfaceSource::Volume { volume, args, closed } => {
                if self.options.fill_holes.is_some() {
                    return Err(Error::usage("--fill-holes does not work with volumes", "use --closed"));
                }
                let made = args.surface(&volume, closed, |now| run.update(now))?;
                rim = Some(made.rim);
                made.loaded
            }
        };
        if self.options.method == Method::CoarseToFine {
            let method = &mut self.options.coarse_to_fine;
            if !self.method.names_feature_angle() {
                method.feature_angle = 180.0;
            }
            if let Some(rim) = rim {
                method.fixed_half_edges = rim;
                method.may_give_up_fixed = true;
            }
        }
        std::mem::take(&mut made.notes).into_iter().for_each(|note| notes.add(note));
        notes.mention(&format!("the surface took {:.2} s", begin.elapsed().as_secs_f64()));
        Ok(Surface { loaded: Cow::Owned(made), wrapped: inside })
    }

    /// A surface around a mesh, by the repairs asked for, which are made then.
    fn wrapped(
        &mut self,
        mut loaded: Loaded,
        detail: Length,
        run: &mut RunProgress,
    ) -> Result<(Loaded, WrappedInput)> {
        self.method.refuse_with_wrapping(self.size)?;
        let has_sizing = self.sizing.is_some();
        loaded.attributes.vertex.extend(self.sizing.take());
        let repairs = self.options.repairs();
        let Around { mut made, repaired, detail } =
            wrapped(&loaded, (detail, repairs), |now| run.update(now))?;
        if has_sizing {
            self.sizing = made.attributes.vertex.pop();
        }
        if self.size == Size::AsInput {
            self.size = Size::EdgeLength(detail);
            if self.options.shortage == Shortage::BestEffort {
                self.options.shortage = Shortage::AddVertices;
            }
        }
        self.options.set_repairs(RepairOptions::default());
        Ok((made, WrappedInput { mesh: loaded.mesh, repaired }))
    }
}

impl SurfaceSource<'_> {
    /// The attributes of vertices that are known before a surface is made.
    fn vertex_attributes(&self) -> &[Attribute] {
        match self {
            Self::Mesh(loaded) => &loaded.attributes.vertex,
            Self::Points { cloud, .. } => &cloud.attributes.vertex,
            Self::Volume { .. } => &[],
        }
    }
}

/// The attributes among which `--sizing` looks up its values: `own` alone, if it is given.
fn sizing_among<'a>(own: Option<&'a Attribute>, of_mesh: &'a [Attribute]) -> &'a [Attribute] {
    own.map_or(of_mesh, std::slice::from_ref)
}

fn in_file(error: Error, file: Option<&Path>) -> Error {
    match file {
        Some(file) => error.in_file(file),
        None => error,
    }
}
