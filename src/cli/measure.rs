//! `rtfmesh measure`.

use super::files::{InputFormat, input_name, is_standard, tell_notes};
use super::heading::OUTPUT;
use super::table;
use super::terminal::print;
use anyhow::Result;
use rtfmesh::cloud::{PointDistances, point_distances};
use rtfmesh::io::Loaded;
use rtfmesh::measure::{Energy, energy};
use rtfmesh::measure::{Measures, measure_with_progress, weld};
use rtfmesh::mesh::distance::DEFAULT_ACCURACY;
use rtfmesh::mesh::feature_distance::{FeatureDistances, feature_distances};
use rtfmesh::mesh::features::FeatureOptions;
use rtfmesh::report::figures::Row;
use rtfmesh::report::{figures, to_json};
use rtfmesh::{Error, ProgressToken, TriMesh};
use serde::Serialize;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "Examples:
  rtfmesh measure kitten-10k.ply --against kitten.ply
  rtfmesh measure kitten-10k.ply --against kitten.ply --json
  rtfmesh measure part-5k.ply --against part.stl --features
  rtfmesh measure mesh.ply --against points.xyz";

/// Measure a mesh: triangle quality, topology, self-intersections, distances to a reference.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Mesh to measure; - is standard input
    mesh: PathBuf,
    /// Also measure the distances to this mesh or these points, in both directions
    ///
    /// In percent of the diagonal of its bounding box. Hausdorff distances are certified intervals; root mean
    /// square distances are sampled. Points are all measured, including outliers. The distance from a mesh to
    /// the nearest point is about half of the points' spacing, even if the mesh passes through them.
    #[arg(long, value_name = "REFERENCE")]
    against: Option<PathBuf>,
    /// Relative width of the Hausdorff intervals, 1e-6 to 0.5 [default: 0.01]
    ///
    /// Relative to the upper end. Gaps below 5e-7 of the diagonal always count as converged.
    #[arg(long, value_name = "FRACTION", requires = "against")]
    accuracy: Option<f64>,
    /// Also measure how evenly the vertices cover the reference
    ///
    /// The measure is the integral of the squared distance to the nearest vertex.
    #[arg(long, requires = "against")]
    energy: bool,
    /// Also measure the distances between sharp edges and boundaries, in both directions
    #[arg(long, requires = "against")]
    features: bool,
    /// With --features: edges sharper than this angle count
    #[arg(long, value_name = "DEGREES", default_value_t = FeatureOptions::FEATURE_ANGLE,
        requires = "features")]
    feature_angle: f64,
    #[command(flatten)]
    input_format: InputFormat,
    /// Print JSON
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

/// What is printed.
#[derive(Serialize)]
pub(super) struct Found {
    #[serde(flatten)]
    measures: Measures,
    /// To points, if they are the reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<PointDistances>,
    #[serde(skip_serializing_if = "Option::is_none")]
    energy: Option<Energy>,
    #[serde(skip_serializing_if = "Option::is_none")]
    features: Option<FeatureDistances>,
}

/// Measures and prints.
pub fn run(args: &Args) -> Result<()> {
    if is_standard(&args.mesh) && args.against.as_ref().is_some_and(|path| is_standard(path)) {
        let problem = "standard input can provide only one of the meshes";
        return Err(Error::usage(problem, "read the other from a file").into());
    }
    let mesh = with_notes(&args.mesh, args.input_format.load(&args.mesh)?);
    let reference = match &args.against {
        Some(path) => Some(with_notes(path, args.input_format.load_other_or_points(path)?)),
        None => None,
    };
    let wanted = Wanted {
        accuracy: args.accuracy,
        energy: args.energy,
        feature_angle: args.features.then_some(args.feature_angle),
    };
    let found = find(&mesh, reference.as_ref(), &wanted, &ProgressToken::default());
    let found = found.map_err(|e| e.in_file(input_name(&args.mesh)))?;
    print(&if args.json { to_json(&found)? } else { table::two_columns(rows(&found)) })
}

fn rows(found: &Found) -> Vec<Row> {
    let mut rows = figures::measures(&found.measures);
    rows.extend(found.points.iter().flat_map(figures::point_distances));
    rows.extend(found.energy.as_ref().map(figures::energy));
    rows.extend(found.features.as_ref().map(figures::features).unwrap_or_default());
    rows
}

/// What is measured besides the mesh, where there is a reference.
#[derive(Default)]
pub struct Wanted {
    /// As in [`rtfmesh::measure::measure_within`].
    pub accuracy: Option<f64>,
    /// Whether the energy is.
    pub energy: bool,
    /// The least angle of sharp edges, in degrees, if distances of features are.
    pub feature_angle: Option<f64>,
}

impl Wanted {
    /// # Errors
    /// [`Error::Usage`] for what needs faces of the reference.
    fn check_for_points(&self) -> rtfmesh::Result<()> {
        let given = [
            ("accuracy", self.accuracy.is_some()),
            ("energy", self.energy),
            ("features", self.feature_angle.is_some()),
        ];
        let Some((name, _)) = given.iter().find(|(_, given)| *given) else { return Ok(()) };
        let problem = format!("`{name}` needs a mesh as reference, and the reference has only points");
        Err(Error::usage(problem, "remove it, or make a mesh of the points with `cloud::surface`"))
    }
}

/// Measures; a reference without faces is points.
pub(super) fn find(
    mesh: &TriMesh,
    reference: Option<&TriMesh>,
    wanted: &Wanted,
    progress: &ProgressToken,
) -> rtfmesh::Result<Found> {
    let accuracy = wanted.accuracy.unwrap_or(DEFAULT_ACCURACY);
    let points = reference.filter(|reference| reference.triangles.is_empty());
    if points.is_some() {
        wanted.check_for_points()?;
    }
    let reference = reference.filter(|reference| !reference.triangles.is_empty());
    let measures = measure_with_progress(mesh, reference, accuracy, progress)?;
    let points = points.map(|points| point_distances(mesh, &points.vertices, progress));
    let energy = reference.filter(|_| wanted.energy).map(|reference| energy(reference, &mesh.vertices));
    let features = reference.zip(wanted.feature_angle).map(|(reference, angle)| {
        let [mesh, reference] = [mesh, reference].map(weld);
        feature_distances(&mesh, &reference, angle, progress)
    });
    Ok(Found {
        measures,
        points: points.transpose()?,
        energy: energy.transpose()?,
        features: features.transpose()?,
    })
}

fn with_notes(path: &Path, loaded: Loaded) -> TriMesh {
    tell_notes(path, &loaded.notes);
    loaded.mesh
}
