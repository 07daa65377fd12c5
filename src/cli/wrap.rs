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
    /// input, which may be any triangles. Sheets become half as thick as this, and concave edges below 75°
    /// are rounded.
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
#[command(after_help = EXAMPLES, after_long_help = EXAMPLES, mut_args(for_wrapping))]
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

/// Options of `remesh` that are refused here, or are for points and volumes.
const HIDDEN: [&str; 15] = [
    "wrap",
    "ratio",
    "symmetric",
    "features",
    "keep_boundary",
    "keep",
    "only",
    "closed",
    "points_as",
    "normals_only",
    "iso",
    "labels",
    "inside",
    "spacing",
    "keep_specks",
];

/// An argument of `remesh` as it is here.
fn for_wrapping(arg: clap::Arg) -> clap::Arg {
    let text = match arg.get_id().as_str() {
        "input" => "Mesh to wrap; - is standard input",
        "vertices" => "Number of vertices, such as 5000, 10k or 1.5M [default: by the detail]",
        "feature_angle" => "Keep edges sharper than this angle; 180 disables [default: 180]",
        name if HIDDEN.contains(&name) => return arg.hide(true),
        _ => return arg,
    };
    let details = arg.get_long_help().map(|long| long.to_string());
    let details = details.as_deref().and_then(|long| long.split_once("\n\n")).map(|(_, details)| details);
    let long = details.map(|details| format!("{text}\n\n{details}"));
    arg.help(text).long_help(long.unwrap_or_else(|| text.to_owned()))
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
    let Loaded { mesh, attributes, warnings, .. } = loaded;
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
    let made = Loaded { mesh: found.mesh, attributes, notes, warnings: warnings.clone(), unread_images: 0 };
    Ok(Around { made, repaired: found.repaired, detail: found.detail })
}
