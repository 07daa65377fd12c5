//! What commands that remesh have in common on the command line: the method's settings, and the device.

use super::all_at_once::ChoiceArgs;
use super::sizing::SizingArgs;
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::{
    Centroid, Device, DeviceOptions, Error, Face, FeatureLines, MeasureDepth, Method, Normals, Options,
    Projection, Quality, Shortage, Size,
};
use std::path::{Path, PathBuf};

/// How to remesh.
#[derive(clap::Args)]
pub struct MethodArgs {
    /// Settings to start from, each of which can also be given by itself: rtf is the paper's method with the paper's settings, rpf, rvc, rvd, cvd and mps are
    /// those of others that it compares with
    #[arg(long, value_enum, default_value_t = Preset::Default)]
    preset: Preset,
    /// Time against triangles [preset default: normal]
    #[arg(long, value_enum)]
    quality: Option<QualityName>,
    /// Faces tangent and power: where a site moves in its face: the mean of the corners, close ones counting less, or the centroid
    /// of the area [preset rtf: vertex]
    #[arg(long, value_enum)]
    centroid: Option<CentroidName>,
    #[command(flatten)]
    choices: ChoiceArgs,
    /// With --normals fit: sites in a normal's plane fit, the site included [preset rtf: 16]
    #[arg(long, value_name = "K")]
    k_normal: Option<u32>,
    /// Faces tangent and power: nearest sites that clip a cell [preset rtf: 32]
    #[arg(long, value_name = "K")]
    k_clip: Option<u32>,
    /// With --projection nearest-vertices: input vertices whose triangles a site is projected onto; with --normals cloud:
    /// points that its plane fits [presets: 16]
    #[arg(long, value_name = "K")]
    k_project: Option<u32>,
    /// With --face power: distance of the shadow sites from their sites, in edge lengths [preset rpf: 0.5]
    #[arg(long, value_name = "LENGTHS")]
    offset: Option<f64>,
    /// With --face exact: largest share of the last motion that is added to a step [preset rvd: 0, cvd: 0.9]
    #[arg(long, value_name = "SHARE")]
    momentum: Option<f64>,
    /// With --face exact and no momentum: L-BFGS in place of Lloyd's iteration, with so many motions remembered, such as 7:
    /// a lower energy after as many iterations [presets: 0, which is Lloyd's]
    #[arg(long, value_name = "MOTIONS")]
    lbfgs: Option<u32>,
    /// Most iterations, with all vertices [default: 10, or what --quality says; other presets: 160, mps: 0]
    #[arg(long, value_name = "COUNT")]
    iterations: Option<u32>,
    /// Stop when the root mean square step is below this many edge lengths [default: 1e-4]
    #[arg(long, value_name = "STEP")]
    tolerance: Option<f64>,
    /// Keep every vertex on the input surface; else they leave it by a little, so that the faces fit it better
    #[arg(long)]
    no_fit: bool,
    /// Edges where the surface turns by at least this angle are sharp and stay; 180: none [default: 40]
    #[arg(long, value_name = "DEGREES")]
    feature_angle: Option<f64>,
    /// OBJ file with lines along edges of the input that stay as well
    #[arg(long, value_name = "FILE.obj")]
    features: Option<PathBuf>,
    /// Weld vertices of the input closer than this share of its bounding box's diagonal, and close cracks [default: 0]
    #[arg(long, value_name = "SHARE")]
    weld: Option<f64>,
    /// Drop components of the input with less than this share of its area [default: 0]
    #[arg(long, value_name = "SHARE")]
    min_component: Option<f64>,
    /// If the vertices do not suffice for a valid mesh, add as many as it takes (preset default)
    #[arg(long, conflicts_with = "best_effort")]
    vertices_at_least: bool,
    /// If the vertices do not suffice for a valid mesh, write what there is, with a warning; else it is an error (preset
    /// default; the others always write what there is)
    #[arg(long)]
    best_effort: bool,
    /// Seed of the random start [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    #[command(flatten)]
    sizing: SizingArgs,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Preset {
    /// Coarse to fine: fast, even triangles
    Default,
    /// Restricted tangent faces as in the paper
    Rtf,
    /// Restricted power faces, otherwise as rtf
    Rpf,
    /// Cells on planes that best fit the input's points, as if it were a point cloud, otherwise as rtf
    Rvc,
    /// Exact restricted Voronoi cells and Lloyd's iteration
    Rvd,
    /// The same with momentum
    Cvd,
    /// Random points that keep a distance and leave no gaps, connected as they are
    Mps,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum QualityName {
    /// Quick
    Draft,
    /// For most uses
    Normal,
    /// As even as it gets
    Best,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum CentroidName {
    /// Mean of the face's corners, close ones counting less (Eq. 7)
    Vertex,
    /// Centroid of the face's area (Eq. 3)
    Area,
}

/// What an option goes with, in words, and what to add so that it does.
type With = (&'static str, &'static str);

impl MethodArgs {
    /// An option that another one leaves nothing to do for would do nothing, and nobody would notice.
    fn refuse_foreign(&self, options: &Options) -> rtfmesh::Result<()> {
        const DEFAULT: With = ("preset default", "--preset default");
        const AT_ONCE: With = ("all presets but default", "--preset rtf");
        const PLANES: With = ("faces tangent and power, as of presets rtf, rpf, rvc,", "--preset rtf");
        const FIT: With = ("--normals fit, as of presets rtf and rpf,", "--preset rtf");
        const NEAR: With = ("nearest vertices and clouds, as of presets rtf, rpf, rvc,", "--preset rtf");
        const POWER: With = ("--face power, as of preset rpf,", "--preset rpf");
        const EXACT: With = ("--face exact, as of presets rvd and cvd,", "--preset cvd");
        const LLOYD: With = ("--face exact without momentum, as of preset rvd,", "--preset rvd");
        let coarse = options.method == Method::CoarseToFine;
        let exact = !coarse && options.all_at_once.face == Face::Exact;
        let power = !coarse && options.all_at_once.face == Face::Power;
        let planes = !coarse && !exact;
        let near = options.all_at_once.projection == Projection::NearestVertices
            || options.all_at_once.normals == Normals::Cloud;
        let (all, in_planes) = self.choices.given();
        let given = [
            ("--quality", DEFAULT, coarse, self.quality.is_some()),
            ("--no-fit", DEFAULT, coarse, self.no_fit),
            ("--feature-angle", DEFAULT, coarse, self.feature_angle.is_some()),
            ("--features", DEFAULT, coarse, self.features.is_some()),
            ("--vertices-at-least", DEFAULT, coarse, self.vertices_at_least),
            ("--best-effort", DEFAULT, coarse, self.best_effort),
            ("--sizing", DEFAULT, coarse, self.sizing.differs()),
            ("--centroid", PLANES, planes, self.centroid.is_some()),
            (
                "--k-normal",
                FIT,
                planes && options.all_at_once.normals == Normals::Fit,
                self.k_normal.is_some(),
            ),
            ("--k-clip", PLANES, planes, self.k_clip.is_some()),
            ("--k-project", NEAR, planes && near, self.k_project.is_some()),
            ("--offset", POWER, power, self.offset.is_some()),
            ("--momentum", EXACT, exact, self.momentum.is_some()),
            ("--lbfgs", LLOYD, exact, self.lbfgs.is_some()),
        ];
        let chosen = all.map(|(name, given)| (name, AT_ONCE, !coarse, given)).into_iter();
        let chosen = chosen.chain(in_planes.map(|(name, given)| (name, PLANES, planes, given)));
        let foreign = given.into_iter().chain(chosen).find(|(_, _, of_use, given)| *given && !of_use);
        let Some((name, (with, add), ..)) = foreign else { return Ok(()) };
        Err(Error::usage(
            format!("{name} is an option of {with} alone"),
            format!("leave it out, or add {add}"),
        ))
    }

    /// The settings for meshes of this size; without a known count, for one that is always possible. Lines are read by
    /// [`MethodArgs::read_features`].
    ///
    /// # Errors
    /// [`Error::Usage`] for what is out of range or does not go together.
    pub fn options(&self, size: Size, measures: MeasureDepth) -> rtfmesh::Result<Options> {
        let vertices = if let Size::Vertices(count) = size { count } else { 4 };
        let quality = match self.quality {
            Some(QualityName::Draft) => Quality::Draft,
            Some(QualityName::Normal) | None => Quality::Normal,
            Some(QualityName::Best) => Quality::Best,
        };
        let base = match self.preset {
            Preset::Default => Options::with_quality(vertices, quality),
            Preset::Rtf => Options::rtf(vertices),
            Preset::Rpf => Options::rpf(vertices),
            Preset::Rvc => Options::rvc(vertices),
            Preset::Rvd => Options::rvd(vertices),
            Preset::Cvd => Options::cvd(vertices),
            Preset::Mps => Options::mps(vertices),
        };
        let coarse = base.method == Method::CoarseToFine;
        let mut base = base;
        if !coarse {
            self.choices.put(&mut base.all_at_once);
        }
        self.refuse_foreign(&base)?;
        let mut options = base.measures(measures);
        let set = |value: Option<u32>, field: &mut u32| *field = value.unwrap_or(*field);
        let put = |value: Option<f64>, field: &mut f64| *field = value.unwrap_or(*field);
        set(self.iterations, &mut options.iterations);
        put(self.tolerance, &mut options.tolerance);
        put(self.weld, &mut options.weld);
        put(self.min_component, &mut options.min_component);
        options.seed = self.seed.unwrap_or(options.seed);
        let coarse = &mut options.coarse_to_fine;
        coarse.fit &= !self.no_fit;
        put(self.feature_angle, &mut coarse.feature_angle);
        coarse.shortage = match (self.vertices_at_least, self.best_effort) {
            (true, _) => Shortage::AddVertices,
            (false, true) => Shortage::BestEffort,
            (false, false) => Shortage::Refuse,
        };
        let at_once = &mut options.all_at_once;
        set(self.k_normal, &mut at_once.k_normal);
        set(self.k_clip, &mut at_once.k_clip);
        set(self.k_project, &mut at_once.k_project);
        set(self.lbfgs, &mut at_once.lbfgs);
        put(self.offset, &mut at_once.offset);
        put(self.momentum, &mut at_once.momentum);
        at_once.centroid = match self.centroid {
            Some(CentroidName::Vertex) => Centroid::Vertex,
            Some(CentroidName::Area) => Centroid::Area,
            None => at_once.centroid,
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

/// On what to remesh.
#[derive(clap::Args)]
pub struct DeviceArgs {
    /// Device: index, cpu, gpu or part of a name (see `rtfmesh devices`)
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,

    /// Take at most this much of the device's memory, in MiB; a run that needs more is refused before it starts
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    device_memory: Option<u64>,
}

impl DeviceArgs {
    /// Opens the device asked for, here or in the environment; with `timings` it times its kernels.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none.
    pub fn open(&self, timings: bool) -> rtfmesh::Result<Device> {
        let mut wish = DeviceOptions { timings, ..DeviceOptions::from_env() };
        if self.device.is_some() {
            wish.device.clone_from(&self.device);
        }
        wish.memory_bytes = self.device_memory.map(|mebibytes| mebibytes << 20);
        Device::open(&wish)
    }
}

/// A run under validation must not have any message.
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
