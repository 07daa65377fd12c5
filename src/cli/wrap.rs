//! `rtfmesh wrap`, and the wrapping that every run can begin with.

use super::heading::{INPUT, SIZE};
use super::remesh;
use super::sizing::length;
use anyhow::Result;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::transfer;
use rtfmesh::mesh::correspondence::find_correspondence;
use rtfmesh::mesh::repair::{RepairOptions, Repaired};
use rtfmesh::wrap::{WrapOptions, wrap_with_progress};
use rtfmesh::{Error, Flow, Length, Progress, ProgressToken};

const EXAMPLES: &str = "Examples:
  rtfmesh wrap soup.obj closed.ply -n 20k --detail 1%";

/// What is wrapped.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
#[command(next_help_heading = INPUT)]
pub struct WrapArgs {
    /// Remesh one closed surface around the outside; gaps below this are closed
    ///
    /// In input units or as % of the diagonal. The surface runs where a ball of this diameter rolls over the
    /// input, which may be any triangles. Sheets become half as thick as this, and concave edges are rounded
    /// by half of it.
    #[arg(long, value_name = "LENGTH", value_parser = length, hide_short_help = true)]
    wrap: Option<Length>,
}

impl WrapArgs {
    /// The length given.
    pub fn detail(self) -> Option<Length> {
        self.wrap
    }
}

/// Wrap triangles of any kind in a closed surface, and remesh it
///
/// A ball rolls over the input from outside. Gaps that are too narrow for it are closed, and everything
/// inside vanishes: shells, hidden parts, overlaps. The surface is closed and manifold, and no triangles
/// intersect before it is remeshed. Without a size, edges are as long as the detail, with more vertices if
/// there must be. The same as `remesh --wrap`.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = EXAMPLES, mut_arg("wrap", |arg| arg.hide(true)))]
#[group(skip)]
pub struct Args {
    /// Diameter of the ball, in input units or as % of the diagonal
    ///
    /// Gaps below this are closed, and sheets become half as thick.
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "1%", help_heading = SIZE)]
    detail: Length,
    #[command(flatten)]
    remesh: remesh::Args,
}

/// Wraps, remeshes and writes. Returns the exit code.
pub fn run(mut args: Args) -> Result<u8> {
    let (Length::Units(detail) | Length::OfDiagonal(detail)) = args.detail;
    if !(detail.is_finite() && detail > 0.0) {
        let problem = format!("--detail {detail} is out of range");
        return Err(Error::usage(problem, "give a length above 0, such as 1%").into());
    }
    if args.remesh.wraps() {
        return Err(Error::usage("--wrap is what this command does", "use --detail").into());
    }
    args.remesh.wrap_at(WrapArgs { wrap: Some(args.detail) });
    remesh::run(&args.remesh)
}

/// A surface around a mesh.
pub struct Around {
    /// The surface, with the attributes of the mesh.
    pub made: Loaded,
    /// The mesh, repaired.
    pub repaired: Repaired,
    /// The detail, in the unit of the mesh.
    pub detail: f64,
}

/// A surface around what was loaded.
///
/// # Errors
/// Those of [`wrap_with_progress`].
pub fn wrapped(
    loaded: &Loaded,
    (detail, repairs): (Length, RepairOptions),
    progress: impl FnMut(Progress) -> Flow,
) -> rtfmesh::Result<Around> {
    let options = WrapOptions::default().detail(detail).repairs(repairs);
    let found = wrap_with_progress(&loaded.mesh, &options, progress)?;
    let Loaded { mesh, attributes, .. } = loaded;
    let request = attributes.required_correspondence();
    let token = ProgressToken::default();
    let correspondence = find_correspondence(mesh, &found.repaired, &found.mesh, request, &token)?;
    let attributes = transfer(attributes, mesh, &correspondence, &found.mesh);
    let diagonal = found.repaired.mesh.bounds().map_or(1.0, |[low, high]| high.distance(low));
    let mut notes = found.repaired.counts.notes();
    notes.push(format!(
        "wrapped at a detail of {:.3} % of the diagonal: {:.1} % of the surface's vertices lie on the input",
        100.0 * found.detail / diagonal,
        100.0 * found.on_input
    ));
    let made = Loaded { mesh: found.mesh, attributes, notes, warnings: Vec::new(), unread_images: 0 };
    Ok(Around { made, repaired: found.repaired, detail: found.detail })
}
