//! PCD, the format of the Point Cloud Library: a header of lines, then text or binary numbers.
//!
//! Read by code of our own, which never trusts a declared count with memory and takes every type a field may
//! have.

use super::columns::{Column, load_columns, usual_name};
use crate::grammar::counted;
use crate::io::binary::value_le;
use crate::io::checks::{check_declared_count, cut_off, excerpt_of_bytes, without_padding};
use crate::io::loaded::Loaded;
use crate::io::lzf;
use crate::io::text::{number, unsigned_integer, words};
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// Maximum number of numbers of a point.
const MOST_FIELDS: usize = 256;

/// Whether a file begins as PCD files do.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    let bytes = bytes.trim_ascii_start();
    bytes.starts_with(b"# .PCD")
        || (bytes.starts_with(b"VERSION") && bytes.windows(7).take(4096).any(|w| w == b"\nFIELDS"))
}

/// One field: `count` numbers of `size` bytes each.
struct Field {
    name: String,
    size: usize,
    kind: Option<Kind>,
    count: usize,
}

struct Header<'a> {
    fields: Vec<Field>,
    points: u64,
    data: &'a [u8],
    /// Lines of the header.
    lines: u64,
    body: &'a [u8],
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    let header = header(bytes)?;
    match header.data {
        b"ascii" => text(&header),
        b"binary" => binary(&header),
        b"binary_compressed" => read_compressed(&header),
        other => {
            let problem = format!("there is no kind of data '{}'", excerpt_of_bytes(other));
            Err(Error::input(
                Some(format!("line {}", header.lines)),
                problem,
                "use ascii, binary or binary_compressed",
            ))
        }
    }
}

fn header(bytes: &[u8]) -> Result<Header<'_>> {
    let (mut names, mut sizes, mut types, mut counts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut points, mut size) = (None, [None; 2]);
    let (mut rest, mut lines) = (bytes, 0);
    loop {
        let end = rest.iter().position(|byte| *byte == b'\n');
        let Some(end) = end else { return Err(cut_off(format!("line {lines}"), "there is no line DATA")) };
        let line = rest[..end].trim_ascii();
        rest = &rest[end + 1..];
        lines += 1;
        let mut all = words(line);
        let first = all.next().unwrap_or_default();
        let integers = |all: &mut dyn Iterator<Item = &[u8]>| -> Result<Vec<u64>> {
            let integer = |word: &[u8]| {
                let problem = || format!("'{}' is not a whole number", excerpt_of_bytes(word));
                let refused = || Error::input(Some(format!("line {lines}")), problem(), "repair the header");
                unsigned_integer(word).ok_or_else(refused)
            };
            all.take(MOST_FIELDS + 1).map(integer).collect()
        };
        match first {
            b"FIELDS" | b"COLUMNS" => {
                names = all
                    .take(MOST_FIELDS + 1)
                    .map(|name| String::from_utf8_lossy(name).into_owned())
                    .collect();
            }
            b"SIZE" => sizes = integers(&mut all)?,
            b"TYPE" => types = all.take(MOST_FIELDS + 1).map(<[u8]>::to_vec).collect(),
            b"COUNT" => counts = integers(&mut all)?,
            b"WIDTH" => size[0] = integers(&mut all)?.first().copied(),
            b"HEIGHT" => size[1] = integers(&mut all)?.first().copied(),
            b"POINTS" => points = integers(&mut all)?.first().copied(),
            b"DATA" => {
                let fields = fields(names, &sizes, &types, &counts, lines)?;
                let product = size[0].map(|width| width.saturating_mul(size[1].unwrap_or(1)));
                let Some(points) = points.or(product) else {
                    let problem = "the header does not say how many points there are";
                    return Err(Error::input(Some(format!("line {lines}")), problem, "add a line POINTS"));
                };
                return Ok(Header {
                    fields,
                    points,
                    data: all.next().unwrap_or_default(),
                    lines,
                    body: rest,
                });
            }
            _ => {}
        }
    }
}

fn fields(
    names: Vec<String>,
    sizes: &[u64],
    types: &[Vec<u8>],
    counts: &[u64],
    line: u64,
) -> Result<Vec<Field>> {
    let fits = |length: usize| length == names.len();
    let refuse =
        |problem: &str| Err(Error::input(Some(format!("line {line}")), problem, "repair the header"));
    if names.is_empty()
        || !fits(sizes.len())
        || !fits(types.len())
        || !(counts.is_empty() || fits(counts.len()))
    {
        return refuse("FIELDS, SIZE, TYPE and COUNT do not name as many fields");
    }
    let numbers = counts.iter().fold(0_u64, |sum, count| sum.saturating_add(*count)).max(names.len() as u64);
    if numbers > MOST_FIELDS as u64 {
        return refuse("a point has more than 256 numbers");
    }
    let mut found = Vec::new();
    for (k, name) in names.into_iter().enumerate() {
        let kind = match (types[k].as_slice(), sizes[k]) {
            (b"F", 4) => Some(Kind::F32),
            (b"F", 8) => Some(Kind::F64),
            (b"U", 1) => Some(Kind::U8),
            (b"U", 2) => Some(Kind::U16),
            (b"U", 4) => Some(Kind::U32),
            (b"I", 1) => Some(Kind::I8),
            (b"I", 2) => Some(Kind::I16),
            (b"I", 4) => Some(Kind::I32),
            // Others are passed over.
            (_, 1 | 2 | 4 | 8) => None,
            _ => return refuse("a field has a SIZE other than 1, 2, 4 or 8"),
        };
        let count = counts.get(k).copied().unwrap_or(1) as usize;
        found.push(Field { name: usual_name(&name), size: sizes[k] as usize, kind, count });
    }
    Ok(found)
}

