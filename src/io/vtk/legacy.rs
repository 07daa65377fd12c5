//! VTK's older format (.vtk), versions 1 to 5.1: poly data, unstructured grids and structured points, as text
//! or binary.

use glam::DVec3;

use super::array::{Array, Budget, MOST_ARRAYS, MOST_COMPONENTS, Purpose, Values};
use super::cells::{CellSet, Corners, Kinds, Piece};
use super::image::{self, Grid};
use super::legacy_data::{Cursor, known_type};
use super::{POLYGON, STRIP, no_values, note_of_left_out, surface, xml};
use crate::Result;
use crate::grammar::counted;
use crate::io::checks::{excerpt, excerpt_of_bytes};
use crate::io::loaded::Loaded;
use crate::io::read::Input;
use crate::io::text::number;

/// Whether a file begins as this format does.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    bytes.get(..22).is_some_and(|start| start.eq_ignore_ascii_case(b"# vtk DataFile Version"))
}

/// What the arrays to come belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    Nobody,
    Points(usize),
    Cells(usize),
}

/// The kinds of data that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dataset {
    PolyData,
    UnstructuredGrid,
    StructuredPoints,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    budget: Budget,
    owner: Owner,
    piece: Piece<'a>,
    /// Vertices, lines, polygons, strips; the cells of an unstructured grid stand for polygons.
    lists: [Option<CellSet<'a>>; 4],
    grid: Grid,
    notes: Vec<String>,
    /// Names of arrays without numbers.
    texts: Vec<String>,
}

/// Reads a file.
///
/// # Errors
/// [`crate::Error::Input`] with the line or byte.
pub(crate) fn parse(bytes: &[u8]) -> Result<Input> {
    let mut cursor = Cursor { bytes, at: 0, is_binary: false };
    let first = cursor.line().unwrap_or_default();
    if !starts(first) {
        let problem = "the file does not begin with '# vtk DataFile Version'".to_owned();
        return Err(cursor.error(problem, "give a VTK file, or set the format"));
    }
    // A title.
    cursor.line();
    let form = cursor.required_word("ASCII or BINARY")?;
    let is_binary = form.eq_ignore_ascii_case(b"BINARY");
    if !is_binary && !form.eq_ignore_ascii_case(b"ASCII") {
        let problem = format!("'{}' is neither ASCII nor BINARY", excerpt_of_bytes(form));
        return Err(cursor.error(problem, "repair the header"));
    }
    cursor.is_binary = is_binary;
    let mut reader = Reader {
        cursor,
        budget: Budget::new(bytes.len()),
        owner: Owner::Nobody,
        piece: Piece::default(),
        lists: [const { None }; 4],
        grid: Grid::default(),
        notes: Vec::new(),
        texts: Vec::new(),
    };
    let dataset = reader.dataset()?;
    reader.sections()?;
    reader.finish(dataset)
}

/// The whole numbers of a cell list in memory.
fn cell_values<'a>(values: Option<Values<'a>>) -> Values<'a> {
    values.unwrap_or_else(no_values)
}

impl<'a> Reader<'a> {
    fn dataset(&mut self) -> Result<Dataset> {
        // Numbers of the whole file may come first.
        while self.cursor.skip_word("FIELD") {
            self.field()?;
        }
        if !self.cursor.skip_word("DATASET") {
            let problem = "there is no line DATASET behind the header".to_owned();
            return Err(self.cursor.error(problem, "get the complete file, or export the mesh again"));
        }
        let kind = self.cursor.required_word("kind of data")?;
        match kind.to_ascii_uppercase().as_slice() {
            b"POLYDATA" => Ok(Dataset::PolyData),
            b"UNSTRUCTURED_GRID" => Ok(Dataset::UnstructuredGrid),
            b"STRUCTURED_POINTS" => Ok(Dataset::StructuredPoints),
            _ => Err(xml::unsupported_error(&excerpt_of_bytes(kind))),
        }
    }

