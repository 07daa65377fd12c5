//! Reads the numbers of a PLY file's elements, from text or binary data.

use super::header::Encoding;
use crate::io::binary::size;
use crate::io::checks::excerpt;
use crate::io::text::number;
use crate::mesh::attributes::Kind;

/// Why no number could be read.
pub(crate) enum Fault {
    /// The data ends here.
    End,
    /// The line of this element has too few numbers.
    ShortLine,
    /// This text is not a number.
    NotANumber(String),
}

pub(crate) type Reading<T> = Result<T, Fault>;

/// A stream of numbers, element after element.
pub(crate) trait Source {
    /// Moves to the next element.
    fn begin(&mut self) -> Reading<()>;
    /// The next number.
    fn value(&mut self, kind: Kind) -> Reading<f64>;
    /// Skips `count` numbers.
    fn skip(&mut self, kind: Kind, count: u64) -> Reading<()>;
    /// Ends the element.
    fn finish(&mut self) {}
    /// Bytes not yet read.
    fn bytes_left(&self) -> u64;
    /// Line or byte for an error message.
    fn place(&self) -> String;
    /// What was unusual but harmless.
    fn note(&self) -> Option<String> {
        None
    }
}

/// Text with one element per line; blank lines are skipped.
pub(crate) struct Text<'a> {
    rest: &'a [u8],
    line: &'a [u8],
    number: u64,
    first_long_line: Option<u64>,
}

impl<'a> Text<'a> {
    pub(crate) fn new(body: &'a [u8], header_lines: u64) -> Self {
        Self { rest: body, line: &[], number: header_lines, first_long_line: None }
    }

    fn word(&mut self) -> Reading<&'a [u8]> {
        let line = self.line.trim_ascii_start();
        if line.is_empty() {
            return Err(if self.rest.is_empty() { Fault::End } else { Fault::ShortLine });
        }
        let length = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (word, line) = line.split_at(length);
        self.line = line;
        Ok(word)
    }
}

impl Source for Text<'_> {
    fn begin(&mut self) -> Reading<()> {
        loop {
            if self.rest.is_empty() {
                return Err(Fault::End);
            }
            let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
            let length = self.rest.iter().position(is_end).unwrap_or(self.rest.len());
            let (line, rest) = self.rest.split_at(length);
            // CR LF is one line end, and so is each of them alone.
            self.rest = rest.strip_prefix(b"\r\n").or_else(|| rest.get(1..)).unwrap_or_default();
            self.line = line;
            self.number += 1;
            if !line.trim_ascii().is_empty() {
                return Ok(());
            }
        }
    }

    fn value(&mut self, _: Kind) -> Reading<f64> {
        let word = self.word()?;
        number(word).ok_or_else(|| Fault::NotANumber(excerpt(&String::from_utf8_lossy(word))))
    }

    fn skip(&mut self, _: Kind, count: u64) -> Reading<()> {
        for _ in 0..count {
            self.word()?;
        }
        Ok(())
    }

    fn finish(&mut self) {
        if !self.line.trim_ascii().is_empty() {
            self.first_long_line.get_or_insert(self.number);
        }
    }

    fn bytes_left(&self) -> u64 {
        // The last number needs no separator after it.
        self.rest.len() as u64 + 1
    }

    fn place(&self) -> String {
        format!("line {}", self.number)
    }

    fn note(&self) -> Option<String> {
        let line = self.first_long_line?;
        Some(format!("values beyond those that the header declares were ignored (first on line {line})"))
    }
}

/// Binary numbers in either byte order.
pub(crate) struct Binary<'a> {
    rest: &'a [u8],
    big_endian: bool,
    /// Bytes of the whole file, for the position in error messages.
    file_bytes: usize,
}

impl<'a> Binary<'a> {
    pub(crate) fn new(file: &'a [u8], start: usize, encoding: Encoding) -> Self {
        let rest = file.get(start..).unwrap_or_default();
        Self { rest, big_endian: encoding == Encoding::BigEndian, file_bytes: file.len() }
    }

    fn take<const N: usize>(&mut self) -> Reading<[u8; N]> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or(Fault::End)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl Source for Binary<'_> {
    fn begin(&mut self) -> Reading<()> {
        Ok(())
    }

    fn value(&mut self, kind: Kind) -> Reading<f64> {
        Ok(match kind {
            Kind::I8 => i8::from_le_bytes(self.take()?).into(),
            Kind::U8 => u8::from_le_bytes(self.take()?).into(),
            Kind::I16 => i16::from_le_bytes(self.take()?).into(),
            Kind::U16 => u16::from_le_bytes(self.take()?).into(),
            Kind::I32 => i32::from_le_bytes(self.take()?).into(),
            Kind::U32 => u32::from_le_bytes(self.take()?).into(),
            Kind::F32 => f32::from_le_bytes(self.take()?).into(),
            Kind::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, kind: Kind, count: u64) -> Reading<()> {
        let bytes = usize::try_from(count).ok().and_then(|count| count.checked_mul(size(kind)));
        self.rest = bytes.and_then(|bytes| self.rest.get(bytes..)).ok_or(Fault::End)?;
        Ok(())
    }

    fn bytes_left(&self) -> u64 {
        self.rest.len() as u64
    }

    fn place(&self) -> String {
        format!("byte {}", self.file_bytes - self.rest.len())
    }
}
