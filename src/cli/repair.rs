//! `rtfmesh repair`, and the repairs that every run can make.

use super::files::{InputFormat, Target, input_name, tell_notes};
use super::heading::{INPUT, OUTPUT};
use super::progress;
use super::progress::{RunProgress, begin_writing};
use super::sizing::length;
use super::table::two_columns;
use super::terminal::tell;
use crate::mesh::repair::repair_with_progress;
use anyhow::Result;
use clap::ArgAction;
use rtfmesh::io::{Encoding, Loaded};
use rtfmesh::mesh::attributes::{Attributes, transfer};
use rtfmesh::mesh::correspondence::find_correspondence;
use rtfmesh::mesh::intersections::intersecting_faces;
use rtfmesh::mesh::repair::{RepairOptions, Repaired};
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Length, ProgressToken};
use std::path::PathBuf;

const EXAMPLES: &str = "Examples:
  rtfmesh repair scan.ply closed.ply --fill-holes 100% --smooth-spikes --outer
  rtfmesh repair part.stl part.ply --weld 1e-5 --fill-holes 5% --min-component 0.01";

/// Repairs beyond exact duplicates, and how far they may go.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
#[command(next_help_heading = INPUT)]
pub struct RepairArgs {
    /// Weld vertices closer than this fraction of the diagonal [default: 0]
    ///
    /// This closes cracks. The diagonal is that of the input's bounding box.
    #[arg(long, value_name = "FRACTION", hide_short_help = true)]
    weld: Option<f64>,
    /// Remove components below this fraction of the input's area [default: 0]
    #[arg(long, value_name = "FRACTION", hide_short_help = true)]
    min_component: Option<f64>,
    /// Smooth ragged boundaries by at most this fraction of the diagonal [default: 0]
    #[arg(long, value_name = "FRACTION", hide_short_help = true)]
    smooth_boundary: Option<f64>,
    /// Fill holes up to this size across, in input units or as % of the diagonal
    ///
    /// 100% fills all. A patch follows the surface around its hole.
    #[arg(long, value_name = "LENGTH", value_parser = length, hide_short_help = true)]
    fill_holes: Option<Length>,
    /// Smooth spikes: single vertices that stick out like needles
    ///
    /// They may stick into the surface, too. All angles around one sum to less than 90 degrees, as at the tip
    /// of a cone of 29 degrees. It goes to where the surface around it bends least.
    #[arg(long, hide_short_help = true)]
    smooth_spikes: bool,
    /// Remove components inside closed ones, such as inner shells and hidden parts
    ///
    /// Components that intersect the one around them stay.
    #[arg(long, hide_short_help = true)]
    outer: bool,
}

impl RepairArgs {
    /// The repairs asked for.
    pub fn options(&self) -> RepairOptions {
        let given = |share: Option<f64>| share.unwrap_or(0.0);
        let mut options = RepairOptions::default()
            .weld(given(self.weld))
            .min_component(given(self.min_component))
            .smooth_boundary(given(self.smooth_boundary))
            .smooth_spikes(self.smooth_spikes)
            .outer(self.outer);
        options.fill_holes = self.fill_holes;
        options
    }
}

/// Repair a mesh without remeshing it: duplicates, cracks, turned faces, holes
///
/// Duplicate vertices and faces, faces without an area and cracks within rounding always go, and faces that
/// disagree with their neighbours are turned. All else stays as it is, vertex by vertex, with its attributes.
/// `remesh` makes the same repairs.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, disable_help_flag = true)]
pub struct Args {
    /// Mesh to repair; - is standard input
    input: PathBuf,
    /// Mesh to write; - is standard output
    output: PathBuf,
    #[command(flatten)]
    repairs: RepairArgs,
    #[command(flatten)]
    input_format: InputFormat,
    /// Output format, regardless of the extension
    ///
    /// One of obj, ply, stl, off, glb, mesh, vtp, vtu, vtk and 3mf, each also with .gz.
    #[arg(long, value_name = "FORMAT", help_heading = OUTPUT)]
    format: Option<Encoding>,
    /// Do not print what the result is
    #[arg(long, short, help_heading = OUTPUT)]
    quiet: bool,
    /// Print help: -h the common options, --help all
    #[arg(long, short, action = ArgAction::Help, help_heading = OUTPUT)]
    help: Option<bool>,
}

/// Repairs and writes, then says what was done and what is left.
pub fn run(args: &Args) -> Result<()> {
    let options = args.repairs.options();
    options.validate()?;
    let target = Target::new(&args.output, args.format)?;
    let run = RunProgress::with_limit(None);
    progress::handle_interrupts()?;
    let (format, path) = (args.input_format.clone(), args.input.clone());
    let name = input_name(&args.input);
    let loaded = run.begin_reading(move || format.load(&path)).wait(name)?;
    let (repaired, attributes, intersecting) = run.work(|token| {
        let repaired =
            repair_with_progress(&loaded.mesh, &options, token).map_err(|error| error.in_file(name))?;
        let attributes = carried(&loaded, &repaired, token)?;
        let intersecting = intersecting_faces(&repaired.mesh, token)?;
        Ok((repaired, attributes, intersecting.len()))
    })?;
    let writing = begin_writing()?;
    target.write(&repaired.mesh, &attributes, args.quiet)?;
    drop(writing);
    if !args.quiet {
        tell_notes(&args.input, &loaded.notes);
        tell_notes(&args.input, &repaired.counts.notes());
        tell(&two_columns(rows(&repaired, intersecting)));
    }
    for (_, warning) in &loaded.warnings {
        tell(&format!("warning: {warning}\n"));
    }
    Ok(())
}

/// The input's attributes for the repaired mesh.
fn carried(loaded: &Loaded, repaired: &Repaired, progress: &ProgressToken) -> rtfmesh::Result<Attributes> {
    let Loaded { mesh, attributes, .. } = loaded;
    let request = attributes.required_correspondence();
    let found = find_correspondence(mesh, repaired, &repaired.mesh, request, progress)?;
    Ok(transfer(attributes, mesh, &found, &repaired.mesh))
}

fn rows(repaired: &Repaired, intersecting: usize) -> Vec<(&'static str, String)> {
    let found = topology(&repaired.mesh);
    let genus = found.genus.map_or_else(|| "-".to_owned(), |genus| genus.to_string());
    vec![
        ("vertices, triangles", format!("{}, {}", found.vertices, repaired.mesh.triangles.len())),
        ("components, genus", format!("{}, {genus}", found.components)),
        ("boundary loops", found.boundary_loops.to_string()),
        ("non-manifold edges", found.nonmanifold_edges.to_string()),
        ("intersecting triangles", intersecting.to_string()),
    ]
}
