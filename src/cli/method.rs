//! What commands that remesh have in common on the command line: the method's settings, and the device.

use super::sizing::SizingArgs;
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::mesh::io;
use rtfmesh::{
    Centroid, Device, DeviceOptions, Error, Features, MeasureDepth, Method, Options, Quality, Shortage, Size,
};
use std::path::{Path, PathBuf};

/// How to remesh.
#[derive(clap::Args)]
pub struct MethodArgs {
    /// Settings to start from: rtf is the paper's method with the paper's settings, rpf, rvc, rvd, cvd and mps are
    /// those of others that it compares with
    #[arg(long, value_enum, default_value_t = Preset::Default)]
    preset: Preset,
    /// Time against triangles [preset default: normal]
    #[arg(long, value_enum)]
    quality: Option<QualityName>,
    /// Presets rtf, rpf, rvc: where a site moves in its face: the mean of the corners, close ones counted once, or the centroid
    /// of the area [preset rtf: vertex]
    #[arg(long, value_enum)]
    centroid: Option<CentroidName>,
    /// Presets rtf and rpf: sites in a normal's plane fit, the site included [preset rtf: 16]
    #[arg(long, value_name = "K")]
    k_normal: Option<u32>,
    /// Presets rtf, rpf, rvc: nearest sites that clip a cell [preset rtf: 32]
    #[arg(long, value_name = "K")]
    k_clip: Option<u32>,
    /// Presets rtf and rpf: nearest input vertices whose triangles a site is projected onto; preset rvc: those that its
    /// plane fits [presets: 16]
    #[arg(long, value_name = "K")]
    k_project: Option<u32>,
    /// Preset rpf: distance of the shadow sites from their sites, in edge lengths [preset rpf: 0.5]
    #[arg(long, value_name = "LENGTHS")]
    offset: Option<f64>,
    /// Presets rvd and cvd: largest share of the last motion that is added to a step [preset rvd: 0, cvd: 0.9]
    #[arg(long, value_name = "SHARE")]
    momentum: Option<f64>,
    /// Most iterations, with all vertices [default: 10, or what --quality says; other presets: 160]
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
    /// If the vertices do not suffice for a valid mesh, add as many as it takes
    #[arg(long, conflicts_with = "best_effort")]
    vertices_at_least: bool,
    /// If the vertices do not suffice for a valid mesh, write what there is, with a warning; else it is an error
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
    /// Cells on planes that best fit the input's vertices, as if it were a point cloud, otherwise as rtf
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
    /// Mean of the face's corners, close ones counted once (Eq. 7)
    Vertex,
    /// Centroid of the face's area (Eq. 3)
    Area,
}

/// The preset that an option of `method` is for.
fn preset_of(method: Method) -> &'static str {
    match method {
        Method::CoarseToFine => "default",
        Method::Rtf => "rtf",
        Method::PowerFaces => "rpf",
        Method::PointCloud => "rvc",
        Method::Exact => "cvd",
        Method::PoissonDisk => "mps",
    }
}

impl MethodArgs {
    /// An option of the other preset would do nothing, and nobody would notice.
    fn refuse_foreign(&self, method: Method) -> rtfmesh::Result<()> {
        const DEFAULT: &[Method] = &[Method::CoarseToFine];
        const FACES: &[Method] = &[Method::Rtf, Method::PowerFaces, Method::PointCloud];
        const TANGENT: &[Method] = &[Method::Rtf, Method::PowerFaces];
        const POWER: &[Method] = &[Method::PowerFaces];
        const EXACT: &[Method] = &[Method::Exact];
        const MOVING: &[Method] =
            &[Method::CoarseToFine, Method::Rtf, Method::PowerFaces, Method::PointCloud, Method::Exact];
        let given = [
            ("--quality", DEFAULT, self.quality.is_some()),
            ("--no-fit", DEFAULT, self.no_fit),
            ("--feature-angle", DEFAULT, self.feature_angle.is_some()),
            ("--features", DEFAULT, self.features.is_some()),
            ("--vertices-at-least", DEFAULT, self.vertices_at_least),
            ("--best-effort", DEFAULT, self.best_effort),
            ("--centroid", FACES, self.centroid.is_some()),
            ("--k-normal", TANGENT, self.k_normal.is_some()),
            ("--k-clip", FACES, self.k_clip.is_some()),
            ("--k-project", FACES, self.k_project.is_some()),
            ("--offset", POWER, self.offset.is_some()),
            ("--momentum", EXACT, self.momentum.is_some()),
            ("--iterations", MOVING, self.iterations.is_some()),
            ("--tolerance", MOVING, self.tolerance.is_some()),
        ];
        let Some((name, of, _)) = given.iter().find(|(_, of, given)| *given && !of.contains(&method)) else {
            return Ok(());
        };
        let presets: Vec<&str> = of.iter().map(|method| preset_of(*method)).collect();
        let (presets, first) = (presets.join(", "), presets[0]);
        Err(Error::usage(
            format!("{name} is an option of preset {presets} alone"),
            format!("leave it out, or add --preset {first}"),
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
        self.refuse_foreign(base.method)?;
        let mut options = Options {
            method: base.method,
            coarsest: base.coarsest,
            first_iterations: base.first_iterations,
            coarse_iterations: base.coarse_iterations,
            polish_rounds: base.polish_rounds,
            fit: base.fit && !self.no_fit,
            vertices,
            feature_angle: self.feature_angle.unwrap_or(base.feature_angle),
            // See `read_features`.
            features: base.features,
            weld: self.weld.unwrap_or(base.weld),
            min_component: self.min_component.unwrap_or(base.min_component),
            k_normal: self.k_normal.unwrap_or(base.k_normal),
            k_clip: self.k_clip.unwrap_or(base.k_clip),
            k_project: self.k_project.unwrap_or(base.k_project),
            iterations: self.iterations.unwrap_or(base.iterations),
            tolerance: self.tolerance.unwrap_or(base.tolerance),
            seed: self.seed.unwrap_or(base.seed),
            shortage: match (self.vertices_at_least, self.best_effort) {
                (true, _) => Shortage::AddVertices,
                (false, true) => Shortage::BestEffort,
                (false, false) => Shortage::Refuse,
            },
            offset: self.offset.unwrap_or(base.offset),
            momentum: self.momentum.unwrap_or(base.momentum),
            measures,
            // See `AttributeArgs::ask`.
            held_sides: base.held_sides,
            source: base.source,
            centroid: match self.centroid {
                Some(CentroidName::Vertex) => Centroid::Vertex,
                Some(CentroidName::Area) => Centroid::Area,
                None => base.centroid,
            },
            // See below.
            sizing: base.sizing,
            min_edge: base.min_edge,
            max_edge: base.max_edge,
            growth: base.growth,
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
    pub fn read_features(&self) -> rtfmesh::Result<Option<Features>> {
        let Some(path) = &self.features else { return Ok(None) };
        Ok(Some(Features { file: Some(path.clone()), lines: io::read_lines(path)? }))
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
    /// Opens the device asked for, here or in the environment.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none.
    pub fn open(&self) -> rtfmesh::Result<Device> {
        let mut wish = DeviceOptions::from_env();
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
