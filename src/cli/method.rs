//! What the commands that remesh have in common: the settings of the method, and the device.

use super::all_at_once::ResearchArgs;
use super::heading::{DEVICE, FEATURES, INPUT, SHAPE, SIZE};
use super::sizing::SizingArgs;
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::{
    Device, DeviceOptions, Error, Face, FeatureLines, MeasureDepth, Method, Normals, Options, Projection,
    Quality, Shortage, Size,
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
    /// By default they leave it slightly, so that the triangles fit the surface better.
    #[arg(long, help_heading = SHAPE, hide_short_help = true)]
    no_fit: bool,
    /// Mend triangles with a smaller angle by local edits [default: 30]
    ///
    /// 0 to 40; 0 mends none. Obtuse triangles on sharp edges and boundaries are mended with them. The number
    /// of vertices stays. Angles of the input's own sharp corners
    /// stay as they are.
    #[arg(long, value_name = "DEGREES", help_heading = SHAPE, hide_short_help = true)]
    min_angle: Option<f64>,
    /// Remesh by splits, collapses and flips of edges on the CPU, as is done where cells fail
    #[arg(long, help_heading = SHAPE, hide_short_help = true)]
    local: bool,
    /// Most iterations with all vertices [default: 10, or as --quality says; other presets: 160, mps: 0]
    #[arg(long, value_name = "COUNT", help_heading = SHAPE, hide_short_help = true)]
    iterations: Option<u32>,
    /// Stop when the root mean square step falls below this many edge lengths [default: 1e-4]
    #[arg(long, value_name = "STEP", help_heading = SHAPE, hide_short_help = true)]
    tolerance: Option<f64>,
    /// Seed of the random start; the same seed, options, device and input give the same bytes [default: 1]
    #[arg(long, help_heading = SHAPE, hide_short_help = true)]
    seed: Option<u64>,
    /// Keep edges that turn by at least this angle [default: 40]
    ///
    /// 180 keeps none. Boundaries and edges with more than two faces stay in any case.
    #[arg(long, value_name = "DEGREES", help_heading = FEATURES)]
    feature_angle: Option<f64>,
    /// Keep the lines in this OBJ file as well, which run along edges of the input
    #[arg(long, value_name = "FILE.obj", help_heading = FEATURES, hide_short_help = true)]
    features: Option<PathBuf>,
    #[command(flatten)]
    sizing: SizingArgs,
    /// Weld vertices closer than this share of the bounding box's diagonal, and close cracks [default: 0]
    #[arg(long, value_name = "SHARE", help_heading = INPUT, hide_short_help = true)]
    weld: Option<f64>,
    /// Drop components with less than this share of the input's area [default: 0]
    #[arg(long, value_name = "SHARE", help_heading = INPUT, hide_short_help = true)]
    min_component: Option<f64>,
    /// Make ragged boundaries smooth; none moves by more than this share of the diagonal [default: 0]
    #[arg(long, value_name = "SHARE", help_heading = INPUT, hide_short_help = true)]
    smooth_boundary: Option<f64>,
    /// Add vertices if the number asked for is too small for a valid mesh (preset default)
    #[arg(long, conflicts_with = "strict", help_heading = SIZE, hide_short_help = true)]
    vertices_at_least: bool,
    /// Fail if parts of the surface would be lost or faces intersect that did not in the input
    ///
    /// By default the best mesh there is is written, with a warning.
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

/// What an option needs, in words, and what to add to have it.
type With = (&'static str, &'static str);

impl MethodArgs {
    /// Refuses an option that would do nothing: nobody would notice.
    fn refuse_foreign(&self, research: &ResearchArgs, options: &Options) -> rtfmesh::Result<()> {
        const DEFAULT: With = ("preset default", "--preset default");
        const AT_ONCE: With = ("presets other than default", "--preset rtf");
        const PLANES: With = ("tangent and power cells (presets rtf, rpf, rvc)", "--preset rtf");
        const FIT: With = ("--normals fit (presets rtf, rpf)", "--preset rtf");
        const NEAR: With =
            ("--projection nearest-vertices or --normals cloud (presets rtf, rpf, rvc)", "--preset rtf");
        const POWER: With = ("--face power (preset rpf)", "--preset rpf");
        const EXACT: With = ("--face exact (presets rvd, cvd)", "--preset cvd");
        const LLOYD: With = ("--face exact without momentum (preset rvd)", "--preset rvd");
        let coarse = options.method == Method::CoarseToFine;
        let exact = !coarse && options.all_at_once.face == Face::Exact;
        let power = !coarse && options.all_at_once.face == Face::Power;
        let planes = !coarse && !exact;
        let near = options.all_at_once.projection == Projection::NearestVertices
            || options.all_at_once.normals == Normals::Cloud;
        let (all, in_planes) = research.given();
        let given = [
            ("--quality", DEFAULT, coarse, self.quality.is_some()),
            ("--no-fit", DEFAULT, coarse, self.no_fit),
            ("--min-angle", DEFAULT, coarse, self.min_angle.is_some()),
            ("--local", DEFAULT, coarse, self.local),
            ("--feature-angle", DEFAULT, coarse, self.feature_angle.is_some()),
            ("--features", DEFAULT, coarse, self.features.is_some()),
            ("--vertices-at-least", DEFAULT, coarse, self.vertices_at_least),
            ("--sizing", DEFAULT, coarse, self.sizing.differs()),
            ("--centroid", PLANES, planes, research.centroid.is_some()),
            (
                "--k-normal",
                FIT,
                planes && options.all_at_once.normals == Normals::Fit,
                research.k_normal.is_some(),
            ),
            ("--k-clip", PLANES, planes, research.k_clip.is_some()),
            ("--k-project", NEAR, planes && near, research.k_project.is_some()),
            ("--offset", POWER, power, research.offset.is_some()),
            ("--momentum", EXACT, exact, research.momentum.is_some()),
            ("--lbfgs", LLOYD, exact, research.lbfgs.is_some()),
        ];
        let chosen = all.map(|(name, given)| (name, AT_ONCE, !coarse, given)).into_iter();
        let chosen = chosen.chain(in_planes.map(|(name, given)| (name, PLANES, planes, given)));
        let foreign = given.into_iter().chain(chosen).find(|(_, _, of_use, given)| *given && !of_use);
        let Some((name, (with, add), ..)) = foreign else { return Ok(()) };
        Err(Error::usage(format!("{name} works only with {with}"), format!("leave it out, or add {add}")))
    }

    /// The options for results of this size; if their vertex count is not known yet, with one that is always
    /// valid. Feature lines are read by [`MethodArgs::read_features`].
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
        let quality = match self.quality {
            Some(QualityName::Draft) => Quality::Draft,
            Some(QualityName::Normal) | None => Quality::Normal,
            Some(QualityName::Best) => Quality::Best,
        };
        let mut base = research.preset.options(vertices, quality);
        if base.method == Method::AllAtOnce {
            research.put(&mut base.all_at_once);
        }
        self.refuse_foreign(research, &base)?;
        let mut options = base.measures(measures);
        let put = |value: Option<f64>, field: &mut f64| *field = value.unwrap_or(*field);
        options.iterations = self.iterations.unwrap_or(options.iterations);
        put(self.tolerance, &mut options.tolerance);
        put(self.weld, &mut options.weld);
        put(self.min_component, &mut options.min_component);
        put(self.smooth_boundary, &mut options.smooth_boundary);
        options.seed = self.seed.unwrap_or(options.seed);
        let coarse = &mut options.coarse_to_fine;
        coarse.fit &= !self.no_fit;
        coarse.local = self.local;
        put(self.min_angle, &mut coarse.min_angle);
        put(self.feature_angle, &mut coarse.feature_angle);
        options.shortage = match (self.vertices_at_least, self.strict) {
            (true, _) => Shortage::AddVertices,
            (false, true) => Shortage::Refuse,
            (false, false) => Shortage::BestEffort,
        };
        self.sizing.put(&mut options)?;
        options.validate()?;
        Ok(options)
    }

    /// Takes what the options say of the input's attributes.
    ///
    /// # Errors
    /// [`Error::Input`] for an attribute that is not there.
    pub fn read_attributes(&self, attributes: &Attributes, options: &mut Options) -> rtfmesh::Result<()> {
        self.sizing.read(attributes, options)
    }

    /// Whether the least angle of sharp edges is given.
    pub fn names_feature_angle(&self) -> bool {
        self.feature_angle.is_some()
    }

    /// The file of `--features`.
    pub fn features(&self) -> Option<&Path> {
        self.features.as_deref()
    }

    /// Reads it, once the other options are known to be right.
    ///
    /// # Errors
    /// [`Error::Input`] if it has no lines.
    pub fn read_features(&self) -> rtfmesh::Result<Option<FeatureLines>> {
        let Some(path) = &self.features else { return Ok(None) };
        FeatureLines::read(path).map(Some)
    }
}

/// The device to remesh on.
#[derive(clap::Args)]
pub struct DeviceArgs {
    /// Index, cpu, gpu or part of a name [default: the best GPU, else the CPU]
    ///
    /// Also uuid:4f3f9d26-... or pci:0000:41:00.0. `rtfmesh devices` lists them; the environment variable
    /// RTFMESH_DEVICE does the same.
    #[arg(long, value_name = "DEVICE", help_heading = DEVICE)]
    device: Option<String>,

    /// Most device memory to use, in MiB [default: all]
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
            Err(Error::Internal(format!("{} validation messages, the first: {first}", messages.len())))
        }
        None => Ok(()),
    }
}
