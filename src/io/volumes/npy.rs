//! Arrays of NumPy. The first index is x, the second y, the third z, one unit apart.
//!
//! Read by code of our own: crates for it multiply the declared lengths without a check, or follow brackets
//! as deep as a file has them.

use glam::DAffine3;

use super::Volume;
use super::raw::{Layout, Number, size};
use crate::grammar::counted;
use crate::io::checks::{cut_off, excerpt};
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// Whether a file begins as one of NumPy's arrays.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY")
}

/// The header's text and the bytes behind it.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (begin, length) = match *bytes.get(6)? {
        1 => (10, u16::from_le_bytes(bytes.get(8..10)?.try_into().ok()?).into()),
        _ => (12, u32::from_le_bytes(bytes.get(8..12)?.try_into().ok()?)),
    };
    let (header, values) = bytes.get(begin..)?.split_at_checked(length as usize)?;
    Some((str::from_utf8(header).unwrap_or_default(), values))
}

/// What follows a key of the header, a dictionary as Python writes it.
fn field<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let quoted = ['\'', '"'].iter().find_map(|quote| header.split_once(&format!("{quote}{key}{quote}")));
    Some(quoted?.1.trim_start().strip_prefix(':')?.trim_start())
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Volume> {
    let Some((header, values)) = split(bytes) else {
        return Err(cut_off("the header".to_owned(), "the header has no end"));
    };
    let refuse = |problem: String| {
        Error::input(Some("the header".to_owned()), problem, "save a plain array of numbers with numpy.save")
    };
    let type_text = field(header, "descr").unwrap_or_default();
    let name = type_text.strip_prefix(['\'', '"']).and_then(|rest| rest.split(['\'', '"']).next());
    let Some((number, is_big_endian)) = name.and_then(number) else {
        let shown = excerpt(name.unwrap_or(type_text));
        return Err(refuse(format!("values of type {shown} are not supported")));
    };
    let is_last_fastest = match field(header, "fortran_order") {
        Some(text) if text.starts_with("True") => false,
        Some(text) if text.starts_with("False") => true,
        _ => return Err(refuse("it does not tell the order of the values".to_owned())),
    };
    let shape = field(header, "shape").and_then(|text| text.strip_prefix('(')?.split(')').next());
    let lengths = shape.map(|text| text.split(',').map(str::trim).filter(|word| !word.is_empty()));
    let lengths: Option<Vec<u64>> = lengths.and_then(|words| words.map(|word| word.parse().ok()).collect());
    let Some(lengths) = lengths else {
        return Err(refuse("it does not tell the shape of the array".to_owned()));
    };
    let (size, note) = size(&lengths)?;
    if note.is_some() {
        let problem = format!("the array has {}", counted(lengths.len(), ["axis", "axes"]));
        return Err(Error::input(None, problem, "give one value a node on three axes"));
    }
    let layout = Layout { size, number, is_big_endian, is_last_fastest, scale: [1.0, 0.0] };
    layout.read(values, &format!("byte {}", bytes.len() - values.len()), DAffine3::IDENTITY, Vec::new())
}

/// A type as NumPy names it, and whether its highest byte comes first.
fn number(name: &str) -> Option<(Number, bool)> {
    let (order, kind) = name.split_at_checked(1)?;
    let number: Number = match kind {
        "b1" | "u1" => Kind::U8.into(),
        "i1" => Kind::I8.into(),
        "u2" => Kind::U16.into(),
        "i2" => Kind::I16.into(),
        "u4" => Kind::U32.into(),
        "i4" => Kind::I32.into(),
        "u8" => Number::U64,
        "i8" => Number::I64,
        "f2" => Number::F16,
        "f4" => Kind::F32.into(),
        "f8" => Kind::F64.into(),
        _ => return None,
    };
    match order {
        "<" | "|" => Some((number, false)),
        ">" => Some((number, true)),
        _ => None,
    }
}
