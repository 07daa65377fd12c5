//! `rtfmesh wrap`, and the wrapping that every run can begin with.

use super::heading::INPUT;
use super::remesh;
use super::sizing::length;
use anyhow::Result;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::transfer;
use rtfmesh::mesh::correspondence::find_correspondence;
use rtfmesh::mesh::repair::{RepairOptions, Repaired};
use rtfmesh::wrap::{WrapOptions, wrap_with_progress};
use rtfmesh::{Error, Flow, Length, Progress, ProgressToken, Size};

const EXAMPLES: &str = "Examples:
  rtfmesh wrap soup.obj closed.ply -n 20k --detail 1%
  rtfmesh wrap scan.ply closed.ply -n 20k --fill-holes 100%";

/// What is wrapped.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
#[command(next_help_heading = INPUT)]
pub struct WrapArgs {
    /// Remesh one closed surface around the outside; gaps below this are closed
    ///
    /// In input units or as % of the diagonal. The surface runs where a ball of this diameter rolls over the
    /// input, which may be any triangles. Sheets become half as thick as this, and concave edges are rounded
    /// by half of it. `rtfmesh wrap` does the same.
    #[arg(long, value_name = "LENGTH", value_parser = length, hide_short_help = true,
        conflicts_with_all = ["keep_boundary", "keep", "only", "features"])]
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
/// inside vanishes: shells, hidden parts, overlaps. The result is closed and manifold, and no triangles of it
/// intersect. The same as `remesh --wrap`, with all its options.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = EXAMPLES, mut_arg("wrap", |arg| arg.hide(true)))]
pub struct Args {
    /// Diameter of the ball, in input units or as % of the diagonal
    ///
    /// Gaps below this are closed, and sheets become half as thick.
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "1%",
        conflicts_with_all = ["wrap", "keep_boundary", "keep", "only", "features"])]
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
    args.remesh.wrap_at(WrapArgs { wrap: Some(args.detail) });
    remesh::run(&args.remesh)
}

/// A surface around what was loaded, with its attributes, and what it is around.
///
/// # Errors
/// Those of [`wrap_with_progress`].
pub fn wrapped(
    loaded: &Loaded,
    (detail, repairs): (Length, RepairOptions),
    progress: impl FnMut(Progress) -> Flow,
) -> rtfmesh::Result<(Loaded, Repaired)> {
    let options = WrapOptions::default().detail(detail).repairs(repairs);
    let found = wrap_with_progress(&loaded.mesh, &options, progress)?;
    let Loaded { mesh, attributes, .. } = loaded;
    let request = attributes.required_correspondence();
    let token = ProgressToken::default();
    let correspondence = find_correspondence(mesh, &found.repaired, &found.mesh, request, &token)?;
    let attributes = transfer(attributes, mesh, &correspondence, &found.mesh);
    let note = format!(
        "wrapped at a detail of {:.4}: {:.1} % of the surface's vertices lie on the input",
        found.detail,
        100.0 * found.on_input
    );
    let notes = vec![note];
    let made = Loaded { mesh: found.mesh, attributes, notes, warnings: Vec::new(), unread_images: 0 };
    Ok((made, found.repaired))
}

/// The size, which is that of edges as long as the detail where none was asked for.
pub fn size_by_detail(size: Size, detail: Length) -> Size {
    match (size, detail) {
        (Size::AsInput, Length::Units(length)) => Size::EdgeLength(length),
        (Size::AsInput, Length::OfDiagonal(share)) => Size::RelativeEdgeLength(share),
        (size, _) => size,
    }
}
