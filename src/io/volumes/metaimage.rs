//! MetaImage, the format of ITK: lines of `Name = value`, of which the last says where the values are, behind
//! it or in another file. Places are in the space of the header.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::rc::Rc;

use flate2::read::ZlibDecoder;
use glam::{DAffine3, DMat3, DVec3};

use super::Volume;
use super::raw::{Layout, Number, byte_count, check_frame, numbers, other_file, size};
use crate::grammar::counted;
use crate::io::checks::{cut_off, excerpt, expands_too_far};
use crate::io::gzip;
use crate::io::references::References;
use crate::io::text::number;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// The maximum length of a header in bytes.
const LONGEST_HEADER: usize = 1 << 20;

/// Fields of which one is in the first lines of each file.
const FIRST_FIELDS: [&str; 2] = ["ObjectType", "NDims"];
/// Lines in which they are looked for; comments may come first.
const FIRST_LINES: usize = 20;

/// Whether a file begins as MetaImage does.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    let lines = bytes.split(|byte| *byte == b'\n').take(FIRST_LINES);
    let fields = lines.map(|line| field(line.get(..line.len().min(4096)).unwrap_or_default()));
    // Other formats have no such lines.
    fields.take_while(Option::is_some).flatten().any(|(name, _)| FIRST_FIELDS.contains(&name))
}

/// The name and the value of a line of the header.
fn field(line: &[u8]) -> Option<(&str, &str)> {
    let (name, value) = str::from_utf8(line).ok()?.split_once('=')?;
    Some((name.trim(), value.trim()))
}

/// The fields of the header by their names, each with its line, and where it ends.
struct Header<'a> {
    fields: HashMap<&'a str, (usize, &'a str)>,
    end: usize,
}

impl<'a> Header<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self> {
        let (mut fields, mut end, mut line) = (HashMap::new(), 0, 0);
        while end < bytes.len().min(LONGEST_HEADER) {
            line += 1;
            let rest = &bytes[end..bytes.len().min(LONGEST_HEADER)];
            let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
            end += (length + 1).min(rest.len());
            let text = rest[..length].trim_ascii();
            let Some((name, value)) = field(text) else {
                if text.is_empty() || text.starts_with(b"#") {
                    continue;
                }
                let problem = "the line is not of the form 'Name = value'";
                return Err(Error::input(Some(format!("line {line}")), problem, "repair the header"));
            };
            fields.insert(name, (line, value));
            if name == "ElementDataFile" {
                return Ok(Self { fields, end });
            }
        }
        Err(cut_off(format!("line {}", line + 1), "the header has no line 'ElementDataFile = …'"))
    }

    /// The value of the first of these fields that is there.
    fn field(&self, names: &[&str]) -> Option<&'a str> {
        names.iter().find_map(|name| self.fields.get(name)).map(|(_, value)| *value)
    }

    fn require(&self, name: &str) -> Result<&'a str> {
        let missing = || Error::input(None, format!("the header has no field '{name}'"), "repair the header");
        self.field(&[name]).ok_or_else(missing)
    }

    /// The error for a field that makes no sense.
    fn refuse(&self, name: &str, remedy: &str) -> Error {
        let (line, value) = self.fields.get(name).copied().unwrap_or_default();
        let problem = format!("'{name} = {}' is not supported", excerpt(value));
        Error::input(Some(format!("line {line}")), problem, remedy)
    }

    /// The numbers of the first of these fields that is there.
    fn numbers(&self, names: &[&str]) -> Result<Option<Vec<f64>>> {
        let Some(name) = names.iter().find(|name| self.fields.contains_key(**name)) else { return Ok(None) };
        let words = self.field(&[name]).unwrap_or_default().split_whitespace();
        let values: Option<Vec<f64>> = words.map(|word| number(word.as_bytes())).collect();
        values.map(Some).ok_or_else(|| self.refuse(name, "give numbers"))
    }

    /// The number of this field, or `otherwise` if it is not there.
    fn one_number(&self, name: &str, otherwise: f64) -> Result<f64> {
        match self.numbers(&[name])?.as_deref() {
            None => Ok(otherwise),
            Some([value]) => Ok(*value),
            Some(_) => Err(self.refuse(name, "give one number")),
        }
    }

    /// Whether one of these fields says so.
    fn is_true(&self, names: &[&str]) -> bool {
        // As ITK reads them: True, T or 1.
        self.field(names).is_some_and(|value| value.starts_with(['T', 't', '1']))
    }
}

