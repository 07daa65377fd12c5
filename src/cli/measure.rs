//! `rtfmesh measure`.

use super::{print, table};
use anyhow::Result;
use rtfmesh::measure::measure;
use rtfmesh::mesh::io;
use rtfmesh::report::to_json;
use std::path::PathBuf;

/// Measure a mesh: triangle quality, valences, topology, and distances to a reference.
///
/// Example: rtfmesh measure kitten-10k.ply --against kitten.ply
#[derive(clap::Args)]
pub struct Args {
    /// Mesh to measure: .obj or .ply
    mesh: PathBuf,
    /// Mesh to measure distances to, in percent of its bounding box's diagonal
    #[arg(long, value_name = "REFERENCE")]
    against: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Measures and prints.
pub fn run(args: &Args) -> Result<()> {
    let mesh = io::read(&args.mesh)?.mesh;
    let reference = args.against.as_ref().map(|path| io::read(path)).transpose()?.map(|loaded| loaded.mesh);
    let measures = measure(&mesh, reference.as_ref()).map_err(|e| e.in_file(&args.mesh))?;
    print(&if args.json { to_json(&measures)? } else { table::measures(&measures) })
}
