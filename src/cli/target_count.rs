//! How many vertices are wanted, on the command line.

use super::files::{input_name, tell_notes};
use rtfmesh::mesh::repair::{Repaired, repair_with};
use rtfmesh::{Options, Result, Size, TriMesh};
use std::path::Path;

/// At most one of these; none means as many vertices as the input has.
#[derive(clap::Args)]
#[group(multiple = false)]
pub struct SizeArgs {
    /// Vertices of the result, at least 4 [default: as many as the input has]
    #[arg(short = 'n', long, value_name = "N")]
    vertices: Option<usize>,
    /// Instead: the length of the result's edges in the input's units, or with % in percent of the diagonal of its
    /// bounding box
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    edge_length: Option<Size>,
    /// Instead: the result's vertices over the input's, as it is after --weld and --min-component
    #[arg(long, value_name = "SHARE")]
    ratio: Option<f64>,
}

pub(super) fn length(text: &str) -> std::result::Result<Size, String> {
    let number = |text: &str| {
        text.trim().parse::<f64>().map_err(|_| "give a length such as 0.5, or 1% of the diagonal".to_owned())
    };
    match text.strip_suffix('%') {
        Some(percent) => number(percent).map(|percent| Size::RelativeEdgeLength(0.01 * percent)),
        None => number(text).map(Size::EdgeLength),
    }
}

impl SizeArgs {
    /// What was asked for.
    ///
    /// # Errors
    /// [`rtfmesh::Error::Usage`] for what is out of range.
    pub fn size(&self) -> Result<Size> {
        let ratio = self.ratio.map(Size::Ratio);
        let size = self.vertices.map(Size::Vertices).or(self.edge_length).or(ratio).unwrap_or(Size::AsInput);
        size.validate()?;
        Ok(size)
    }
}

/// Puts the count for this input into the options, with a note where nobody asked for one. The size is that of what the run
/// will remesh, which is given where it had to be made.
///
/// # Errors
/// [`rtfmesh::Error::Usage`] for counts that cannot be, [`rtfmesh::Error::Input`] for a mesh without area.
pub fn count(
    size: Size,
    path: &Path,
    mesh: &TriMesh,
    options: &mut Options,
    quiet: bool,
) -> Result<Option<Repaired>> {
    if let Size::Vertices(count) = size {
        options.vertices = count;
        return Ok(None);
    }
    let in_file = |error: rtfmesh::Error| error.in_file(input_name(path));
    let repaired = repair_with(mesh, &options.repairs()).map_err(in_file)?;
    let count = size.vertices(&repaired.mesh).map_err(in_file)?;
    options.vertices = count;
    if size == Size::AsInput && !quiet {
        let what = "as many as it has, for want of -n, --edge-length or --ratio";
        tell_notes(path, &[format!("{count} vertices, {what}")]);
    }
    Ok(Some(repaired))
}
