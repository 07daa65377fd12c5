//! The structure of VTK's XML files: which arrays there are, and where their numbers are. The part with
//! appended numbers need not be XML, so reading ends where it begins.

use std::borrow::Cow;

use glam::{DMat3, DVec3};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use super::array::{MOST_ARRAYS, MOST_COMPONENTS, Purpose, number_of_xml};
use super::cells::SURFACE_REMEDY;
use super::image::Grid;
use crate::io::checks::{cut_off, excerpt};
use crate::io::text::number;
use crate::io::volumes::raw::Number;
use crate::{Error, Result};

/// What helps with files that only name others.
const SINGLE_REMEDY: &str = "give one of the files that it names, or write all as one .vtp: Merge Blocks and \
                             Extract Surface in ParaView, combine().extract_surface() in PyVista";
/// The most pieces of a file.
const MOST_PIECES: usize = 1 << 16;

/// The kinds of files that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileKind {
    PolyData,
    UnstructuredGrid,
    ImageData,
}

/// Where an array stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Section {
    Points,
    PointData,
    CellData,
    Strips,
    Polys,
    Cells,
    /// What is not read.
    Other,
}

/// How the numbers of an array are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    Ascii,
    /// In the element, as base64.
    Binary,
    Appended,
}

/// An array as declared.
#[derive(Debug)]
pub(super) struct Declared<'a> {
    pub section: Section,
    pub name: String,
    pub purpose: Purpose,
    /// `None` for text and unknown types.
    pub number: Option<Number>,
    pub components: usize,
    pub form: Form,
    pub offset: u64,
    /// What the element contains.
    pub text: &'a [u8],
}

/// A piece as declared.
#[derive(Debug, Default)]
pub(super) struct DeclaredPiece<'a> {
    pub points: usize,
    /// Of unstructured grids.
    pub cells: usize,
    /// Points, lines, polygons and strips of poly data.
    pub lists: [usize; 4],
    pub extent: Option<[i64; 6]>,
    pub arrays: Vec<Declared<'a>>,
}

/// The part of a file behind its elements.
#[derive(Debug, Clone, Copy)]
pub(super) struct Appended<'a> {
    pub bytes: &'a [u8],
    pub is_base64: bool,
}

/// A whole file.
#[derive(Debug)]
pub(super) struct Document<'a> {
    pub kind: FileKind,
    pub is_big_endian: bool,
    /// Bytes of the numbers that say how many bytes follow.
    pub header_bytes: usize,
    pub compressor: Option<String>,
    pub pieces: Vec<DeclaredPiece<'a>>,
    pub appended: Option<Appended<'a>>,
    pub grid: Grid,
}

/// The attribute of this name.
fn attribute<'t>(tag: &'t BytesStart, name: &str) -> Option<Cow<'t, str>> {
    let mut all = tag.attributes();
    let found = all.with_checks(false).flatten().find(|attribute| attribute.key.as_ref() == name)?;
    // VTK writes names as they are, even those with an ampersand.
    let plain = found.normalized_value(XmlVersion::Implicit1_0);
    Some(plain.unwrap_or(found.value))
}

/// The kind of file that begins with these bytes; `None` if it is not VTK's XML.
pub(crate) fn kind_of(bytes: &[u8]) -> Option<std::result::Result<FileKind, String>> {
    let start = bytes.trim_ascii_start();
    if !start.starts_with(b"<?xml") && !start.starts_with(b"<VTKFile") && !start.starts_with(b"<!--") {
        return None;
    }
    let mut reader = Reader::from_reader(start);
    // Declarations and comments may come first.
    for _ in 0..64 {
        match reader.read_event() {
            Ok(Event::Start(tag)) if tag.name().as_ref() == "VTKFile" => return Some(kind_of_tag(&tag)),
            Ok(Event::Start(_) | Event::Empty(_) | Event::Eof) | Err(_) => return None,
            Ok(_) => {}
        }
    }
    None
}

