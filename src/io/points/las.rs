//! Points of LAS and LAZ files, the formats of airborne laser scanning, by the `las` crate.

use std::io::Cursor;

use las::point::{Format, Point};
use las::{Header, PointDataBuilder, Reader};
use laz::laszip::ChunkTable;
use laz::{LazItem, LazItemType, LazVlr};

use super::columns::{Column, load_columns};
use super::{broken_file, without_panics};
use crate::grammar::counted;
use crate::io::checks::{check_declared_count, check_vertex_count, cut_off, excerpt, expands_too_far};
use crate::io::loaded::Loaded;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// The class of points that more than one strip of a flight has.
const OVERLAP: u8 = 12;
/// Points are decoded in pieces of this many bytes.
const BATCH_BYTES: u64 = 1 << 20;
/// Where the header has the offset of the points, the number of them, and in version 1.4 the first extended
/// record, their number and the number of points once more.
const OFFSET: usize = 96;
const COUNT: usize = 107;
const EXTENDED: std::ops::Range<usize> = 235..247;
const LARGE_COUNT: usize = 247;

/// Whether a file begins as LAS files do.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    bytes.starts_with(b"LASF")
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Loaded> {
    without_panics(|| read(bytes))
}

fn read(bytes: &[u8]) -> Result<Loaded> {
    let mut own = bytes.to_vec();
    let is_large = bytes.get(25).is_some_and(|minor| *minor >= 4);
    if let Some(extended) = own.get_mut(EXTENDED).filter(|_| is_large) {
        // Extended records have nothing of the points, but a length that nothing bounds.
        extended.fill(0);
    }
    let declared = number::<8>(bytes, LARGE_COUNT).filter(|_| is_large).map(u64::from_le_bytes);
    let declared = declared.or_else(|| number::<4>(bytes, COUNT).map(u32::from_le_bytes).map(u64::from));
    check_vertex_count(declared.unwrap_or(1).max(1))?;
    let mut own = Cursor::new(own);
    let header = Header::new(&mut own).map_err(las_error)?;
    check_size(&header, bytes)?;
    own.set_position(0);
    let mut reader = Reader::new(own).map_err(las_error)?;
    let batch = (BATCH_BYTES / u64::from(header.point_format().len())).max(1);
    let mut data = PointDataBuilder::new().for_header(&header).build();
    let mut columns = Columns::new(header.point_format());
    while reader.fill_points(batch, &mut data).map_err(las_error)? > 0 {
        for point in data.points() {
            columns.add(&point.map_err(las_error)?);
        }
    }
    columns.finish()
}

/// The bytes at a place, if there are so many.
fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at + N)?.try_into().ok()
}

/// Refuses more points than the file can have, before memory is allocated for them.
fn check_size(header: &Header, bytes: &[u8]) -> Result<()> {
    let (count, length) = (header.number_of_points(), u64::from(header.point_format().len()));
    let offset = number::<4>(bytes, OFFSET).map_or(0, u32::from_le_bytes) as usize;
    let left = bytes.len().saturating_sub(offset) as u64;
    if !header.point_format().is_compressed {
        return check_declared_count(count, ["point", "points"], length, left, "the header".to_owned());
    }
    if expands_too_far(count.saturating_mul(length), bytes.len() as u64) {
        return Err(broken_file(format!("it declares {count} points, more than fit into it")));
    }
    let packing = header.laz_vlr().map_err(las_error)?;
    let items: u64 = packing.items().iter().map(|item| u64::from(item.size())).sum();
    if items == 0 || items != length {
        return Err(broken_file("it does not say how its points are packed"));
    }
    let begin = number::<8>(bytes, offset).map_or(0, i64::from_le_bytes);
    // Where the writer could not go back, the place of the list of chunks is at the end.
    let end = bytes.len().checked_sub(8).and_then(|at| number::<8>(bytes, at)).map_or(0, i64::from_le_bytes);
    let table = if begin > offset as i64 { begin } else { end };
    let chunks = usize::try_from(table).ok().and_then(|at| number::<4>(bytes, at.checked_add(4)?));
    let chunks = u64::from(chunks.map_or(0, u32::from_le_bytes));
    if chunks > left {
        return Err(broken_file(format!("it declares {chunks} chunks of points")));
    }
    check_layers(bytes, offset, &packing, header)
}

