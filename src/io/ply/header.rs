//! The header of a PLY file: encoding, elements and their properties.

use std::collections::HashSet;

use crate::io::binary::size;
use crate::io::checks::excerpt;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The number type of this name.
fn from_name(name: &str) -> Option<Kind> {
    Some(match name {
        "char" | "int8" => Kind::I8,
        "uchar" | "uint8" => Kind::U8,
        "short" | "int16" => Kind::I16,
        "ushort" | "uint16" => Kind::U16,
        "int" | "int32" => Kind::I32,
        "uint" | "uint32" => Kind::U32,
        "float" | "float32" => Kind::F32,
        "double" | "float64" => Kind::F64,
        _ => return None,
    })
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Values {
    Scalar(Kind),
    List { count: Kind, item: Kind },
}

#[derive(Debug)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) values: Values,
}

#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

impl Element {
    /// The fewest bytes that one element takes, with empty lists.
    pub(crate) fn least_bytes(&self, encoding: Encoding) -> u64 {
        let bytes = |property: &Property| match (encoding, property.values) {
            // At least one digit and one separator.
            (Encoding::Ascii, _) => 2,
            (_, Values::Scalar(kind) | Values::List { count: kind, .. }) => size(kind) as u64,
        };
        self.properties.iter().map(bytes).sum()
    }
}

#[derive(Debug)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
    /// Byte at which the data starts.
    pub(crate) data_start: usize,
    /// Lines up to and including `end_header`.
    pub(crate) lines: u64,
}

impl Header {
    pub(crate) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }

    pub(crate) fn parse(bytes: &[u8]) -> Result<Self> {
        // Files from old Macintosh programs end their lines with CR alone.
        let end = match bytes.get(3..5) {
            Some([b'\r', next]) if *next != b'\n' => b'\r',
            _ => b'\n',
        };
        let mut encoding = None;
        let mut elements = Vec::new();
        // The names of elements, and those of properties with the number of their element.
        let mut names = HashSet::new();
        let (mut data_start, mut lines) = (0, 0);
        loop {
            let rest = bytes.get(data_start..).unwrap_or_default();
            let Some(length) = rest.iter().position(|byte| *byte == end) else {
                let remedy = "the file is cut off or not a PLY file; export the mesh again";
                return Err(Error::input(None, "the PLY header has no 'end_header' line", remedy));
            };
            // Comments may be in any encoding.
            let line = String::from_utf8_lossy(rest.get(..length).unwrap_or_default());
            data_start += length + 1;
            lines += 1;
            let line = line.trim();
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                ["ply"] if lines == 1 => {}
                [] | ["comment" | "obj_info", ..] if lines > 1 => {}
                ["format", name, version] if lines > 1 => encoding = Some(encoding_of(name, version, lines)?),
                ["element", name, count] if lines > 1 => {
                    add_element((&mut elements, &mut names), name, count, lines)?
                }
                ["property", words @ ..] if lines > 1 => {
                    add_property((&mut elements, &mut names), words, lines)?
                }
                ["end_header"] if lines > 1 => break,
                _ => {
                    return Err(header_error(lines, format!("'{}' is not a PLY header line", excerpt(line))));
                }
            }
        }
        let Some(encoding) = encoding else {
            let remedy = "add a line such as 'format ascii 1.0'";
            return Err(Error::input(None, "the PLY header has no 'format' line", remedy));
        };
        Ok(Self { encoding, elements, data_start, lines })
    }
}

fn header_error(line: u64, problem: String) -> Error {
    Error::input(Some(format!("line {line}")), problem, "repair the header, or export the mesh again")
}

fn encoding_of(name: &str, version: &str, line: u64) -> Result<Encoding> {
    if version != "1.0" {
        return Err(header_error(line, format!("PLY version '{}' is not 1.0", excerpt(version))));
    }
    match name {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err(header_error(line, format!("unknown PLY format '{}'", excerpt(name)))),
    }
}

/// The elements declared so far, and all names, to find duplicates.
type Declared<'a> = (&'a mut Vec<Element>, &'a mut HashSet<(usize, String)>);

fn add_element((elements, names): Declared, name: &str, count: &str, line: u64) -> Result<()> {
    let Ok(count) = count.parse() else {
        return Err(header_error(line, format!("the count '{}' is not a whole number", excerpt(count))));
    };
    if !names.insert((usize::MAX, name.to_owned())) {
        return Err(header_error(line, format!("the element '{}' is declared twice", excerpt(name))));
    }
    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
    Ok(())
}

fn add_property((elements, names): Declared, words: &[&str], line: u64) -> Result<()> {
    let kind_of = |name: &str| {
        from_name(name)
            .ok_or_else(|| header_error(line, format!("unknown property type '{}'", excerpt(name))))
    };
    let (values, name) = match words {
        ["list", count, item, name] => {
            let kind = kind_of(count)?;
            if kind.range().is_none() {
                return Err(header_error(
                    line,
                    format!("the list count type '{count}' is not an integer type"),
                ));
            }
            (Values::List { count: kind, item: kind_of(item)? }, name)
        }
        [scalar, name] => (Values::Scalar(kind_of(scalar)?), name),
        _ => return Err(header_error(line, "this property line is incomplete".to_owned())),
    };
    let number = elements.len();
    let Some(element) = elements.last_mut() else {
        return Err(header_error(line, "a property comes before any element".to_owned()));
    };
    if !names.insert((number, (*name).to_owned())) {
        return Err(header_error(line, format!("the property '{}' is declared twice", excerpt(name))));
    }
    element.properties.push(Property { name: (*name).to_owned(), values });
    Ok(())
}