fn kind_of_tag(tag: &BytesStart) -> std::result::Result<FileKind, String> {
    match attribute(tag, "type").as_deref() {
        Some("PolyData") => Ok(FileKind::PolyData),
        Some("UnstructuredGrid") => Ok(FileKind::UnstructuredGrid),
        Some("ImageData") => Ok(FileKind::ImageData),
        other => Err(excerpt(other.unwrap_or("no type"))),
    }
}

/// The error for a kind of data that is not read.
pub(super) fn unsupported_error(kind: &str) -> Error {
    let problem = format!("VTK files of {kind} are not supported");
    let names_files = kind.starts_with("vtk") || kind.starts_with('P') || kind == "Collection";
    Error::input(None, problem, if names_files { SINGLE_REMEDY } else { SURFACE_REMEDY })
}

/// What was read so far.
struct Walk<'a> {
    document: Option<Document<'a>>,
    section: Section,
    /// The arrays that the current section declares as its normals and the like.
    roles: Vec<(Purpose, String)>,
    arrays: usize,
    /// Whether a piece is open.
    in_piece: bool,
    /// Whether an array is open.
    in_array: bool,
    /// Open elements within the array, whose text is not its numbers.
    inner: usize,
}

/// Reads the elements of a file.
///
/// # Errors
/// [`Error::Input`] with the byte: this is not XML, or not VTK's; data of another kind.
pub(super) fn parse(bytes: &[u8]) -> Result<Document<'_>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = Reader::from_reader(bytes);
    let mut walk = Walk {
        document: None,
        section: Section::Other,
        roles: Vec::new(),
        arrays: 0,
        in_piece: false,
        in_array: false,
        inner: 0,
    };
    loop {
        let begin = reader.buffer_position() as usize;
        let event = reader.read_event().map_err(|error| {
            let place = Some(format!("byte {}", reader.error_position()));
            let problem = format!("this is not valid XML ({})", excerpt(&error.to_string()));
            Error::input(place, problem, "get the complete file, or export the mesh again").caused_by(error)
        })?;
        let end = reader.buffer_position() as usize;
        match event {
            Event::Start(tag) if tag.name().as_ref() == "AppendedData" => {
                let is_base64 = attribute(&tag, "encoding").is_none_or(|encoding| encoding == "base64");
                let rest = bytes.get(end..).unwrap_or_default();
                // What follows the underscore counts.
                let begin = rest.iter().position(|byte| *byte == b'_').map_or(rest.len(), |at| at + 1);
                if let Some(document) = &mut walk.document {
                    document.appended = Some(Appended { bytes: &rest[begin..], is_base64 });
                }
                break;
            }
            Event::Start(tag) => walk.open(&tag)?,
            Event::Empty(tag) => {
                walk.open(&tag)?;
                walk.close(tag.name().as_ref());
            }
            Event::Text(_) => walk.text(bytes.get(begin..end).unwrap_or_default()),
            Event::End(tag) => {
                walk.close(tag.name().as_ref());
                if tag.name().as_ref() == "VTKFile" {
                    break;
                }
            }
            Event::Eof if walk.document.is_some() => {
                return Err(cut_off(format!("byte {end}"), "there is no </VTKFile>"));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    walk.document.ok_or_else(|| {
        let problem = "the file has no element VTKFile with data";
        Error::input(None, problem, "get the complete file, or export the mesh again")
    })
}

impl<'a> Walk<'a> {
    fn open(&mut self, tag: &BytesStart) -> Result<()> {
        let name = tag.name();
        let name = name.as_ref();
        if self.in_array {
            self.inner += 1;
            return Ok(());
        }
        if name == "VTKFile" {
            self.document = Some(document(tag)?);
            return Ok(());
        }
        let Some(document) = &mut self.document else { return Ok(()) };
        match name {
            "ImageData" => document.grid = grid(tag)?,
            "Piece" => {
                if document.pieces.len() >= MOST_PIECES {
                    let problem = format!("the file has more than {MOST_PIECES} pieces");
                    return Err(Error::input(None, problem, "export the mesh again in one piece"));
                }
                document.pieces.push(piece(tag, document.kind)?);
                self.in_piece = true;
                self.section = Section::Other;
            }
            "Points" => self.section = Section::Points,
            "PointData" | "CellData" => {
                self.section = if name == "PointData" { Section::PointData } else { Section::CellData };
                self.roles = roles(tag);
            }
            "Strips" => self.section = Section::Strips,
            "Polys" => self.section = Section::Polys,
            "Cells" => self.section = Section::Cells,
            "Verts" | "Lines" | "FieldData" => self.section = Section::Other,
            "DataArray" | "Array" if self.in_piece && self.section != Section::Other => {
                self.arrays += 1;
                if self.arrays > MOST_ARRAYS {
                    let problem = format!("the file has more than {MOST_ARRAYS} arrays");
                    return Err(Error::input(None, problem, "export the mesh again with fewer"));
                }
                let array = array(tag, self.section, &self.roles)?;
                if let Some(piece) = document.pieces.last_mut() {
                    piece.arrays.push(array);
                    self.in_array = true;
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn text(&mut self, text: &'a [u8]) {
        let array = self.document.as_mut().and_then(|document| document.pieces.last_mut()?.arrays.last_mut());
        if let (true, Some(array)) =
            (self.in_array && self.inner == 0 && !text.trim_ascii().is_empty(), array)
            && array.text.is_empty()
        {
            array.text = text.trim_ascii();
        }
    }

    fn close(&mut self, name: &str) {
        if self.inner > 0 {
            self.inner -= 1;
            return;
        }
        match name {
            "DataArray" | "Array" => self.in_array = false,
            "Piece" => {
                self.in_piece = false;
                self.section = Section::Other;
            }
            "Points" | "PointData" | "CellData" | "Strips" | "Polys" | "Cells" | "Verts" | "Lines" => {
                self.section = Section::Other;
                self.roles.clear();
            }
            _ => {}
        }
    }
}

fn document<'a>(tag: &BytesStart) -> Result<Document<'a>> {
    let kind = kind_of_tag(tag).map_err(|kind| unsupported_error(&kind))?;
    let is_big_endian = attribute(tag, "byte_order").is_some_and(|order| order == "BigEndian");
    let header_bytes = match attribute(tag, "header_type").as_deref() {
        None | Some("UInt32") => 4,
        Some("UInt64") => 8,
        Some(other) => {
            let problem = format!("header_type '{}' is not supported", excerpt(other));
            return Err(Error::input(None, problem, "write it with UInt32 or UInt64"));
        }
    };
    let compressor = attribute(tag, "compressor").filter(|name| !name.is_empty()).map(Cow::into_owned);
    let (pieces, grid) = (Vec::new(), Grid::default());
    Ok(Document { kind, is_big_endian, header_bytes, compressor, pieces, appended: None, grid })
}

/// The numbers of an attribute.
fn numbers<const N: usize>(tag: &BytesStart, name: &str) -> Result<Option<[f64; N]>> {
    let Some(text) = attribute(tag, name) else { return Ok(None) };
    let values: Vec<f64> = text.split_whitespace().take(N + 1).filter_map(|w| number(w.as_bytes())).collect();
    let values = <[f64; N]>::try_from(values).ok().filter(|values| values.iter().all(|v| v.is_finite()));
    values.map(Some).ok_or_else(|| {
        let problem = format!("{name}=\"{}\" does not have {N} numbers", excerpt(&text));
        Error::input(None, problem, "repair the file, or export it again")
    })
}

fn extent(tag: &BytesStart, name: &str) -> Result<Option<[i64; 6]>> {
    let values = numbers::<6>(tag, name)?;
    // Beyond 32 bits there is nothing.
    Ok(values.map(|values| values.map(|value| (value as i64).clamp(i32::MIN.into(), i32::MAX.into()))))
}

fn grid(tag: &BytesStart) -> Result<Grid> {
    let whole = extent(tag, "WholeExtent")?.unwrap_or_default();
    let [x, y, z] = [0, 1, 2].map(|axis| whole[2 * axis]);
    let nodes = [0, 1, 2].map(|axis| (whole[2 * axis + 1] - whole[2 * axis] + 1).max(0) as u64);
    let rows = numbers::<9>(tag, "Direction")?.map_or(DMat3::IDENTITY, |rows| {
        // Written row by row.
        DMat3::from_cols_array(&rows).transpose()
    });
    Ok(Grid {
        first: [x, y, z],
        nodes,
        origin: numbers(tag, "Origin")?.map_or(DVec3::ZERO, DVec3::from_array),
        spacing: numbers(tag, "Spacing")?.map_or(DVec3::ONE, DVec3::from_array),
        directions: rows,
    })
}

fn piece<'a>(tag: &BytesStart, kind: FileKind) -> Result<DeclaredPiece<'a>> {
    let count = |name: &str| match attribute(tag, name) {
        None => Ok(0),
        Some(text) => text.trim().parse::<usize>().map_err(|error| {
            let problem = format!("{name}=\"{}\" is not a number of elements", excerpt(&text));
            Error::input(None, problem, "repair the file, or export it again").caused_by(error)
        }),
    };
    let mut piece = DeclaredPiece { extent: extent(tag, "Extent")?, ..DeclaredPiece::default() };
    match kind {
        FileKind::ImageData => {}
        FileKind::PolyData => {
            piece.points = count("NumberOfPoints")?;
            let names = ["NumberOfVerts", "NumberOfLines", "NumberOfPolys", "NumberOfStrips"];
            for (list, name) in piece.lists.iter_mut().zip(names) {
                *list = count(name)?;
            }
        }
        FileKind::UnstructuredGrid => {
            piece.points = count("NumberOfPoints")?;
            piece.cells = count("NumberOfCells")?;
        }
    }
    Ok(piece)
}

fn roles(tag: &BytesStart) -> Vec<(Purpose, String)> {
    let all = [
        ("Normals", Purpose::Normals),
        ("TCoords", Purpose::Texture),
        ("GlobalIds", Purpose::Ids),
        ("PedigreeIds", Purpose::Ids),
        ("Scalars", Purpose::Scalars),
    ];
    all.into_iter().filter_map(|(key, purpose)| Some((purpose, attribute(tag, key)?.into_owned()))).collect()
}

fn array<'a>(tag: &BytesStart, section: Section, roles: &[(Purpose, String)]) -> Result<Declared<'a>> {
    let name = attribute(tag, "Name").unwrap_or_default().into_owned();
    let refuse = |problem: String| {
        let place = Some(format!("the array '{}'", excerpt(&name)));
        Err(Error::input(place, problem, "get the complete file, or export the mesh again"))
    };
    let number = attribute(tag, "type").and_then(|name| number_of_xml(&name));
    let components = attribute(tag, "NumberOfComponents").map_or(Some(1), |text| text.trim().parse().ok());
    let Some(components @ 1..=MOST_COMPONENTS) = components else {
        return refuse(format!("it does not have 1 to {MOST_COMPONENTS} components"));
    };
    let form = match attribute(tag, "format").as_deref() {
        None | Some("ascii") => Form::Ascii,
        Some("binary") => Form::Binary,
        Some("appended") => Form::Appended,
        Some(other) => return refuse(format!("there is no format '{}'", excerpt(other))),
    };
    let offset = attribute(tag, "offset").and_then(|text| text.trim().parse().ok()).unwrap_or(0);
    let role = roles.iter().find(|(_, own)| *own == name).map(|(purpose, _)| *purpose);
    let purpose = role.unwrap_or_default();
    Ok(Declared { section, name, purpose, number, components, form, offset, text: &[] })
}