/// `references` reads the file that has the values, if it is another one.
pub(crate) fn parse(bytes: &[u8], references: &References) -> Result<Volume> {
    let header = Header::new(bytes)?;
    if header.field(&["ObjectType"]).is_some_and(|kind| !kind.eq_ignore_ascii_case("Image")) {
        return Err(header.refuse("ObjectType", "give an image"));
    }
    let lengths = header.require("DimSize")?.split_whitespace().map(|word| word.parse().ok());
    let lengths: Option<Vec<u64>> = lengths.collect();
    let lengths = lengths.ok_or_else(|| header.refuse("DimSize", "give whole numbers"))?;
    let (size, note) = size(&lengths)?;
    if header.one_number("ElementNumberOfChannels", 1.0)? != 1.0 {
        return Err(header.refuse("ElementNumberOfChannels", "write one number per node"));
    }
    let Some(number) = number_type(header.require("ElementType")?) else {
        return Err(header.refuse("ElementType", "write one number per node"));
    };
    let frame = frame(&header, lengths.len())?;
    check_frame(&frame)?;
    let scale = [
        header.one_number("ElementToIntensityFunctionSlope", 1.0)?,
        header.one_number("ElementToIntensityFunctionOffset", 0.0)?,
    ];
    let name = header.require("ElementDataFile")?;
    let other = match name.eq_ignore_ascii_case("LOCAL") {
        true => None,
        false => Some(values_file(&header, name, references)?),
    };
    let data = other.as_ref().map_or(&bytes[header.end..], |other| other.as_slice());
    let is_text = header.field(&["BinaryData"]).is_some() && !header.is_true(&["BinaryData"]);
    let data = decode_values(&header, data, size, number, is_text)?;
    let is_big_endian = !is_text && header.is_true(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"]);
    let number = if is_text { Kind::F64.into() } else { number };
    let layout = Layout { size, number, is_big_endian, is_last_fastest: false, scale };
    layout.read(&data, "the values", frame, note.into_iter().collect())
}

/// The content of the one file that has the values.
fn values_file(header: &Header, name: &str, references: &References) -> Result<Rc<Vec<u8>>> {
    const FIELD: &str = "ElementDataFile";
    if name.starts_with("LIST") || name.contains('%') {
        return Err(header.refuse(FIELD, "name one file, or write all into one"));
    }
    other_file(FIELD, name, references)?.ok_or_else(|| header.refuse(FIELD, "write all into one file"))
}

/// The values as bytes of their type; text as those of 64-bit numbers.
fn decode_values<'a>(
    header: &Header,
    data: &'a [u8],
    size: [usize; 3],
    number_type: Number,
    is_text: bool,
) -> Result<Cow<'a, [u8]>> {
    let skipped = match header.one_number("HeaderSize", 0.0)? {
        // The values are the last bytes.
        -1.0 => data.len().saturating_sub(byte_count(size, number_type).unwrap_or(usize::MAX)),
        bytes if bytes >= 0.0 && bytes.fract() == 0.0 => data.len().min(bytes as usize),
        _ => return Err(header.refuse("HeaderSize", "give a whole number, or -1")),
    };
    let data = &data[skipped..];
    if is_text {
        return numbers(data, size).map(Cow::Owned);
    }
    if !header.is_true(&["CompressedData"]) {
        return Ok(Cow::Borrowed(data));
    }
    if gzip::is_compressed(data) {
        return gzip::decompress(data).map(Cow::Owned);
    }
    let wanted = byte_count(size, number_type).map_or(u64::MAX, |count| count as u64);
    decompress(data, wanted).map(Cow::Owned)
}

/// Unpacks at most `wanted` bytes of zlib data; a packed byte stands for no more bytes than in other files.
fn decompress(data: &[u8], wanted: u64) -> Result<Vec<u8>> {
    if expands_too_far(wanted, data.len() as u64) {
        let problem = format!(
            "{} of zlib data cannot hold the {wanted} declared",
            counted(data.len(), ["byte", "bytes"])
        );
        return Err(Error::input(None, problem, "get the complete file, or write it uncompressed"));
    }
    let mut plain = Vec::new();
    ZlibDecoder::new(data).take(wanted).read_to_end(&mut plain).map_err(|error| {
        let problem = format!("the zlib data is cut off or damaged ({error})");
        Error::input(None, problem, "get the complete file, or export it again").caused_by(error)
    })?;
    Ok(plain)
}

fn number_type(name: &str) -> Option<Number> {
    Some(match name {
        "MET_CHAR" => Kind::I8.into(),
        "MET_UCHAR" => Kind::U8.into(),
        "MET_SHORT" => Kind::I16.into(),
        "MET_USHORT" => Kind::U16.into(),
        // As in MetaIO, whose `long` has 32 bits on all systems.
        "MET_INT" | "MET_LONG" => Kind::I32.into(),
        "MET_UINT" | "MET_ULONG" => Kind::U32.into(),
        "MET_LONG_LONG" => Number::I64,
        "MET_ULONG_LONG" => Number::U64,
        "MET_FLOAT" => Kind::F32.into(),
        "MET_DOUBLE" => Kind::F64.into(),
        _ => return None,
    })
}

/// From indices to places; `axes` is the number of the volume's axes, of which the first three count.
fn frame(header: &Header, axes: usize) -> Result<DAffine3> {
    let three = |names: &[&str], otherwise: DVec3| match header.numbers(names)?.as_deref() {
        None => Ok(otherwise),
        Some([x, y, z, ..]) => Ok(DVec3::new(*x, *y, *z)),
        Some(_) => {
            let name = names.iter().find(|name| header.fields.contains_key(**name)).unwrap_or(&names[0]);
            Err(header.refuse(name, "give a number for each axis"))
        }
    };
    let origin = three(&["Offset", "Position", "Origin"], DVec3::ZERO)?;
    let spacing = three(&["ElementSpacing", "ElementSize"], DVec3::ONE)?;
    const MATRIX: [&str; 3] = ["TransformMatrix", "Rotation", "Orientation"];
    let mut directions = DMat3::IDENTITY;
    if let Some(values) = header.numbers(&MATRIX)? {
        if values.len() != axes * axes {
            let name = MATRIX.iter().find(|name| header.fields.contains_key(**name)).unwrap_or(&MATRIX[0]);
            return Err(header.refuse(name, "give the direction of each axis"));
        }
        // The direction of an axis after the other.
        let axis = |k: usize| DVec3::from_slice(&values[k * axes..]);
        directions = DMat3::from_cols(axis(0), axis(1), axis(2));
    }
    Ok(DAffine3 { matrix3: directions * DMat3::from_diagonal(spacing), translation: origin })
}
