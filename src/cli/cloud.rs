//! Points in place of a mesh: the surface that is made of them.

use super::files::input_name;
use super::heading::INPUT;
use super::job::SurfaceSource;
use crate::error::shown;
use crate::grammar::counted;
use clap::ValueEnum;
use rtfmesh::cloud::{
    CloudSurface, PointCloud, SurfaceKind, SurfaceOptions, oriented_normals, surface_with_progress,
};
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::{Attribute, Attributes, Kind, Role};
use rtfmesh::{Error, Flow, Length, Options, Progress, Result, Size, TriMesh, WarningCode};
use std::borrow::Cow;
use std::path::Path;

/// Cells at least this many times as wide as the distance between points are worth a note.
const COARSE: f64 = 2.0;

/// Which holes of a surface through points are closed.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = INPUT)]
pub struct HoleArgs {
    /// Points: close all holes of the surface; volumes: close it at the border
    #[arg(long, conflicts_with = "fill_holes", hide_short_help = true)]
    closed: bool,
    /// Points: what they show
    #[arg(long, value_name = "KIND", default_value = "auto", hide_short_help = true)]
    points_as: PointsAs,
}

/// What points are of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum PointsAs {
    /// A terrain if they look like one or are classified as ground, else an object
    #[default]
    Auto,
    /// Ground and roofs seen from above (along z), without trees, cars and noise
    Terrain,
    /// Any object, with a surface through all points
    Object,
}

impl HoleArgs {
    /// As the options of these names say, `points_as` in its words.
    ///
    /// # Errors
    /// [`Error::Usage`] for a word that cannot be read.
    pub fn from_words(closed: bool, points_as: &str) -> Result<Self> {
        let points_as = PointsAs::from_str(points_as, false).map_err(|_| {
            Error::usage(format!("--points-as: unknown kind {points_as}"), "use auto, terrain or object")
        })?;
        Ok(Self { closed, points_as })
    }

    /// What was loaded as a mesh, or as points if it has no faces.
    pub fn source(&self, loaded: Loaded) -> SurfaceSource<'_> {
        match loaded.mesh.triangles.is_empty() {
            true => SurfaceSource::Points { cloud: PointCloud::from(loaded), holes: self },
            false => SurfaceSource::Mesh(Cow::Owned(loaded)),
        }
    }

    fn options(&self, cloud: &PointCloud, fill_holes: Option<Length>) -> Result<SurfaceOptions> {
        let holes = match fill_holes {
            _ if self.closed => f64::INFINITY,
            Some(Length::Units(length)) => length,
            Some(Length::OfDiagonal(share)) if share >= 1.0 => f64::INFINITY,
            Some(Length::OfDiagonal(share)) => {
                let points = TriMesh { vertices: cloud.points.clone(), triangles: Vec::new() };
                points.bounds().map_or(0.0, |[low, high]| share * high.distance(low))
            }
            _ => 0.0,
        };
        let kind = match self.points_as {
            PointsAs::Auto => SurfaceKind::Automatic,
            PointsAs::Terrain => SurfaceKind::Terrain,
            PointsAs::Object => SurfaceKind::Object,
        };
        let options = SurfaceOptions::default().fill_holes(holes).kind(kind);
        options.validate().map(|()| options)
    }

    /// A surface through points, with holes filled up to this size, and with what became of them as notes.
    ///
    /// # Errors
    /// Those of [`surface_with_progress`]; [`Error::Usage`] if all holes are to be closed and some as well.
    pub fn surface(
        &self,
        cloud: &PointCloud,
        fill_holes: Option<Length>,
        progress: impl FnMut(Progress) -> Flow,
    ) -> Result<Loaded> {
        if self.closed && fill_holes.is_some() {
            return Err(Error::usage("--closed and --fill-holes exclude each other", "remove one of them"));
        }
        let found = surface_with_progress(cloud, &self.options(cloud, fill_holes)?, progress)?;
        let (notes, warnings) = (surface_notes(cloud, &found), surface_warnings(cloud, &found));
        Ok(Loaded { mesh: found.mesh, attributes: found.attributes, notes, warnings, unread_images: 0 })
    }
}

/// How a surface is made of points.
#[derive(clap::Args)]
#[command(next_help_heading = INPUT)]
pub struct CloudArgs {
    #[command(flatten)]
    holes: HoleArgs,
    /// Points: write them with outward normals, instead of a mesh
    #[arg(long, conflicts_with_all = ["closed", "fill_holes", "dry_run", "report", "html"],
        hide_short_help = true)]
    normals_only: bool,
}

impl CloudArgs {
    /// Whether the surface is closed, for volumes.
    ///
    /// # Errors
    /// [`Error::Usage`] for options of points alone.
    pub fn closes_volume(&self, input: &Path) -> Result<bool> {
        let given =
            [("--points-as", self.holes.points_as != PointsAs::Auto), ("--normals-only", self.normals_only)];
        let Some((name, _)) = given.iter().find(|(_, given)| *given) else { return Ok(self.holes.closed) };
        let input = shown(input_name(input));
        Err(Error::usage(format!("{name} works only with points, and {input} is a volume"), "remove it"))
    }

