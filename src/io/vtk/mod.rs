//! The files of VTK and ParaView: XML (.vtp, .vtu, .vti) and the older format (.vtk), which has all kinds of
//! data under one name.
//!
//! `vtkio` 0.7 is not used, because it takes memory by the counts that a file declares. The structure of XML
//! is read with `quick-xml`.

mod array;
mod attributes;
pub(super) mod boundary;
mod cells;
mod decode;
mod image;
mod legacy;
mod legacy_data;
mod surface;
mod write;
mod xml;

pub(crate) use legacy::{parse as parse_legacy, starts as starts_legacy};
pub(crate) use write::{write_legacy, write_poly_data, write_unstructured};
pub(crate) use xml::{FileKind, kind_of};

use super::checks::{cut_off, excerpt};
use super::loaded::Loaded;
use super::read::Input;
use super::volumes::Volume;
use crate::grammar::counted;
use crate::{Error, Result};
use array::{Array, Budget, Values};
use cells::{CellSet, Corners, Kinds, Piece};
use decode::Decoder;
use xml::{Declared, DeclaredPiece, Document, Section};

/// VTK's numbers of the cells in lists of polygons and of strips.
const POLYGON: u8 = 7;
const STRIP: u8 = 6;

/// Reads a file of VTK's XML formats, whatever its name says.
pub(crate) fn parse_xml(bytes: &[u8]) -> Result<Input> {
    let document = xml::parse(bytes)?;
    let mut budget = Budget::new(bytes.len());
    let mut notes = Vec::new();
    if document.kind == FileKind::ImageData {
        return image(&document, &mut budget, notes).map(Input::Volume);
    }
    let mut pieces = Vec::new();
    let mut reader = PieceReader { document: &document, budget: &mut budget, left_out: Vec::new() };
    for declared in &document.pieces {
        pieces.push(reader.piece(declared)?);
    }
    notes.extend(note_of_left_out(&reader.left_out));
    let mut loaded = surface::surface(&pieces, &mut budget)?;
    notes.append(&mut loaded.notes);
    Ok(Input::Mesh(Loaded { notes, ..loaded }))
}

struct PieceReader<'d, 'a> {
    document: &'d Document<'a>,
    budget: &'d mut Budget,
    /// Names of arrays without numbers.
    left_out: Vec<&'d str>,
}

impl<'d, 'a> PieceReader<'d, 'a> {
    fn decode(&mut self, declared: &Declared<'a>, wanted: Option<usize>) -> Result<Array<'a>> {
        Decoder { document: self.document, budget: self.budget }.array(declared, wanted)
    }

    fn piece(&mut self, declared: &'d DeclaredPiece<'a>) -> Result<Piece<'a>> {
        let mut piece = Piece { point_count: declared.points, ..Piece::default() };
        if declared.points == 0 {
            return Ok(piece);
        }
        let missing = || cut_off("the points".to_owned(), "a piece has none");
        let points = declared.arrays.iter().find(|array| array.section == Section::Points);
        piece.points = Some(self.decode(points.ok_or_else(missing)?, declared.points.checked_mul(3))?);
        match self.document.kind {
            FileKind::UnstructuredGrid => {
                let set = self.cells(declared, Section::Cells, declared.cells)?;
                piece.cells.extend(set);
            }
            _ => {
                // Points and lines are not read, but their numbers come first.
                let [points, lines, polygons, strips] = declared.lists;
                let unread = |count| CellSet { count, kinds: Kinds::All(1), corners: None };
                piece.cells = vec![unread(points), unread(lines)];
                piece.cells.extend(self.cells(declared, Section::Polys, polygons)?);
                piece.cells.extend(self.cells(declared, Section::Strips, strips)?);
            }
        }
        let cell_count = piece.cell_count();
        piece.point_data = self.data(declared, Section::PointData, declared.points)?;
        piece.cell_data = self.data(declared, Section::CellData, cell_count)?;
        Ok(piece)
    }

    /// The arrays of a section, each with this many rows.
    fn data(
        &mut self,
        declared: &'d DeclaredPiece<'a>,
        section: Section,
        rows: usize,
    ) -> Result<Vec<Array<'a>>> {
        let mut found = Vec::new();
        for array in declared.arrays.iter().filter(|array| array.section == section && rows > 0) {
            if array.number.is_none() {
                self.left_out.push(&array.name);
                continue;
            }
            found.push(self.decode(array, Some(rows.saturating_mul(array.components)))?);
        }
        Ok(found)
    }

    /// The cells of a section; `None` if it has none.
    fn cells(
        &mut self,
        declared: &'d DeclaredPiece<'a>,
        section: Section,
        count: usize,
    ) -> Result<Option<CellSet<'a>>> {
        if count == 0 {
            return Ok(None);
        }
        let named = |name: &str| {
            let mut arrays = declared.arrays.iter();
            let found = arrays.find(|array| array.section == section && array.name == name);
            found.ok_or_else(|| cut_off("the cells".to_owned(), &format!("there is no array '{name}'")))
        };
        let corners = self.decode(named("connectivity")?, None)?.values;
        let offsets = self.decode(named("offsets")?, Some(count))?.values;
        let kinds = match section {
            Section::Polys => Kinds::All(POLYGON),
            Section::Strips => Kinds::All(STRIP),
            _ => Kinds::Each(self.decode(named("types")?, Some(count))?.values),
        };
        let corners = Some(Corners::Offsets { offsets, begins: false, corners });
        Ok(Some(CellSet { count, kinds, corners }))
    }
}

/// A note on arrays that were left out, since they have no numbers.
fn note_of_left_out(names: &[impl AsRef<str>]) -> Option<String> {
    let named = names.iter().take(8).map(AsRef::as_ref).collect::<Vec<_>>().join(", ");
    let arrays = counted(names.len(), ["array without numbers was", "arrays without numbers were"]);
    (!names.is_empty()).then(|| format!("{arrays} left out: {}", excerpt(&named)))
}

fn image(document: &Document, budget: &mut Budget, mut notes: Vec<String>) -> Result<Volume> {
    let [declared] = document.pieces.as_slice() else {
        let problem = format!("the image is in {} pieces", document.pieces.len());
        return Err(Error::input(None, problem, "write it in one piece"));
    };
    let mut grid = document.grid.clone();
    if let Some([x, to_x, y, to_y, z, to_z]) = declared.extent {
        grid.first = [x, y, z];
        grid.nodes = [to_x - x, to_y - y, to_z - z].map(|last| (last + 1).max(0) as u64);
    }
    let mut reader = PieceReader { document, budget, left_out: Vec::new() };
    let product = |lengths: [u64; 3]| {
        let product = lengths.iter().fold(1, |product: u64, length| product.saturating_mul(*length));
        usize::try_from(product).unwrap_or(usize::MAX)
    };
    let (nodes, voxels) = (grid.nodes, grid.nodes.map(|nodes| nodes.saturating_sub(1)));
    let points = reader.data(declared, Section::PointData, product(nodes))?;
    let cells = if points.is_empty() {
        reader.data(declared, Section::CellData, product(voxels))?
    } else {
        Vec::new()
    };
    notes.extend(note_of_left_out(&reader.left_out));
    image::volume(&grid, &points, &cells, notes)
}

/// Numbers without any.
fn no_values<'a>() -> Values<'a> {
    Values {
        number: crate::mesh::attributes::Kind::F64.into(),
        bytes: std::borrow::Cow::Borrowed(&[]),
        is_big_endian: false,
    }
}
