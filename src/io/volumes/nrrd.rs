//! NRRD, the format of 3D Slicer and Teem: lines of text, an empty one, and values, or the name of the file
//! that has them. Places are in the space that its header declares.

use std::borrow::Cow;
use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DMat3, DVec3};

use super::Volume;
use super::raw::{self, Layout, Number, byte_count, check_frame, numbers, size};
use crate::io::checks::{cut_off, excerpt};
use crate::io::gzip;
use crate::io::references::References;
use crate::io::text::number;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// Maximum number of bytes of a header.
const LONGEST_HEADER: usize = 1 << 20;

/// Whether a file begins as NRRD does.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    bytes.starts_with(b"NRRD0")
}

/// The fields of the header by their names, and where it ends.
struct Header<'a> {
    fields: HashMap<String, (u64, &'a str)>,
    end: usize,
}

impl<'a> Header<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self> {
        let (mut fields, mut end, mut line) = (HashMap::new(), 0, 0);
        loop {
            let rest = &bytes[end..bytes.len().min(LONGEST_HEADER)];
            // A header of its own may end with its file.
            let Some(length) = rest.iter().position(|byte| *byte == b'\n') else {
                if rest.is_empty() && fields.contains_key("data file") {
                    return Ok(Self { fields, end });
                }
                return Err(cut_off(
                    format!("line {}", line + 1),
                    "there is no empty line behind the header",
                ));
            };
            line += 1;
            end += length + 1;
            let text = str::from_utf8(rest[..length].trim_ascii()).unwrap_or_default();
            if text.is_empty() && rest[..length].trim_ascii().is_empty() {
                return Ok(Self { fields, end });
            }
            // Keys with := are anybody's own.
            if line > 1
                && !text.starts_with('#')
                && !text.contains(":=")
                && let Some((name, value)) = text.split_once(':')
            {
                fields.insert(name.trim().to_ascii_lowercase(), (line, value.trim()));
            }
        }
    }

    fn field(&self, name: &str) -> Option<&'a str> {
        self.fields.get(name).map(|(_, value)| *value)
    }

    fn require(&self, name: &str) -> Result<&'a str> {
        let missing = || Error::input(None, format!("the header has no field '{name}'"), "repair the header");
        self.field(name).ok_or_else(missing)
    }

    /// The error for a field that makes no sense.
    fn refuse(&self, name: &str, remedy: &str) -> Error {
        let (line, value) = self.fields.get(name).copied().unwrap_or_default();
        let problem = format!("'{name}: {}' is not supported", excerpt(value));
        Error::input(Some(format!("line {line}")), problem, remedy)
    }
}

/// `references` reads the file that has the values, if it is another one.
pub(crate) fn parse(bytes: &[u8], references: &References) -> Result<Volume> {
    let header = Header::new(bytes)?;
    let lengths = header.require("sizes")?.split_whitespace().map(|word| word.parse().ok());
    let lengths: Option<Vec<u64>> = lengths.collect();
    let lengths = lengths.ok_or_else(|| header.refuse("sizes", "give whole numbers"))?;
    let (size, note) = size(&lengths)?;
    let Some(number) = number_type(header.require("type")?) else {
        return Err(header.refuse("type", "write one number per node"));
    };
    let frame = frame(&header)?;
    check_frame(&frame)?;
    let other = header.field("data file").or(header.field("datafile"));
    let other = other.map(|name| other_file(&header, name, references)).transpose()?;
    let data = other.as_ref().map_or(&bytes[header.end..], |other| other.as_slice());
    let data = decode_values(&header, data, size, number)?;
    let layout = Layout {
        size,
        number: if is_text(&header) { Kind::F64.into() } else { number },
        is_big_endian: !is_text(&header)
            && header.field("endian").is_some_and(|e| e.eq_ignore_ascii_case("big")),
        is_last_fastest: false,
        scale: [1.0, 0.0],
    };
    layout.read(&data, "the values", frame, note.into_iter().collect())
}

/// The content of the one file that has the values.
fn other_file(header: &Header, name: &str, references: &References) -> Result<Rc<Vec<u8>>> {
    if name.starts_with("LIST") || name.contains('%') {
        return Err(header.refuse("data file", "name one file, or write all into one"));
    }
    let content = raw::other_file("data file", name, references)?;
    content.ok_or_else(|| header.refuse("data file", "write all into one file"))
}

