//! Arrays of VTK files: numbers of points or of cells, as bytes until somebody asks for them.

use std::borrow::Cow;

use crate::io::checks::{excerpt, expands_too_far, outgrows, reserve};
use crate::io::text::number;
use crate::io::volumes::raw::Number;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// The most arrays of a file.
pub(super) const MOST_ARRAYS: usize = 1 << 16;
/// The most components of an array.
pub(super) const MOST_COMPONENTS: usize = 1 << 10;

/// What the file says that an array is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Purpose {
    #[default]
    Any,
    /// The numbers that a program shows first.
    Scalars,
    Normals,
    Texture,
    Colours,
    /// Numbers of points or cells, which say nothing about another mesh.
    Ids,
}

/// Numbers of points or of cells.
#[derive(Debug)]
pub(super) struct Array<'a> {
    pub name: String,
    pub purpose: Purpose,
    /// The type that the file declares.
    pub number: Number,
    pub components: usize,
    pub values: Values<'a>,
}

/// Numbers in the bytes of a file.
#[derive(Debug)]
pub(super) struct Values<'a> {
    /// The type of each; text is read as 64-bit numbers.
    pub number: Number,
    pub bytes: Cow<'a, [u8]>,
    pub is_big_endian: bool,
}

impl<'a> Values<'a> {
    /// Numbers as text, one word each.
    ///
    /// # Errors
    /// [`Error::Input`] for a word that is not a number.
    pub fn of_words(words: impl Iterator<Item = &'a [u8]>, count: usize) -> Result<Self> {
        let mut bytes = Vec::new();
        reserve(&mut bytes, count.saturating_mul(8), "the numbers of a VTK file")?;
        for word in words.take(count) {
            let Some(value) = number(word).or_else(|| unusual_nan(word)) else {
                let problem = format!("'{}' is not a number", excerpt(&String::from_utf8_lossy(word)));
                return Err(Error::input(None, problem, "write plain numbers"));
            };
            bytes.extend(value.to_le_bytes());
        }
        Ok(Self { number: Kind::F64.into(), bytes: Cow::Owned(bytes), is_big_endian: false })
    }

    pub fn len(&self) -> usize {
        self.bytes.len() / self.number.bytes()
    }

    /// The number at this place, or 0 behind the last.
    pub fn at(&self, index: usize) -> f64 {
        let width = self.number.bytes();
        let own = self.bytes.get(width * index..width * (index + 1)).unwrap_or_default();
        let mut eight = [0; 8];
        eight[..own.len()].copy_from_slice(own);
        if self.is_big_endian {
            eight[..own.len()].reverse();
        }
        self.number.value(&eight[..own.len()])
    }

    /// The whole number at this place; `None` for any other, or behind the last.
    pub fn index(&self, at: usize) -> Option<u64> {
        let value = self.at(at);
        (at < self.len() && value >= 0.0 && value.fract() == 0.0).then_some(value as u64)
    }
}

/// Some programs write "-nan" or "nan(ind)".
fn unusual_nan(word: &[u8]) -> Option<f64> {
    let word = word.strip_prefix(b"-").unwrap_or(word);
    word.get(..3).is_some_and(|start| start.eq_ignore_ascii_case(b"nan")).then_some(f64::NAN)
}

/// The type of this name in XML.
pub(super) fn number_of_xml(name: &str) -> Option<Number> {
    Some(match name {
        "Int8" => Kind::I8.into(),
        "UInt8" => Kind::U8.into(),
        "Int16" => Kind::I16.into(),
        "UInt16" => Kind::U16.into(),
        "Int32" => Kind::I32.into(),
        "UInt32" => Kind::U32.into(),
        "Int64" => Number::I64,
        "UInt64" => Number::U64,
        "Float32" => Kind::F32.into(),
        "Float64" => Kind::F64.into(),
        _ => return None,
    })
}

/// The type of this name in legacy files. `long` has as many bits as on the machines that write it today.
pub(super) fn number_of_legacy(name: &str) -> Option<Number> {
    Some(match name {
        "char" | "signed_char" | "vtktypeint8" => Kind::I8.into(),
        "unsigned_char" | "vtktypeuint8" => Kind::U8.into(),
        "short" | "vtktypeint16" => Kind::I16.into(),
        "unsigned_short" | "vtktypeuint16" => Kind::U16.into(),
        // Indices are written with 32 bits, whatever the writer has.
        "int" | "vtktypeint32" | "vtkidtype" => Kind::I32.into(),
        "unsigned_int" | "vtktypeuint32" => Kind::U32.into(),
        "long" | "long_long" | "vtktypeint64" => Number::I64,
        "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Number::U64,
        "float" => Kind::F32.into(),
        "double" => Kind::F64.into(),
        _ => return None,
    })
}

/// What reading may take of memory: arrays may be packed, and many may name the same bytes.
#[derive(Debug)]
pub(super) struct Budget {
    file_bytes: u64,
    unpacked: u64,
    taken: u64,
}

impl Budget {
    pub fn new(file_bytes: usize) -> Self {
        Self { file_bytes: file_bytes as u64, unpacked: 0, taken: 0 }
    }

    /// Allows this many more bytes of numbers.
    ///
    /// # Errors
    /// [`Error::Input`] if the file is too short for them.
    pub fn take(&mut self, bytes: u64) -> Result<()> {
        self.taken = self.taken.saturating_add(bytes);
        if outgrows(self.taken, self.file_bytes.saturating_add(self.unpacked)) {
            let problem = "its arrays stand for far more numbers than the file can have";
            return Err(Error::input(None, problem, "export the mesh again with fewer arrays"));
        }
        Ok(())
    }

    /// Allows this many more bytes after decompression.
    ///
    /// # Errors
    /// [`Error::Input`] if they are too many for the file.
    pub fn unpack(&mut self, bytes: u64) -> Result<()> {
        self.unpacked = self.unpacked.saturating_add(bytes);
        if expands_too_far(self.unpacked, self.file_bytes) {
            let problem = format!("{} bytes of the file expand to more than {bytes}", self.file_bytes);
            return Err(Error::input(None, problem, "write it without compression if that is intended"));
        }
        self.take(bytes)
    }
}