/// The columns of fields with one number that is known, empty; `None` for the others.
fn columns(fields: &[Field]) -> Vec<Option<Column>> {
    let column = |field: &Field| {
        let kind = field.kind.filter(|_| field.count == 1 && field.name != "_")?;
        Some(Column { name: field.name.clone(), kind, values: Vec::new() })
    };
    fields.iter().map(column).collect()
}

fn finish(columns: Vec<Option<Column>>) -> Result<Loaded> {
    let mut all = Vec::new();
    for column in columns.into_iter().flatten() {
        if column.name != "rgb" && column.name != "rgba" {
            all.push(column);
            continue;
        }
        // Three bytes in one number, whose type may be a floating one nevertheless.
        let bits = |value: &f64| {
            if column.kind == Kind::F32 { (*value as f32).to_bits() } else { *value as u32 }
        };
        for (name, shift) in [("red", 16), ("green", 8), ("blue", 0)] {
            let values = column.values.iter().map(|value| f64::from(bits(value) >> shift & 255)).collect();
            all.push(Column { name: name.to_owned(), kind: Kind::U8, values });
        }
    }
    // Depth cameras write NaN where they see nothing.
    load_columns(all, Vec::new())
}

fn text(header: &Header) -> Result<Loaded> {
    let place = || format!("line {}", header.lines);
    let numbers: u64 = header.fields.iter().map(|field| field.count as u64).sum();
    let body = without_padding(header.body);
    let left = body.len() as u64 + 1;
    check_declared_count(header.points, ["point", "points"], 2 * numbers.max(1), left, place())?;
    let mut columns = columns(&header.fields);
    let mut lines = body.split(|byte| *byte == b'\n');
    let (mut at, mut done) = (header.lines, 0);
    while done < header.points {
        at += 1;
        let Some(line) = lines.next() else {
            return Err(cut_off(
                format!("line {at}"),
                &format!("point {done} of {} is missing", header.points),
            ));
        };
        let mut all = words(line).peekable();
        if all.peek().is_none() {
            continue;
        }
        for (field, column) in header.fields.iter().zip(&mut columns) {
            for _ in 0..field.count {
                let Some(word) = all.next() else {
                    let problem = "the point has too few values on its line";
                    return Err(Error::input(Some(format!("line {at}")), problem, "repair the line"));
                };
                let Some(column) = column else { continue };
                let Some(value) = number(word) else {
                    let problem = format!("'{}' is not a number", excerpt_of_bytes(word));
                    return Err(Error::input(Some(format!("line {at}")), problem, "write plain numbers"));
                };
                column.values.push(value);
            }
        }
        done += 1;
    }
    finish(columns)
}

/// Bytes of a point.
fn stride(header: &Header) -> usize {
    header.fields.iter().map(|field| field.size * field.count).sum::<usize>().max(1)
}

fn binary(header: &Header) -> Result<Loaded> {
    let stride = stride(header);
    let place = format!("line {}", header.lines);
    check_declared_count(header.points, ["point", "points"], stride as u64, header.body.len() as u64, place)?;
    let mut columns = columns(&header.fields);
    for point in header.body.chunks_exact(stride).take(header.points as usize) {
        let mut at = 0;
        for (field, column) in header.fields.iter().zip(&mut columns) {
            let bytes = &point[at..at + field.size * field.count];
            at += bytes.len();
            if let (Some(column), Some(kind)) = (column, field.kind) {
                column.values.push(value_le(kind, bytes));
            }
        }
    }
    finish(columns)
}

/// Reads two lengths, packed and unpacked, and what LZF packed: all values of the first field, then those of
/// the second and so on.
fn read_compressed(header: &Header) -> Result<Loaded> {
    let place = || format!("line {}, the data", header.lines);
    let length = |at: usize| {
        let raw = header.body.get(at..at + 4).and_then(|raw| raw.first_chunk());
        raw.map(|raw: &[u8; 4]| u32::from_le_bytes(*raw) as usize)
    };
    let (Some(packed), Some(unpacked)) = (length(0), length(4)) else {
        return Err(cut_off(place(), "the lengths of the compressed data are missing"));
    };
    let Some(packed) = header.body.get(8..).and_then(|rest| rest.get(..packed)) else {
        let there = header.body.len() - 8;
        let packed = counted(packed, ["byte is", "bytes are"]);
        let there = counted(there, ["is", "are"]);
        return Err(cut_off(place(), &format!("{packed} declared, and {there} there")));
    };
    let Some(plain) = lzf::decompress(packed, unpacked) else {
        let problem = format!("the compressed data does not unpack to the {unpacked} bytes declared");
        return Err(Error::input(Some(place()), problem, "get the complete file, or export it again"));
    };
    let stride = stride(header) as u64;
    check_declared_count(header.points, ["point", "points"], stride, plain.len() as u64, place())?;
    let mut columns = columns(&header.fields);
    let mut rest = plain.as_slice();
    for (field, column) in header.fields.iter().zip(&mut columns) {
        // No longer than the data, as checked above.
        let (own, others) = rest.split_at(field.size * field.count * header.points as usize);
        rest = others;
        if let (Some(column), Some(kind)) = (column, field.kind) {
            column.values = own.chunks_exact(field.size).map(|bytes| value_le(kind, bytes)).collect();
        }
    }
    finish(columns)
}
