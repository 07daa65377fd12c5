//! What commands do, for programs that bring the command line along in a form of their own, such as the
//! Python package: options by the same names, meshes in memory, figures as JSON.

use super::all_at_once::ResearchArgs;
use super::attributes::AttributeArgs;
use super::cloud::HoleArgs;
use super::job::{Finished, Notes, RemeshJob, Request, SurfaceSource};
use super::measure;
pub use super::measure::Wanted;
use super::method::MethodArgs;
use super::progress::{RunProgress, TimeArgs};
use super::repair::RepairArgs;
use super::target_count::SizeArgs;
use super::volume::VolumeArgs;
use super::{inspect, render};
use crate::mesh::repair::repair_with_progress;
use clap::{CommandFactory, Parser};
use glam::DVec3;
use rtfmesh::cloud::PointCloud;
use rtfmesh::io::{Loaded, Volume};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::mesh::correspondence::Correspondence;
use rtfmesh::mesh::repair::Repaired;
use rtfmesh::report::to_json;
use rtfmesh::{
    CellMesh, CorrespondenceRequest, Device, Error, FeatureLines, Flow, MeasureDepth, Options, Progress,
    ProgressToken, Remeshed, Result, TriMesh,
};
use std::borrow::Cow;

/// The options of `remesh` and `batch` that name no files but that of `--features`.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
pub struct Call {
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    attributes: AttributeArgs,
    #[command(flatten)]
    time: TimeArgs,
    #[command(flatten)]
    research: ResearchArgs,
    /// Relative width of the reported Hausdorff intervals, 1e-6 to 0.5 [default: 0.01]
    ///
    /// Relative to the upper end. Gaps below 5e-7 of the diagonal always count as converged.
    #[arg(long, value_name = "FRACTION")]
    accuracy: Option<f64>,
}

/// An option of [`Call`].
#[derive(Debug, Clone)]
pub struct CallOption {
    /// Its name, without the dashes before it.
    pub name: String,
    /// The placeholder for its value in the help; `None` if the option takes no value.
    pub value: Option<String>,
    /// All values it may have, if they are few.
    pub choices: Vec<String>,
    /// What it does, in sentences.
    pub help: String,
}

/// The name that `--sizing property:NAME` has for [`Input::sizing`].
pub const SIZING: &str = "sizing";

/// What is remeshed.
#[derive(Default)]
pub struct Input {
    /// The mesh with its attributes. Panics if these do not belong to it.
    pub loaded: Loaded,
    /// What the input is, if it is not a mesh.
    pub source: Source,
    /// With `--sizing property:sizing`, edge lengths are in proportion to these, one for each vertex.
    pub sizing: Option<Vec<f64>>,
    /// Lines to keep, unless `--features` names a file.
    pub features: Option<FeatureLines>,
    /// Points that become vertices, unless `--points` names a file.
    pub fixed_points: Vec<DVec3>,
    /// Triangles that stay as they are, unless `--keep` or `--only` names others.
    pub keep: Vec<u32>,
    /// For what to find the places on the input, in addition to what attributes need.
    pub correspondence: CorrespondenceRequest,
    /// Whether the report is to have the distances to the input.
    pub distances: bool,
    /// Whether the output has the cells of the vertices.
    pub cells: bool,
}

/// What a surface is made from before it is remeshed.
#[derive(Debug, Clone, Default)]
pub enum Source {
    /// The mesh itself.
    #[default]
    Mesh,
    /// The mesh's vertices.
    Points(Points),
    /// Values on a grid.
    Values(Box<Values>),
}

/// Values on a grid, and which surface in them is wanted.
#[derive(Debug, Clone)]
pub struct Values {
    volume: Volume,
    args: VolumeArgs,
    closed: bool,
}

impl Values {
    /// The surfaces at values `--iso`, around the side that `--inside` says, in its words; without values,
    /// the borders between labels. With `closed` it ends flat at the volume's border. Specks stay with
    /// `keep_specks`.
    ///
    /// # Errors
    /// [`Error::Usage`] for a side that does not exist.
    pub fn new(
        volume: Volume,
        iso: Vec<f64>,
        inside: Option<&str>,
        closed: bool,
        keep_specks: bool,
    ) -> Result<Self> {
        Ok(Self { volume, args: VolumeArgs::from_words(iso, inside, keep_specks)?, closed })
    }
}