    fn sections(&mut self) -> Result<()> {
        loop {
            let before = self.cursor.at;
            let Some(word) = self.cursor.word() else { return Ok(()) };
            match word.to_ascii_lowercase().as_slice() {
                b"points" => self.points()?,
                b"vertices" => self.cells(0, 1)?,
                b"lines" => self.cells(1, 4)?,
                b"polygons" => self.cells(2, POLYGON)?,
                b"cells" => self.cells(2, 0)?,
                b"triangle_strips" => self.cells(3, STRIP)?,
                b"cell_types" => self.cell_types()?,
                b"dimensions" => self.grid.nodes = self.numbers()?.map(|value| value.max(0.0) as u64),
                b"spacing" | b"aspect_ratio" => self.grid.spacing = DVec3::from_array(self.numbers()?),
                b"origin" => self.grid.origin = DVec3::from_array(self.numbers()?),
                b"point_data" => self.owner = Owner::Points(self.cursor.count("number of points")?),
                b"cell_data" => self.owner = Owner::Cells(self.cursor.count("number of cells")?),
                b"field" => self.field()?,
                b"metadata" => self.cursor.skip_description(),
                b"scalars" => self.scalars()?,
                b"color_scalars" => self.colours()?,
                b"lookup_table" => self.lookup_table()?,
                b"vectors" => self.attribute(Purpose::Any, Some(3))?,
                b"normals" => self.attribute(Purpose::Normals, Some(3))?,
                b"tensors" => self.attribute(Purpose::Any, Some(9))?,
                b"tensors6" => self.attribute(Purpose::Any, Some(6))?,
                b"texture_coordinates" => self.attribute(Purpose::Texture, None)?,
                b"global_ids" | b"pedigree_ids" => self.attribute(Purpose::Ids, Some(1))?,
                b"edge_flags" => self.attribute(Purpose::Any, Some(1))?,
                _ if self.piece.points.is_some() && self.lists.iter().any(Option::is_some) => {
                    let word = excerpt_of_bytes(word);
                    let before = self.cursor.place_of(before);
                    self.notes.push(format!("everything from '{word}' on, after {before}, was ignored"));
                    return Ok(());
                }
                _ => {
                    let problem = format!("'{}' is not a keyword of this format", excerpt_of_bytes(word));
                    return Err(self.cursor.error(problem, "repair the file, or export the mesh again"));
                }
            }
        }
    }

    /// Numbers as text on one line.
    fn numbers(&mut self) -> Result<[f64; 3]> {
        let mut values = [0.0; 3];
        for value in &mut values {
            let word = self.cursor.required_word("number")?;
            let Some(own) = number(word).filter(|value| value.is_finite()) else {
                let problem = format!("'{}' is not a finite number", excerpt_of_bytes(word));
                return Err(self.cursor.error(problem, "repair the file"));
            };
            *value = own;
        }
        Ok(values)
    }

    fn points(&mut self) -> Result<()> {
        let count = self.cursor.count("number of points")?;
        let type_name = self.cursor.required_word("type of the points")?;
        self.cursor.end_line();
        let values = self.cursor.values(type_name, count.saturating_mul(3), &mut self.budget)?;
        let Some((values, number)) = values.zip(known_type(type_name)) else {
            return Err(self.cursor.error("points are text".to_owned(), "write them as float or double"));
        };
        self.piece.point_count = count;
        let name = "points".to_owned();
        self.piece.points = Some(Array { name, purpose: Purpose::Any, number, components: 3, values });
        Ok(())
    }

    /// A list of cells: numbers of corners and corners, or, since version 5, two arrays.
    fn cells(&mut self, list: usize, kind: u8) -> Result<()> {
        let count = self.cursor.count("number of cells")?;
        let size = self.cursor.count("length of the list of cells")?;
        let set = if self.cursor.skip_word("OFFSETS") {
            let offsets = self.indices(count)?;
            if !self.cursor.skip_word("CONNECTIVITY") {
                let problem = "there is no CONNECTIVITY behind OFFSETS".to_owned();
                return Err(self.cursor.error(problem, "get the complete file, or export the mesh again"));
            }
            let corners = self.indices(size)?;
            // One more than there are cells.
            let count = count.saturating_sub(1);
            let corners = Some(Corners::Offsets { offsets, begins: true, corners });
            CellSet { count, kinds: Kinds::All(kind), corners }
        } else {
            // A cell without corners is one number.
            if count > size {
                let cells = counted(count, ["cell does", "cells do"]);
                let problem = format!("{cells} not fit into {}", counted(size, ["number", "numbers"]));
                return Err(self.cursor.error(problem, "repair the file, or export the mesh again"));
            }
            self.cursor.end_line();
            let values = cell_values(self.cursor.values(b"int", size, &mut self.budget)?);
            CellSet { count, kinds: Kinds::All(kind), corners: Some(Corners::Counted(values)) }
        };
        self.lists[list] = Some(set);
        Ok(())
    }

