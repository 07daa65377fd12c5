//! Numbers in memory as the values of a volume.

use std::rc::Rc;

use glam::DAffine3;
use half::f16;
use rayon::prelude::*;

use super::Volume;
use crate::grammar::counted;
use crate::io::binary;
use crate::io::checks::{cut_off, excerpt};
use crate::io::references::References;
use crate::io::text::number;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// A type of numbers in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    /// One that attributes have, too.
    Usual(Kind),
    I64,
    U64,
    F16,
}

impl Number {
    pub fn bytes(self) -> usize {
        match self {
            Self::Usual(kind) => binary::size(kind),
            Self::F16 => 2,
            Self::I64 | Self::U64 => 8,
        }
    }

    /// The number in as many bytes as it has, the lowest first.
    pub fn value(self, bytes: &[u8]) -> f64 {
        match self {
            Self::Usual(kind) => binary::value_le(kind, bytes),
            Self::I64 => binary::widened(bytes) as i64 as f64,
            Self::U64 => binary::widened(bytes) as f64,
            Self::F16 => f16::from_bits(binary::widened(bytes) as u16).to_f64(),
        }
    }
}

impl From<Kind> for Number {
    fn from(kind: Kind) -> Self {
        Self::Usual(kind)
    }
}

/// How values lie in a file.
pub(crate) struct Layout {
    pub size: [usize; 3],
    pub number: Number,
    pub is_big_endian: bool,
    /// Whether values along the last axis are side by side, and not those along the first.
    pub is_last_fastest: bool,
    /// What values are multiplied by, and what is added then.
    pub scale: [f64; 2],
}

/// The size of a volume as lengths of its axes, those of length 1 behind the third left out. Of a series of
/// volumes, the first is taken; the note says so.
///
/// # Errors
/// [`Error::Input`] for other than three axes, or an axis with fewer than two nodes.
pub(crate) fn size(lengths: &[u64]) -> Result<([usize; 3], Option<String>)> {
    let shown = lengths.iter().map(u64::to_string).collect::<Vec<_>>().join(" x ");
    let refuse = |problem: String| Err(Error::input(None, problem, "give one value per node on three axes"));
    let [x, y, z, others @ ..] = lengths else {
        let axes = counted(lengths.len(), ["axis", "axes"]);
        return refuse(format!("the array has {axes} ({shown})"));
    };
    let node = |length: &u64| usize::try_from(*length).ok().filter(|length| *length >= 2);
    let (Some(x), Some(y), Some(z)) = (node(x), node(y), node(z)) else {
        return refuse(format!("the volume has {shown} values, but needs at least two along each axis"));
    };
    let count = others.iter().fold(1, |count: u64, length| count.saturating_mul(*length));
    let note = (count > 1).then(|| format!("the file has {count} volumes; the first is read"));
    Ok(([x, y, z], note))
}

/// The number of bytes of this many values, if memory can be that large.
pub(crate) fn byte_count(size: [usize; 3], number: Number) -> Option<usize> {
    size.iter().try_fold(number.bytes(), |product, length| product.checked_mul(*length))
}

impl Layout {
    /// The volume of values that begin where `bytes` begin; `place` says where that is.
    ///
    /// # Errors
    /// [`Error::Input`] if there are too few.
    pub fn read(&self, bytes: &[u8], place: &str, frame: DAffine3, notes: Vec<String>) -> Result<Volume> {
        let wanted = byte_count(self.size, self.number);
        let Some(bytes) = wanted.and_then(|count| bytes.get(..count)) else {
            let [x, y, z] = self.size;
            let bytes = counted(bytes.len(), ["byte", "bytes"]);
            let missing = format!("{x} x {y} x {z} values do not fit into {bytes}");
            return Err(cut_off(place.to_owned(), &missing));
        };
        let [nx, ny, nz] = self.size;
        let width = self.number.bytes();
        let value = |index: usize| {
            let mut eight = [0; 8];
            let own = &bytes[width * index..width * (index + 1)];
            eight[..width].copy_from_slice(own);
            if self.is_big_endian {
                eight[..width].reverse();
            }
            (self.scale[0] * self.number.value(&eight[..width]) + self.scale[1]) as f32
        };
        let mut values = vec![0.0; nx * ny * nz];
        values.par_chunks_mut(nx).enumerate().for_each(|(row, values)| {
            let (y, z) = (row % ny, row / ny);
            for (x, to) in values.iter_mut().enumerate() {
                *to = value(if self.is_last_fastest { z + nz * (y + ny * x) } else { x + nx * row });
            }
        });
        Ok(Volume { size: self.size, values, frame, notes })
    }
}

/// The content of the file that `field` of a header names.
pub(super) fn other_file(field: &str, name: &str, references: &References) -> Result<Option<Rc<Vec<u8>>>> {
    references.read(name, u64::MAX).map_err(|mut error| {
        if let Error::Input { place: place @ None, .. } = &mut error {
            *place = Some(field.to_owned());
        }
        error
    })
}

/// Numbers in text as bytes of 64-bit ones, no more than there are nodes.
pub(super) fn numbers(text: &[u8], size: [usize; 3]) -> Result<Vec<u8>> {
    let wanted = byte_count(size, Kind::U8.into()).unwrap_or(usize::MAX);
    let words =
        text.split(|byte| byte.is_ascii_whitespace() || *byte == b',').filter(|word| !word.is_empty());
    let mut bytes = Vec::new();
    for (k, word) in words.take(wanted).enumerate() {
        let Some(value) = number(word) else {
            let problem = format!("'{}' is not a number", excerpt(&String::from_utf8_lossy(word)));
            return Err(Error::input(Some(format!("value {k}")), problem, "write plain numbers"));
        };
        bytes.extend(value.to_le_bytes());
    }
    Ok(bytes)
}

/// Refuses a frame that is not finite or leaves no room between nodes.
pub(crate) fn check_frame(frame: &DAffine3) -> Result<()> {
    let volume = frame.matrix3.determinant();
    if frame.is_finite() && volume.is_finite() && volume != 0.0 {
        return Ok(());
    }
    let problem = "the spacing or the directions of the volume's axes are zero or not finite";
    Err(Error::input(None, problem, "repair the header"))
}