/// What is known of points without faces.
#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Outward normals, one for each point and of any length; empty if there are none.
    pub normals: Vec<DVec3>,
    holes: HoleArgs,
}

impl Points {
    /// Points with these normals. `closed` and `points_as` are the values of these options, the latter in its
    /// words.
    ///
    /// # Errors
    /// [`Error::Usage`] for a word that cannot be read.
    pub fn new(normals: Vec<DVec3>, closed: bool, points_as: &str) -> Result<Self> {
        Ok(Self { normals, holes: HoleArgs::from_words(closed, points_as)? })
    }

    /// These normals with the vertices of what was loaded, and their attributes.
    fn source(&self, loaded: &Loaded) -> SurfaceSource<'_> {
        let attributes = Attributes { vertex: loaded.attributes.vertex.clone(), ..Attributes::default() };
        let (points, normals) = (loaded.mesh.vertices.clone(), self.normals.clone());
        SurfaceSource::Points { cloud: PointCloud { points, normals, attributes }, holes: &self.holes }
    }
}

/// What a run gives.
pub struct Output {
    /// The result.
    pub mesh: TriMesh,
    /// Where it lies on the input, as far as that was asked for or needed.
    pub correspondence: Option<Correspondence>,
    /// The cells of its vertices, if they were asked for.
    pub cells: Option<CellMesh>,
    /// The input's attributes for the result.
    pub attributes: Attributes,
    /// The report as JSON.
    pub report: String,
}

impl Call {
    /// Reads options as the program does: `--name` and its value, if it has one.
    ///
    /// # Errors
    /// [`Error::Usage`] in clap's words.
    pub fn parse_words(words: &[String]) -> Result<Self> {
        parsed(words)
    }

    /// All options there are.
    pub fn options() -> Vec<CallOption> {
        let text = |arg: &clap::Arg| {
            let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
            let words = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
            // First a line without a full stop, then more in sentences.
            let parts: Vec<String> = help.split("\n\n").map(words).collect();
            parts.join(". ").trim_end_matches('.').to_owned() + "."
        };
        let command = Self::command();
        let named = command.get_arguments().filter_map(|arg| arg.get_long().map(|name| (name, arg)));
        let option = |(name, arg): (&str, &clap::Arg)| CallOption {
            name: name.to_owned(),
            // What may do without one is true or false.
            value: (arg.get_action().takes_values() && !may_lack_value(arg)).then(|| {
                let names = arg.get_value_names().unwrap_or_default();
                names.first().map(ToString::to_string).unwrap_or_default()
            }),
            choices: match arg.get_action().takes_values() {
                true => arg.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect(),
                false => Vec::new(),
            },
            help: text(arg),
        };
        named.map(option).collect()
    }

    /// Remeshes.
    ///
    /// # Errors
    /// Those of [`rtfmesh::remesh_with_progress`], in which flags stand for options.
    pub fn remesh(
        &self,
        device: &Device,
        input: &Input,
        progress: impl FnMut(Progress) -> Flow,
    ) -> Result<Output> {
        let mut run = RunProgress::with_limit(self.time.time_limit).with_caller(progress);
        let (loaded, numbers) = (&input.loaded, input.sizing.as_ref());
        let sizing =
            numbers.map(|numbers| Attribute::new(SIZING, Role::Other, Kind::F64, 1, numbers.clone()));
        let (notes, source, sizing) = match &input.source {
            Source::Mesh => (loaded.notes.clone(), SurfaceSource::Mesh(Cow::Borrowed(loaded)), sizing),
            Source::Points(points) => (Vec::new(), points.source(loaded), sizing),
            Source::Values(values) => {
                let Values { volume, args, closed } = values.as_ref();
                let volume = Cow::Borrowed(volume);
                (Vec::new(), SurfaceSource::Volume { volume, args, closed: *closed }, None)
            }
        };
        let request = Request {
            method: &self.method,
            attributes: &self.attributes,
            size: self.size.size()?,
            options: self.own_options(input, &run)?,
            sizing,
            correspondence: input.correspondence,
            file: None,
        };
        let mut notes = Notes::new(notes, None);
        let mut job = RemeshJob::new(request, source, &mut notes, &mut run)?;
        let Finished { result, attributes, .. } = job.remesh(device, &mut run)?;
        let report = job.report(device, &result.summary, &notes, Default::default()).to_json()?;
        let Remeshed { mesh, correspondence, cells, .. } = result;
        Ok(Output { mesh, correspondence, cells, attributes, report })
    }