    /// Indices of the type that the line names.
    fn indices(&mut self, count: usize) -> Result<Values<'a>> {
        let type_name = self.cursor.required_word("type of indices")?;
        self.cursor.end_line();
        self.cursor.values(type_name, count, &mut self.budget).map(cell_values)
    }

    fn cell_types(&mut self) -> Result<()> {
        let count = self.cursor.count("number of cells")?;
        self.cursor.end_line();
        let values = cell_values(self.cursor.values(b"int", count, &mut self.budget)?);
        match &mut self.lists[2] {
            Some(cells) if cells.count == count => {
                cells.kinds = Kinds::Each(values);
                Ok(())
            }
            cells => {
                let known = cells.as_ref().map_or(0, |cells| cells.count);
                let types = counted(count, ["type", "types"]);
                let problem = format!("the file has {types} for {}", counted(known, ["cell", "cells"]));
                Err(self.cursor.error(problem, "repair the file, or export the mesh again"))
            }
        }
    }

    /// Keeps an array of the points or cells, if it has numbers.
    fn keep(
        &mut self,
        name: String,
        purpose: Purpose,
        components: usize,
        type_name: &[u8],
        rows: usize,
    ) -> Result<()> {
        if !(1..=MOST_COMPONENTS).contains(&components) {
            let problem = format!("the array '{}' has {components} components", excerpt(&name));
            return Err(self.cursor.error(problem, "export the mesh again without it"));
        }
        if self.piece.point_data.len() + self.piece.cell_data.len() >= MOST_ARRAYS {
            let problem = format!("the file has more than {MOST_ARRAYS} arrays");
            return Err(self.cursor.error(problem, "export the mesh again with fewer"));
        }
        let values = self.cursor.values(type_name, rows.saturating_mul(components), &mut self.budget)?;
        let Some((values, number)) = values.zip(known_type(type_name)) else {
            if self.texts.len() < 8 {
                self.texts.push(name);
            }
            return Ok(());
        };
        let array = Array { name, purpose, number, components, values };
        match self.owner {
            Owner::Nobody => {}
            Owner::Points(_) => self.piece.point_data.push(array),
            Owner::Cells(_) => self.piece.cell_data.push(array),
        }
        Ok(())
    }

    fn rows(&self) -> usize {
        match self.owner {
            Owner::Nobody => 0,
            Owner::Points(rows) | Owner::Cells(rows) => rows,
        }
    }

    fn scalars(&mut self) -> Result<()> {
        let name = self.cursor.name()?;
        let type_name = self.cursor.required_word("type of numbers")?;
        let components = self.cursor.number_on_line().unwrap_or(1);
        if self.cursor.skip_word("LOOKUP_TABLE") {
            self.cursor.required_word("name of a lookup table")?;
        }
        self.cursor.end_line();
        let components = usize::try_from(components).unwrap_or(usize::MAX);
        self.keep(name, Purpose::Scalars, components, type_name, self.rows())
    }

    /// Colours: bytes, or, as text, numbers from 0 to 1.
    fn colours(&mut self) -> Result<()> {
        let name = self.cursor.name()?;
        let components = self.cursor.count("number of components")?;
        self.cursor.end_line();
        let type_name: &[u8] = if self.cursor.is_binary { b"unsigned_char" } else { b"float" };
        self.keep(name, Purpose::Colours, components, type_name, self.rows())
    }

    /// Passes a table of colours.
    fn lookup_table(&mut self) -> Result<()> {
        self.cursor.name()?;
        let size = self.cursor.count("number of colours")?.saturating_mul(4);
        self.cursor.end_line();
        let type_name: &[u8] = if self.cursor.is_binary { b"unsigned_char" } else { b"float" };
        self.cursor.values(type_name, size, &mut self.budget).map(drop)
    }

    /// An array with this many components, or as many as its line says.
    fn attribute(&mut self, purpose: Purpose, components: Option<usize>) -> Result<()> {
        let name = self.cursor.name()?;
        let components = match components {
            Some(components) => components,
            None => self.cursor.count("number of components")?,
        };
        let type_name = self.cursor.required_word("type of numbers")?;
        self.cursor.end_line();
        self.keep(name, purpose, components, type_name, self.rows())
    }

    /// Arrays one behind the other.
    fn field(&mut self) -> Result<()> {
        self.cursor.name()?;
        let count = self.cursor.count("number of arrays")?;
        let mut left = count;
        while left > 0 {
            if self.cursor.skip_word("METADATA") {
                self.cursor.skip_description();
                continue;
            }
            left -= 1;
            if self.cursor.skip_word("NULL_ARRAY") {
                continue;
            }
            let name = self.cursor.name()?;
            let components = self.cursor.count("number of components")?;
            let rows = self.cursor.count("number of rows")?;
            let type_name = self.cursor.required_word("type of numbers")?;
            self.cursor.end_line();
            if components == 0 || rows == 0 {
                continue;
            }
            self.keep(name, Purpose::Any, components, type_name, rows)?;
        }
        Ok(())
    }

    fn finish(mut self, dataset: Dataset) -> Result<Input> {
        self.notes.extend(note_of_left_out(&self.texts));
        if dataset == Dataset::StructuredPoints {
            let Piece { point_data, cell_data, .. } = &self.piece;
            return image::volume(&self.grid, point_data, cell_data, self.notes).map(Input::Volume);
        }
        let is_grid = dataset == Dataset::UnstructuredGrid;
        if is_grid && self.lists[2].as_ref().is_some_and(|cells| matches!(cells.kinds, Kinds::All(_))) {
            let problem = "the cells have no types".to_owned();
            return Err(self.cursor.error(problem, "get the complete file, or export the mesh again"));
        }
        for (list, cells) in self.lists.into_iter().enumerate() {
            // Points and lines are not read, but their numbers come first.
            let unread = |cells: CellSet<'a>| CellSet { corners: None, ..cells };
            let cells = if list < 2 { cells.map(unread) } else { cells };
            self.piece.cells.extend(cells);
        }
        let mut loaded = surface::surface(&[self.piece], &mut self.budget)?;
        self.notes.append(&mut loaded.notes);
        Ok(Input::Mesh(Loaded { notes: self.notes, ..loaded }))
    }
}