/// Refuses layers of points that are longer than the file: memory is allocated for each before it is read.
fn check_layers(bytes: &[u8], offset: usize, packing: &LazVlr, header: &Header) -> Result<()> {
    let layers: usize = packing.items().iter().map(layers).sum();
    if packing.items().iter().all(|item| item.version() < 3) {
        return Ok(());
    }
    // Where the decoder takes one chunk to end. The number that a chunk has itself counts only where there is
    // no table of chunks of different sizes.
    let table = bytes.get(offset..).filter(|_| packing.uses_variable_size_chunks()).and_then(|_| {
        let mut from = Cursor::new(bytes);
        from.set_position(offset as u64);
        ChunkTable::read_from(from, packing).ok()
    });
    let points_of = |chunk: usize, own: u32| {
        let count = match &table {
            Some(table) => table.as_ref().get(chunk).map_or(0, |entry| entry.point_count),
            None if packing.uses_variable_size_chunks() => own.into(),
            None => packing.chunk_size().into(),
        };
        // A chunk of none has no end.
        if count == 0 { u64::MAX } else { count }
    };
    // A chunk has its first point, the number of points, the sizes of its layers, and these.
    let mut at = offset.saturating_add(8);
    let mut points = 0_u64;
    for chunk in 0.. {
        if points >= header.number_of_points() {
            break;
        }
        let sizes = at + usize::from(header.point_format().len()) + 4;
        let size = |k: usize| number::<4>(bytes, sizes + 4 * k).map(u32::from_le_bytes);
        let Some(count) = number::<4>(bytes, sizes - 4).map(u32::from_le_bytes) else { break };
        let Some(total) = (0..layers).map(|k| size(k).map(|size| size as usize)).sum::<Option<usize>>()
        else {
            break;
        };
        at = sizes + 4 * layers + total;
        if at > bytes.len() {
            return Err(cut_off(format!("point {points}"), "its chunk is longer than the file"));
        }
        points = points.saturating_add(points_of(chunk, count));
    }
    Ok(())
}

/// Layers of a part of the points, of which each has a size of its own.
fn layers(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => count.into(),
        _ => 0,
    }
}

fn las_error(error: las::Error) -> Error {
    match error {
        las::Error::Io(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            cut_off("its end".to_owned(), "points are missing")
        }
        other => broken_file(excerpt(&other.to_string())),
    }
}

/// The numbers of the points so far.
struct Columns {
    position: [Vec<f64>; 3],
    intensity: Vec<f64>,
    classification: Vec<f64>,
    /// Empty without colours.
    colour: [Vec<f64>; 3],
    has_colour: bool,
    /// Whether points have a bit for overlaps, and not a class.
    is_extended: bool,
    /// Points that their file says to leave out.
    withheld: usize,
}

impl Columns {
    fn new(format: &Format) -> Self {
        let (position, colour) = Default::default();
        let (intensity, classification) = Default::default();
        let Format { has_color: has_colour, is_extended, .. } = *format;
        Self { position, intensity, classification, colour, has_colour, is_extended, withheld: 0 }
    }

    fn add(&mut self, point: &Point) {
        if point.is_withheld {
            self.withheld += 1;
            return;
        }
        for (to, value) in self.position.iter_mut().zip([point.x, point.y, point.z]) {
            to.push(value);
        }
        self.intensity.push(point.intensity.into());
        // The decoder makes a flag of the class of overlaps.
        let class = match u8::from(point.classification) {
            1 if point.is_overlap && !self.is_extended => OVERLAP,
            class => class,
        };
        self.classification.push(class.into());
        if self.has_colour {
            let colour = point.color.map_or([0; 3], |colour| [colour.red, colour.green, colour.blue]);
            self.colour.iter_mut().zip(colour).for_each(|(to, value)| to.push(value.into()));
        }
    }

    fn finish(self) -> Result<Loaded> {
        let column = |name: &str, kind, values| Column { name: name.to_owned(), kind, values };
        let [x, y, z] = self.position;
        let mut columns =
            vec![column("x", Kind::F64, x), column("y", Kind::F64, y), column("z", Kind::F64, z)];
        // A field that is zero everywhere is one that was not filled in.
        let is_filled = |values: &[f64]| values.iter().any(|value| *value != 0.0);
        if self.colour.iter().any(|values| is_filled(values)) {
            let named = ["red", "green", "blue"].into_iter().zip(self.colour);
            columns.extend(named.map(|(name, values)| column(name, Kind::U16, values)));
        }
        let others =
            [("intensity", Kind::U16, self.intensity), ("classification", Kind::U8, self.classification)];
        let others = others.into_iter().filter(|(_, _, values)| is_filled(values));
        columns.extend(others.map(|(name, kind, values)| column(name, kind, values)));
        let withheld = self.withheld;
        let points = ["point marked as withheld was", "points marked as withheld were"];
        let notes = (withheld > 0).then(|| format!("{} left out", counted(withheld, points)));
        load_columns(columns, notes.into_iter().collect())
    }
}