    /// Whether points with normals are written, in place of a mesh.
    pub fn normals_only(&self) -> bool {
        self.normals_only
    }

    /// The points with outward normals.
    ///
    /// # Errors
    /// Those of [`oriented_normals`]; [`Error::Input`] for a mesh.
    pub fn with_normals(&self, loaded: Loaded, input: &Path) -> Result<(TriMesh, Attributes)> {
        self.refuse_mesh(&loaded, input)?;
        let cloud = PointCloud::from(loaded);
        let normals = oriented_normals(&cloud).map_err(|e| e.in_file(input_name(input)))?;
        let values = normals.iter().flat_map(|normal| normal.to_array()).collect();
        let mut attributes = cloud.attributes;
        attributes.vertex.insert(0, Attribute::new("normal", Role::Normal, Kind::F64, 3, values));
        Ok((TriMesh { vertices: cloud.points, triangles: Vec::new() }, attributes))
    }

    fn refuse_mesh(&self, loaded: &Loaded, input: &Path) -> Result<()> {
        let given = [
            ("--closed", self.holes.closed),
            ("--points-as", self.holes.points_as != PointsAs::Auto),
            ("--normals-only", self.normals_only),
        ];
        let given = given.iter().find(|(_, given)| *given && !loaded.mesh.triangles.is_empty());
        let Some((name, _)) = given else { return Ok(()) };
        let problem = format!("{name} works only with points, and {} has faces", shown(input_name(input)));
        let remedy = if *name == "--closed" { "use --fill-holes 100%" } else { "remove it" };
        Err(Error::usage(problem, remedy))
    }

    /// Same as [`HoleArgs::source`].
    ///
    /// # Errors
    /// [`Error::Usage`] for options of points with a mesh.
    pub fn source(&self, loaded: Loaded, input: &Path) -> Result<SurfaceSource<'_>> {
        self.refuse_mesh(&loaded, input)?;
        Ok(self.holes.source(loaded))
    }
}

/// The size asked for, of points: ratios are of their number, and without a size there are as many vertices.
pub fn size_by_points(size: Size, points: usize, options: &Options) -> Size {
    let is_free = options.coarse_to_fine.sizing.deviation().is_some();
    match size {
        Size::AsInput if !is_free => Size::Vertices(points),
        Size::Ratio(share) => Size::Vertices((share * points as f64).round() as usize),
        size => size,
    }
}

/// What the user must know of the surface.
fn surface_warnings(cloud: &PointCloud, found: &CloudSurface) -> Vec<(WarningCode, String)> {
    let mut warnings = Vec::new();
    if found.normals_disagree {
        let text = "neighbouring points have opposite normals, so all normals were computed from the points; \
            give outward normals, or none";
        warnings.push((WarningCode::Normals, text.to_owned()));
    }
    if found.unused > 0 {
        let all = cloud.points.len();
        let text = format!(
            "the surface goes through {} of {all} points, to finish early: give more time for all of them",
            all - found.unused
        );
        warnings.push((WarningCode::CutShort, text));
    }
    warnings
}

/// What became of the points.
fn surface_notes(cloud: &PointCloud, found: &CloudSurface) -> Vec<String> {
    let kind = if found.is_terrain { "a terrain seen from above" } else { "a surface" };
    let mut notes = vec![format!(
        "a point cloud ({}, spacing {:.3e}): {kind} of {} was made from it",
        counted(cloud.points.len(), ["point", "points"]),
        found.spacing,
        counted(found.mesh.triangles.len(), ["triangle", "triangles"])
    )];
    let points = ["point was left out", "points were left out"];
    let left_out = [
        (found.duplicates, points, "a duplicate"),
        (found.outliers, points, "far from all others"),
        (
            found.small_parts,
            ["part of the surface was left out", "parts of the surface were left out"],
            "too small for a surface",
        ),
        (
            found.other_classes,
            points,
            "of a class that is neither ground nor building (--points-as object keeps all points)",
        ),
        (
            found.off_terrain,
            points,
            "above or below the terrain, such as trees and walls (--points-as object keeps all points)",
        ),
    ];
    let left_out = left_out.into_iter().filter(|(n, ..)| *n > 0);
    notes.extend(left_out.map(|(n, noun, why)| format!("{}: {why}", counted(n, noun))));
    if found.filled > 0 {
        notes.push(counted(
            found.filled,
            ["hole of the surface was closed", "holes of the surface were closed"],
        ));
    }
    if found.handles > 0 {
        let words = ["small handle of the surface was removed", "small handles of the surface were removed"];
        notes.push(counted(found.handles, words));
    }
    if found.cell > COARSE * found.spacing {
        notes.push(format!(
            "details smaller than {:.3e} are lost, although the points are closer together",
            found.cell
        ));
    }
    notes
}
