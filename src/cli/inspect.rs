//! `rtfmesh inspect`.

use super::files::{InputFormat, input_name};
use super::heading::{FEATURES, OUTPUT, SIZE};
use super::points;
use super::table;
use super::target_count::vertex_count;
use super::terminal::print;
use super::volume;
use crate::error::shown;
use crate::grammar::counted;
use anyhow::Result;
use rtfmesh::io;
use rtfmesh::io::{Input, Loaded, Volume};
use rtfmesh::mesh::features::{
    Curve, CurveKind, Discarded, FeatureOptions, Features, find_features, spacing_of, user_edges,
};
use rtfmesh::mesh::repair::{RepairCounts, repair};
use rtfmesh::mesh::topology::{Topology, topology};
use rtfmesh::report::{figures, to_json};
use rtfmesh::{Error, FeatureLines, TriMesh};
use serde::Serialize;
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  rtfmesh inspect fandisk.ply -n 10k --curves curves.obj
  rtfmesh inspect points.xyz
  rtfmesh inspect fandisk.ply --feature-angle 20 --json";

/// Describe a mesh (topology, repairs, features), points (spacing, noise, outliers) or a volume (range).
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Mesh, points or volume to inspect; - is standard input
    mesh: PathBuf,
    /// Number of vertices to remesh to, such as 10k [default: the mesh's]
    ///
    /// Curves too short for that are discarded.
    #[arg(short = 'n', long, value_name = "N", value_parser = vertex_count, help_heading = SIZE)]
    vertices: Option<usize>,
    /// Edges sharper than this angle are features; 180 disables
    #[arg(long, value_name = "DEGREES", default_value_t = FeatureOptions::FEATURE_ANGLE,
        help_heading = FEATURES)]
    feature_angle: f64,
    /// OBJ file with polylines along input edges, which also become curves
    #[arg(long, value_name = "FILE.obj", help_heading = FEATURES)]
    features: Option<PathBuf>,
    #[command(flatten)]
    input_format: InputFormat,
    /// Write the curves as lines and the corners as points
    #[arg(long, value_name = "OUT.obj", help_heading = OUTPUT)]
    curves: Option<PathBuf>,
    /// Print JSON
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

/// What is printed.
#[derive(Serialize)]
pub(super) struct Inspection<'a> {
    notes: &'a [String],
    attributes: Vec<String>,
    repairs: RepairCounts,
    topology: Topology,
    /// In the mesh's units squared.
    area: f64,
    feature_angle: f64,
    /// Edge length of an even mesh of the asked number of vertices, in the mesh's units, as all lengths.
    spacing: f64,
    patches: usize,
    corners: usize,
    curves: Vec<Kind>,
    discarded: Discarded,
}

#[derive(Serialize)]
struct Kind {
    kind: &'static str,
    curves: usize,
    loops: usize,
    edges: usize,
    length: f64,
}

/// Reads, inspects, writes and prints.
pub fn run(args: &Args) -> Result<()> {
    if args.vertices == Some(0) {
        return Err(Error::usage("-n must be at least 1", "use the number of vertices that you want").into());
    }
    if let Some(path) = &args.curves {
        let read = [Some(&args.mesh), args.features.as_ref()];
        if read.into_iter().flatten().any(|input| super::remesh::same_file(path, input)) {
            let problem = format!("--curves would overwrite the input {}", shown(path));
            return Err(Error::usage(problem, "use another file name").into());
        }
        io::check_text_target(path)?;
    }
    let name = input_name(&args.mesh);
    let loaded = match args.input_format.load_any(&args.mesh, false)? {
        Input::Volume(volume) => return print_volume(args, &volume),
        Input::Mesh(loaded) if loaded.mesh.triangles.is_empty() => return print_points(args, loaded),
        Input::Mesh(loaded) => loaded,
    };
    let lines = args.features.as_deref().map(FeatureLines::read).transpose()?;
    let (inspection, mesh, found) =
        inspect(&loaded, args.vertices, args.feature_angle, lines.as_ref()).map_err(|e| e.in_file(name))?;
    if let Some(path) = &args.curves {
        io::write_features(path, &mesh, &found)?;
    }
    print(&if args.json { to_json(&inspection)? } else { table::two_columns(rows(&inspection)) })
}

/// Prints what can be said of points.
fn print_points(args: &Args, loaded: Loaded) -> Result<()> {
    refuse_options_of_meshes(args, "points without faces")?;
    let found = points::Inspection::new(loaded).map_err(|e| e.in_file(input_name(&args.mesh)))?;
    print(&if args.json { to_json(&found)? } else { table::two_columns(found.rows()) })
}