fn is_text(header: &Header) -> bool {
    matches!(header.field("encoding"), Some("ascii" | "text" | "txt"))
}

/// The values as bytes of their type; text as those of 64-bit numbers.
fn decode_values<'a>(
    header: &Header,
    data: &'a [u8],
    size: [usize; 3],
    number_type: Number,
) -> Result<Cow<'a, [u8]>> {
    let count = |name: &str| header.field(name).map_or(Some(0), |value| value.parse::<i64>().ok());
    let Some(lines) = count("line skip").and_then(|lines| usize::try_from(lines).ok()) else {
        return Err(header.refuse("line skip", "give a whole number"));
    };
    let mut data = data;
    // Any number may be given; behind the last line there are no more.
    for _ in 0..lines {
        if data.is_empty() {
            break;
        }
        let end = data.iter().position(|byte| *byte == b'\n').map_or(data.len(), |end| end + 1);
        data = &data[end..];
    }
    let plain = match header.require("encoding")? {
        "raw" | "ascii" | "text" | "txt" => Cow::Borrowed(data),
        "gzip" | "gz" => Cow::Owned(gzip::decompress(data)?),
        _ => return Err(header.refuse("encoding", "use raw, gzip or text")),
    };
    let skipped = match count("byte skip") {
        // The values are the last bytes.
        Some(-1) => plain.len().saturating_sub(byte_count(size, number_type).unwrap_or(usize::MAX)),
        Some(bytes) => usize::try_from(bytes).unwrap_or(usize::MAX).min(plain.len()),
        None => return Err(header.refuse("byte skip", "give a whole number")),
    };
    if is_text(header) {
        return numbers(&plain[skipped..], size).map(Cow::Owned);
    }
    Ok(match plain {
        Cow::Borrowed(plain) => Cow::Borrowed(&plain[skipped..]),
        Cow::Owned(mut plain) => Cow::Owned(plain.split_off(skipped)),
    })
}

fn number_type(name: &str) -> Option<Number> {
    Some(match name {
        "signed char" | "int8" | "int8_t" => Kind::I8.into(),
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Kind::U8.into(),
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Kind::I16.into(),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Kind::U16.into(),
        "int" | "signed int" | "int32" | "int32_t" => Kind::I32.into(),
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Kind::U32.into(),
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => Number::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Number::U64,
        "float" => Kind::F32.into(),
        "double" => Kind::F64.into(),
        _ => return None,
    })
}

/// A vector as `(1, 2, 3)`.
fn vector(text: &str) -> Option<DVec3> {
    let inner = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let parts: Option<Vec<f64>> = inner.split(',').map(|part| number(part.trim().as_bytes())).collect();
    <[f64; 3]>::try_from(parts?).ok().map(DVec3::from_array)
}

fn frame(header: &Header) -> Result<DAffine3> {
    let origin = match header.field("space origin") {
        None => DVec3::ZERO,
        Some(text) => vector(text).ok_or_else(|| header.refuse("space origin", "give three numbers"))?,
    };
    if let Some(text) = header.field("space directions") {
        // Blanks may be within brackets.
        let vectors = text.split_inclusive(')').map(str::trim).take(3).map(vector);
        let axes: Option<Vec<DVec3>> = vectors.collect();
        let axes = axes.and_then(|axes| <[DVec3; 3]>::try_from(axes).ok());
        let Some([x, y, z]) = axes else {
            return Err(header.refuse("space directions", "give three vectors"));
        };
        return Ok(DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: origin });
    }
    let Some(text) = header.field("spacings") else { return Ok(DAffine3::from_translation(origin)) };
    let spacings: Option<Vec<f64>> = text.split_whitespace().take(3).map(|w| number(w.as_bytes())).collect();
    let spacings = spacings.and_then(|spacings| <[f64; 3]>::try_from(spacings).ok());
    let Some(spacings) = spacings else { return Err(header.refuse("spacings", "give three numbers")) };
    Ok(DAffine3 { matrix3: DMat3::from_diagonal(DVec3::from_array(spacings)), translation: origin })
}