    /// The options but for what depends on the mesh, checked.
    fn own_options(&self, input: &Input, run: &RunProgress) -> Result<Options> {
        let measures = if input.distances { MeasureDepth::Full } else { MeasureDepth::Intersections };
        let mut options = self.checked_options(measures)?;
        options.cells = input.cells;
        options.coarse_to_fine.features.clone_from(&input.features);
        options.coarse_to_fine.points.clone_from(&input.fixed_points);
        options.coarse_to_fine.keep.clone_from(&input.keep);
        options.validate()?;
        self.method.read_files(run, &mut options)?;
        Ok(options)
    }

    /// Checks what can be checked without a mesh and without files.
    ///
    /// # Errors
    /// [`Error::Usage`] for options that no mesh could be remeshed with.
    pub fn check(&self) -> Result<()> {
        self.checked_options(MeasureDepth::Basic)?.repairs().validate()
    }

    fn checked_options(&self, measures: MeasureDepth) -> Result<Options> {
        let mut options = self.method.options(&self.research, self.size.size()?, measures)?;
        if let Some(accuracy) = self.accuracy {
            options.accuracy = accuracy;
        }
        self.attributes.check(options.method)?;
        options.validate()?;
        Ok(options)
    }
}

/// Whether an option needs no value.
fn may_lack_value(arg: &clap::Arg) -> bool {
    arg.get_num_args().is_some_and(|range| range.min_values() == 0)
}

/// What `measure --json` prints.
///
/// # Errors
/// Those of [`rtfmesh::measure::measure_with_progress`].
pub fn measure_json(
    mesh: &TriMesh,
    reference: Option<&TriMesh>,
    wanted: &Wanted,
    progress: &ProgressToken,
) -> Result<String> {
    to_json(&measure::find(mesh, reference, wanted, progress)?)
}

/// The mesh as `rtfmesh repair` with these options repairs it: `--name` and its value, if it has one.
///
/// # Errors
/// [`Error::Usage`] in clap's words, and those of [`rtfmesh::mesh::repair::repair_with`].
pub fn repaired(mesh: &TriMesh, words: &[String], progress: &ProgressToken) -> Result<Repaired> {
    repair_with_progress(mesh, &parsed::<RepairCall>(words)?.repairs.options(), progress)
}

#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct RepairCall {
    #[command(flatten)]
    repairs: RepairArgs,
}

/// # Errors
/// [`Error::Usage`] in clap's words.
fn parsed<T: Parser>(words: &[String]) -> Result<T> {
    T::try_parse_from(words).map_err(|error| {
        let text = error.render().to_string();
        let problem = text.strip_prefix("error: ").unwrap_or(&text);
        // Tips and the usage are in paragraphs of their own.
        let problem = problem.split("\n\n").next().unwrap_or(problem);
        let words: Vec<&str> = problem.split_whitespace().collect();
        Error::usage(words.join(" "), "see the documentation of the option")
    })
}

/// What `inspect --json` prints.
///
/// # Errors
/// Those of [`rtfmesh::mesh::features::find_features`], and [`Error::Input`] for lines that do not run along
/// edges.
pub fn inspect_json(
    loaded: &Loaded,
    vertices: Option<usize>,
    feature_angle: f64,
    lines: Option<&FeatureLines>,
) -> Result<String> {
    to_json(&inspect::inspect(loaded, vertices, feature_angle, lines)?.0)
}

/// The lines that `render --curves` draws over a mesh, by their ends.
///
/// # Errors
/// As [`inspect_json`].
pub fn curve_lines(mesh: &TriMesh) -> Result<Vec<[DVec3; 2]>> {
    render::curves(mesh)
}