/// Prints what can be said of values on a grid.
fn print_volume(args: &Args, volume: &Volume) -> Result<()> {
    refuse_options_of_meshes(args, "values on a grid")?;
    let found = volume::Inspection::new(volume);
    print(&if args.json { to_json(&found)? } else { table::two_columns(found.rows()) })
}

fn refuse_options_of_meshes(args: &Args, what: &str) -> rtfmesh::Result<()> {
    let given = [
        ("-n", args.vertices.is_some()),
        ("--features", args.features.is_some()),
        ("--curves", args.curves.is_some()),
    ];
    let Some((name, _)) = given.iter().find(|(_, given)| *given) else { return Ok(()) };
    let input = shown(input_name(&args.mesh));
    let problem = format!("{name} works only with meshes, and {input} has {what}");
    Err(Error::usage(problem, "remove it"))
}

/// Inspects a mesh for a result with this many vertices. Also returns the repaired mesh and its features.
///
/// # Errors
/// [`Error::Usage`] for what is out of range, [`Error::Input`] for a mesh without area or lines that are not
/// along its edges.
pub(super) fn inspect<'a>(
    loaded: &'a Loaded,
    vertices: Option<usize>,
    feature_angle: f64,
    lines: Option<&FeatureLines>,
) -> rtfmesh::Result<(Inspection<'a>, TriMesh, Features)> {
    let repaired = repair(&loaded.mesh)?;
    let mesh = repaired.mesh;
    let spacing = spacing_of(&mesh, vertices.unwrap_or(mesh.vertices.len()))?;
    let user_edges = match lines {
        None => Vec::new(),
        Some(FeatureLines { file: Some(file), lines, .. }) => {
            user_edges(&mesh, lines).map_err(|e| e.in_file(file))?
        }
        Some(FeatureLines { lines, .. }) => user_edges(&mesh, lines)?,
    };
    let options = FeatureOptions { feature_angle, user_edges, ..FeatureOptions::new(spacing) };
    let found = find_features(&mesh, &options)?;
    let inspection = Inspection {
        notes: &loaded.notes,
        attributes: loaded.attributes.listed(),
        repairs: repaired.counts,
        topology: topology(&mesh),
        area: mesh.area(),
        feature_angle,
        spacing,
        patches: found.patch_count,
        corners: found.corners.len(),
        curves: kinds(&found),
        discarded: found.discarded,
    };
    Ok((inspection, mesh, found))
}

fn kinds(found: &Features) -> Vec<Kind> {
    let kind = |(kind, curves): (CurveKind, Vec<&Curve>)| Kind {
        kind: kind.name(),
        curves: curves.len(),
        loops: curves.iter().filter(|curve| curve.closed).count(),
        edges: curves.iter().map(|curve| curve.edges()).sum(),
        length: curves.iter().map(|curve| curve.length).sum(),
    };
    found.curves_by_kind().map(kind).collect()
}

fn rows(i: &Inspection) -> Vec<(&'static str, String)> {
    let (t, r) = (&i.topology, &i.repairs);
    let mut rows = vec![
        ("vertices, faces", format!("{}, {}", t.vertices, t.faces)),
        ("area, spacing", format!("{:.6}, {:.6}", i.area, i.spacing)),
        ("components, boundary loops", format!("{}, {}", t.components, t.boundary_loops)),
        ("Euler characteristic, genus", {
            format!("{}, {}", t.euler, t.genus.map_or_else(|| "-".to_owned(), |g| g.to_string()))
        }),
        ("non-manifold edges, vertices", format!("{}, {}", t.nonmanifold_edges, t.nonmanifold_vertices)),
        ("inconsistent edges", t.inconsistent_edges.to_string()),
        (
            "welded, unused vertices",
            format!("{}, {}", r.duplicate_vertices_welded, r.unreferenced_vertices_removed),
        ),
        (
            "triangles without area, duplicates",
            format!("{}, {}", r.degenerate_faces_removed, r.repeated_faces()),
        ),
        (
            "flipped triangles, non-orientable parts",
            format!("{}, {}", r.faces_turned, r.unorientable_components),
        ),
        ("patches, corners", format!("{}, {}", i.patches, i.corners)),
    ];
    for k in &i.curves {
        let (loops, edges) = (counted(k.loops, ["loop", "loops"]), counted(k.edges, ["edge", "edges"]));
        let text = format!("{} ({loops}), {edges}, length {:.6}", k.curves, k.length);
        rows.push(("curves", format!("{:12} {text}", k.kind)));
    }
    rows.extend(figures::discarded_rows(&i.discarded));
    rows.extend(i.attributes.iter().map(|attribute| ("attribute", attribute.clone())));
    rows.extend(i.notes.iter().map(|note| ("note", note.clone())));
    rows
}
