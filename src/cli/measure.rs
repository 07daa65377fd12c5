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
    /// Measure the distances to this mesh, or to these points, as well, both ways, in percent of its bounding
    /// box's diagonal
    ///
    /// Hausdorff distances are certified: no point is farther away than the upper end of each, and some point
    /// as far as the lower end. Root mean square distances are of samples. Of points, all are measured, also
    /// outliers; distances of the mesh's samples to the nearest points are about half of the points' spacing
    /// where the mesh goes through them.
    #[arg(long, value_name = "REFERENCE")]
    against: Option<PathBuf>,
    /// Largest gap between the ends of the Hausdorff distances, relative to the upper end [default: 0.01]
    ///
    /// 1e-6 to 0.5. Gaps below 5e-7 of the diagonal are small enough in any case.
    #[arg(long, value_name = "SHARE", requires = "against")]
    accuracy: Option<f64>,
    /// Measure how evenly the vertices cover the reference as well: the integral of the squared distance to
    /// the nearest vertex
    #[arg(long, requires = "against")]
    energy: bool,
    /// Measure the distances between sharp edges and boundaries as well, both ways
    #[arg(long, requires = "against")]
    features: bool,
    /// Edges where the surface turns by at least this angle are sharp, with --features
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
        let problem = "standard input cannot be both meshes";
        return Err(Error::usage(problem, "give one of them as a file").into());
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
        let problem =
            format!("`{name}` works only against a mesh, and the reference is points without faces");
        Err(Error::usage(problem, "leave it out, or make one of the points with `cloud::surface`"))
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
