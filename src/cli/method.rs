//! What the commands that remesh have in common: the settings of the method, and the device.

use super::all_at_once::ResearchArgs;
use super::heading::{DEVICE, FEATURES, SHAPE, SIZE};
use super::progress::{RunProgress, patience};
use super::refine::refinements;
use super::repair::RepairArgs;
use super::selection::{Selection, kept, selection};
use super::sizing::SizingArgs;
use super::wrap::WrapArgs;
use crate::grammar::counted;
use rtfmesh::glam::DVec3;
use rtfmesh::io::{Input, Loaded, Reader};
use rtfmesh::mesh::attributes::Attribute;
use rtfmesh::options::Centroid;
use rtfmesh::{
    Device, DeviceOptions, Error, FeatureLines, MeasureDepth, Method, Options, Quality, Refinement, Shortage,
    Size, Symmetry,
};
use std::path::{Path, PathBuf};

/// How to remesh: what everybody may want to set. [`ResearchArgs`] has the rest.
#[derive(clap::Args)]
pub struct MethodArgs {
    /// Speed or quality [default: normal]
    #[arg(long, value_enum, help_heading = SHAPE)]
    quality: Option<QualityName>,
    /// Keep vertices exactly on the input surface
    ///
    /// By default they may leave it slightly, because triangles then fit the surface better.
    #[arg(long, help_heading = SHAPE, hide_short_help = true)]
    no_fit: bool,
    /// Make the result its own mirror image along x, y, z or auto, the best of these
    ///
    /// The input must be symmetric within 0.1 % of the diagonal, about the middle of its bounding box. One
    /// half is remeshed and mirrored, so there may be a vertex more or fewer than asked for, or several if
    /// there are very few, which a note says.
    #[arg(long, value_enum, value_name = "AXIS", help_heading = SHAPE, hide_short_help = true,
        conflicts_with_all = ["features", "points", "keep_boundary", "keep", "only", "refine",
            "max_deviation"])]
    symmetric: Option<AxisName>,
    /// Improve triangles with an angle below this, 0 to 40; 0 disables [default: 30]
    ///
    /// Local edits do it, at the same number of vertices. Obtuse triangles on sharp edges and boundaries are
    /// improved as well. Sharp corners of the input keep their angles.
    #[arg(long, value_name = "DEGREES", help_heading = SHAPE, hide_short_help = true)]
    min_angle: Option<f64>,
    /// Remesh everything by local operations on the CPU
    ///
    /// Local operations are edge splits, collapses and flips. By default they remesh only the components for
    /// which the Voronoi method fails.
    #[arg(long, help_heading = SHAPE, hide_short_help = true)]
    local: bool,
    /// Maximum iterations at full resolution [default: by --quality: 5, 10 or 80]
    ///
    /// Presets other than default run 160 iterations, mps none.
    #[arg(long, value_name = "COUNT", help_heading = SHAPE, hide_short_help = true)]
    iterations: Option<u32>,
    /// Stop when the mean step is below this many edge lengths [default: 1e-4]
    ///
    /// The mean is the root mean square over all vertices.
    #[arg(long, value_name = "STEP", help_heading = SHAPE, hide_short_help = true)]
    tolerance: Option<f64>,
    /// Seed of the random start [default: 1]
    ///
    /// The same seed, options, device and input give the same bytes.
    #[arg(long, help_heading = SHAPE, hide_short_help = true)]
    seed: Option<u64>,
    /// Keep edges sharper than this angle; 180 disables [default: 40]
    ///
    /// The angle is the one by which the surface turns. Boundaries and edges with more than two triangles are
    /// always kept.
    #[arg(long, value_name = "DEGREES", help_heading = FEATURES)]
    feature_angle: Option<f64>,
    /// Also keep the polylines in this OBJ file; they must follow input edges
    #[arg(long, value_name = "FILE.obj", help_heading = FEATURES, hide_short_help = true)]
    features: Option<PathBuf>,
    /// Make vertices of the points in this file, exactly
    ///
    /// In any format that can be read; of a mesh, its vertices count. A point farther from the surface than
    /// 0.01 % of the diagonal becomes the nearest point of it, with a warning; one farther than 5 % is left
    /// out.
    #[arg(long, value_name = "FILE", help_heading = FEATURES, conflicts_with = "local",
        hide_short_help = true)]
    points: Option<PathBuf>,
    /// Keep the vertices and edges of boundaries exactly, so that neighbouring tiles still match
    #[arg(long, help_heading = FEATURES, conflicts_with_all = ["local", "smooth_boundary", "fill_holes",
        "outer"], hide_short_help = true)]
    keep_boundary: bool,
    /// Keep these triangles untouched, and join the rest to them: label:NAME or selection:NAME
    ///
    /// A label, group or material of triangles, or an attribute of triangles or vertices that is not 0 on
    /// them. May be given several times. The number of vertices is that of the whole result.
    #[arg(long, value_name = "WHAT", value_parser = selection, help_heading = FEATURES,
        conflicts_with_all = ["local", "smooth_boundary", "smooth_spikes", "fill_holes", "outer",
        "max_deviation"],
        hide_short_help = true)]
    keep: Vec<Selection>,
    /// Remesh only these triangles, and keep all others untouched; WHAT as for --keep
    #[arg(long, value_name = "WHAT", value_parser = selection, help_heading = FEATURES,
        conflicts_with_all = ["keep", "local", "smooth_boundary", "smooth_spikes", "fill_holes",
        "outer", "max_deviation"],
        hide_short_help = true)]
    only: Vec<Selection>,
    #[command(flatten)]
    sizing: SizingArgs,
    #[command(flatten)]
    repairs: RepairArgs,
    /// What is wrapped before it is remeshed.
    #[command(flatten)]
    pub wrap: WrapArgs,
    /// Add vertices if N is too small for a valid mesh
    #[arg(long, conflicts_with = "strict", help_heading = SIZE, hide_short_help = true)]
    vertices_at_least: bool,
    /// Fail if the result has a fault, such as a lost part or a new self-intersection
    ///
    /// By default rtfmesh writes its best mesh and warns.
    #[arg(long, help_heading = SIZE, hide_short_help = true)]
    strict: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum QualityName {
    /// Fast
    Draft,
    /// For most uses
    Normal,
    /// Slow, with the most even triangles
    Best,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum AxisName {
    X,
    Y,
    Z,
    Auto,
}

impl From<AxisName> for Symmetry {
    fn from(axis: AxisName) -> Self {
        match axis {
            AxisName::X => Self::X,
            AxisName::Y => Self::Y,
            AxisName::Z => Self::Z,
            AxisName::Auto => Self::Automatic,
        }
    }
}

/// Options that do nothing, or cannot be kept, where lengths depend on the direction.
const NOT_STRETCHED: [&str; 8] = [
    "--min-angle",
    "--local",
    "--points",
    "--keep-boundary",
    "--keep",
    "--only",
    "--vertices-at-least",
    "--refine",
];

impl MethodArgs {
    /// Refuses an option that would do nothing: nobody would notice.
    fn refuse_idle(&self, research: &ResearchArgs, options: &Options) -> rtfmesh::Result<()> {
        let given = [
            ("--quality", self.quality.is_some()),
            ("--no-fit", self.no_fit),
            ("--min-angle", self.min_angle.is_some()),
            ("--local", self.local),
            ("--feature-angle", self.feature_angle.is_some()),
            ("--features", self.features.is_some()),
            ("--points", self.points.is_some()),
            ("--keep-boundary", self.keep_boundary),
            ("--keep", !self.keep.is_empty()),
            ("--only", !self.only.is_empty()),
            ("--symmetric", self.symmetric.is_some()),
            ("--vertices-at-least", self.vertices_at_least),
            ("--sizing", self.sizing.differs()),
            ("--refine", !self.sizing.refine().is_empty()),
        ];
        let coarse = options.method == Method::CoarseToFine;
        // Tangent faces can be weighted.
        let may_size = options.has_weights() && self.sizing.suits_weights();
        let works = |name: &str| coarse || (may_size && name == "--sizing");
        let idle = given.iter().copied().find(|(name, given)| *given && !works(name));
        let idle = idle.map(|(name, _)| (name.to_owned(), ("preset default", "--preset default")));
        let setting = || {
            let (name, needs) = research.idle_setting(options)?;
            Some((format!("--{}", name.replace('_', "-")), needs.words()))
        };
        if self.sizing.is_anisotropic()
            && let Some((name, _)) = given.iter().find(|(name, given)| *given && NOT_STRETCHED.contains(name))
        {
            let problem = format!("{name} does not go together with --sizing anisotropic");
            return Err(Error::usage(problem, "remove one of them"));
        }
        let Some((name, (with, add))) = idle.or_else(setting) else { return Ok(()) };
        Err(Error::usage(format!("{name} works only with {with}"), format!("remove it, or use {add}")))
    }

    /// The options for results of this size; if their vertex count is not known yet, with one that is always
    /// valid. Files are read by [`MethodArgs::read_files`].
    ///
    /// # Errors
    /// [`Error::Usage`] for what is out of range or does not go together.
    pub fn options(
        &self,
        research: &ResearchArgs,
        size: Size,
        measures: MeasureDepth,
    ) -> rtfmesh::Result<Options> {
        let vertices = if let Size::Vertices(count) = size { count } else { 4 };
        let faces = if let Size::Faces(count) = size { Some(count) } else { None };
        let quality = match self.quality {
            Some(QualityName::Draft) => Quality::Draft,
            Some(QualityName::Normal) | None => Quality::Normal,
            Some(QualityName::Best) => Quality::Best,
        };
        let mut base = research.preset.options(vertices, quality);
        if base.method == Method::AllAtOnce {
            research.put(&mut base.all_at_once);
        }
        self.refuse_idle(research, &base)?;
        let mut options = base.measures(measures).faces(faces);
        let put = |value: Option<f64>, field: &mut f64| *field = value.unwrap_or(*field);
        options.iterations = self.iterations.unwrap_or(options.iterations);
        put(self.tolerance, &mut options.tolerance);
        options.set_repairs(self.repairs.options());
        options.seed = self.seed.unwrap_or(options.seed);
        let coarse = &mut options.coarse_to_fine;
        coarse.fit &= !self.no_fit;
        coarse.local = self.local;
        coarse.keep_boundary = self.keep_boundary;
        coarse.symmetric = self.symmetric.map(Into::into);
        put(self.min_angle, &mut coarse.min_angle);
        put(self.feature_angle, &mut coarse.feature_angle);
        options.shortage = match (self.vertices_at_least, self.strict) {
            (true, _) => Shortage::AddVertices,
            (false, true) => Shortage::Refuse,
            (false, false) => Shortage::BestEffort,
        };
        self.sizing.put(&mut options)?;
        if options.is_weighted() && !research.names_centroid() {
            // The mean of corners is too rough for edges to follow lengths closely.
            options.all_at_once.centroid = Centroid::Area;
        }
        options.validate()?;
        Ok(options)
    }

    /// Refuses what a wrapped surface cannot have: the input's triangles, lines and symmetry, and a share of
    /// its vertices.
    ///
    /// # Errors
    /// [`Error::Usage`] with the option.
    pub fn refuse_with_wrapping(&self, size: Size) -> rtfmesh::Result<()> {
        let given = [
            ("--keep-boundary", self.keep_boundary),
            ("--keep", !self.keep.is_empty()),
            ("--only", !self.only.is_empty()),
            ("--features", self.features.is_some()),
            ("--symmetric", self.symmetric.is_some()),
            ("--ratio", matches!(size, Size::Ratio(_))),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((name, _)) => {
                Err(Error::usage(format!("{name} does not work with wrapped surfaces"), "remove it"))
            }
            None => Ok(()),
        }
    }

    /// The numbers that edge lengths are in proportion to, one for each vertex, if `--sizing` names an
    /// attribute: from the one of these that has its name.
    ///
    /// # Errors
    /// [`Error::Input`] for an attribute that is not there.
    pub fn sizing_values<'a>(&self, vertex: &'a [Attribute]) -> rtfmesh::Result<Option<&'a [f64]>> {
        self.sizing.values(vertex)
    }

    /// The file of `--points`.
    pub fn points(&self) -> Option<&Path> {
        self.points.as_deref()
    }

    /// The regions of `--refine` on a mesh.
    ///
    /// # Errors
    /// [`Error::Usage`] for a label that it has not.
    pub fn refinements(&self, loaded: &Loaded) -> rtfmesh::Result<Vec<Refinement>> {
        refinements(self.sizing.refine(), loaded)
    }

    /// The triangles of a mesh that `--keep` and `--only` keep.
    ///
    /// # Errors
    /// [`Error::Usage`] for a label or an attribute that it has not.
    pub fn kept(&self, loaded: &Loaded) -> rtfmesh::Result<Vec<u32>> {
        kept(&self.keep, &self.only, loaded)
    }

    /// Whether the least angle of sharp edges is given.
    pub fn names_feature_angle(&self) -> bool {
        self.feature_angle.is_some()
    }

    /// The file of `--features`.
    pub fn features(&self) -> Option<&Path> {
        self.features.as_deref()
    }

    /// Puts what is in the files of `--features` and `--points` into the options, once all else is known to
    /// be right. The time limit and Ctrl-C end that.
    ///
    /// # Errors
    /// [`Error::Input`] for a file without lines or points, and those of [`Reading::wait`].
    pub fn read_files(&self, run: &RunProgress, options: &mut Options) -> rtfmesh::Result<()> {
        if let Some(path) = &self.features {
            let file = path.clone();
            let lines = run.begin_reading(move || FeatureLines::read(file)).wait(path)?;
            options.coarse_to_fine.features = Some(lines);
        }
        if let Some(path) = &self.points {
            let file = path.clone();
            options.coarse_to_fine.points = run.begin_reading(move || read_points(&file)).wait(path)?;
        }
        Ok(())
    }
}

