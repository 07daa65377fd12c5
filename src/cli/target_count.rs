//! The number of vertices, on the command line.

use super::heading::SIZE;
use super::job::Notes;
use crate::pipeline::kept::vertices_for;
use rtfmesh::mesh::repair::{Repaired, repair_with};
use rtfmesh::{Options, Result, Size, TriMesh};

/// At most one of these; without any, the result has as many vertices as the input.
#[derive(clap::Args)]
#[command(next_help_heading = SIZE)]
#[group(multiple = false)]
pub struct SizeArgs {
    /// Number of vertices, such as 5000, 10k or 1.5M [default: the input's]
    ///
    /// At least 4.
    #[arg(short = 'n', long, value_name = "N", value_parser = vertex_count)]
    vertices: Option<usize>,
    /// Number of triangles, such as 20k (instead of -n)
    ///
    /// If Euler's formula allows no mesh of so many, there are one or two fewer, and a note says so: closed
    /// surfaces have an even number of triangles.
    #[arg(long, value_name = "COUNT", value_parser = vertex_count)]
    faces: Option<usize>,
    /// Target edge length, in input units or as % of the diagonal (instead of -n)
    ///
    /// With --refine, the one outside of its parts.
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    edge_length: Option<Size>,
    /// Vertex count as a fraction of the input's (instead of -n)
    ///
    /// The input's vertices are counted after --weld and --min-component.
    #[arg(long, value_name = "FRACTION")]
    ratio: Option<f64>,
}

/// A number of vertices: digits, in groups of three or not, or a decimal number of thousands or millions.
pub(super) fn vertex_count(text: &str) -> std::result::Result<usize, String> {
    let unclear = || "give a whole number such as 5000, 10k (thousand) or 1.5M (million)".to_owned();
    let (number, zeros) = match text.char_indices().last() {
        Some((end, 'k' | 'K')) => (&text[..end], 3),
        Some((end, 'm' | 'M')) => (&text[..end], 6),
        _ => (text, 0),
    };
    // A decimal comma is none: before k and M it could be, elsewhere it parts groups of three.
    let (whole, decimals) = match number.split_once('.') {
        Some((whole, decimals)) if zeros > 0 && !decimals.is_empty() => (whole.to_owned(), decimals),
        Some(_) => return Err(unclear()),
        None if zeros > 0 => (number.to_owned(), ""),
        None => (without_groups(number).ok_or_else(unclear)?, ""),
    };
    let decimals = decimals.trim_end_matches('0');
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !are_digits(&whole) || !are_digits(decimals) || decimals.len() > zeros {
        return Err(unclear());
    }
    let digits = format!("{whole}{decimals:0<zeros$}");
    digits.parse().map_err(|_| "the number is too large; give a smaller one".to_owned())
}

/// The digits without `_` or `,` between groups of three.
fn without_groups(number: &str) -> Option<String> {
    let Some(separator) = number.chars().find(|c| matches!(c, '_' | ',')) else {
        return Some(number.to_owned());
    };
    let (first, rest) = number.split_once(separator)?;
    let grouped = (1..=3).contains(&first.len()) && rest.split(separator).all(|group| group.len() == 3);
    grouped.then(|| number.replace(separator, ""))
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
        let faces = self.faces.map(Size::Faces);
        let size = self
            .vertices
            .map(Size::Vertices)
            .or(faces)
            .or(self.edge_length)
            .or(ratio)
            .unwrap_or(Size::AsInput);
        size.validate()?;
        Ok(size)
    }
}

/// Puts the number of vertices for this input into the options; people are told where no size was given.
/// Fractions and edge lengths refer to the repaired input, which is returned where it had to be made.
///
/// # Errors
/// [`rtfmesh::Error::Usage`] for counts that cannot be, [`rtfmesh::Error::Input`] for a mesh without area.
pub fn count(size: Size, mesh: &TriMesh, options: &mut Options, notes: &Notes) -> Result<Option<Repaired>> {
    if let Size::Vertices(count) = size {
        options.vertices = count;
        return Ok(None);
    }
    if let Size::Faces(count) = size {
        options.faces = Some(count);
        return Ok(None);
    }
    if size == Size::AsInput && options.coarse_to_fine.sizing.deviation().is_some() {
        options.vertices = 0;
        return Ok(None);
    }
    let repaired = repair_with(mesh, &options.repairs())?;
    let count = vertices_for(size, &repaired, options, mesh)?;
    options.vertices = count;
    if size == Size::AsInput {
        notes.mention(&format!("no size given: keeping the input's vertex count, {count}"));
    }
    Ok(Some(repaired))
}