/// The points of a file.
fn read_points(path: &Path) -> rtfmesh::Result<Vec<DVec3>> {
    let read = Reader::new().patience(patience()).read_any(path);
    let loaded = read.and_then(Input::mesh_or_points).map_err(|error| error.in_file(path))?;
    if loaded.mesh.vertices.is_empty() {
        let error = Error::input(None, "there are no points", "give a file with a point in each line");
        return Err(error.in_file(path));
    }
    Ok(loaded.mesh.vertices)
}

/// The device to remesh on.
#[derive(clap::Args)]
pub struct DeviceArgs {
    /// Device: index, cpu, gpu or part of its name [default: the best GPU, else the CPU]
    ///
    /// Also uuid:4f3f9d26-... or pci:0000:41:00.0. `rtfmesh devices` lists the devices. The environment
    /// variable RTFMESH_DEVICE does the same. A device that fails the self-test is only used if it is named.
    #[arg(long, value_name = "DEVICE", help_heading = DEVICE)]
    device: Option<String>,

    /// Maximum device memory in MiB [default: all]
    ///
    /// A run that needs more is refused before it starts.
    #[arg(long, value_name = "MIB", help_heading = DEVICE, hide_short_help = true,
        value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    device_memory: Option<u64>,
}

impl DeviceArgs {
    /// Opens the device asked for, here or in the environment; with `timings` it times its kernels.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none.
    pub fn open(&self, timings: bool) -> rtfmesh::Result<Device> {
        let mut wish = DeviceOptions::from_env().timings(timings);
        if self.device.is_some() {
            wish.device.clone_from(&self.device);
        }
        wish.memory_bytes = self.device_memory.map(|mebibytes| mebibytes << 20);
        Device::open(&wish)
    }
}

/// A run under validation must not cause any message.
///
/// # Errors
/// [`Error::Internal`] with the first one.
pub fn refuse_messages(device: &Device) -> rtfmesh::Result<()> {
    let messages = device.take_validation_messages();
    match messages.first() {
        Some(first) => {
            let found = counted(messages.len(), ["validation message", "validation messages"]);
            Err(Error::Internal(format!("{found}, the first: {first}")))
        }
        None => Ok(()),
    }
}
