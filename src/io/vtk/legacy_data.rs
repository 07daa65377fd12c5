//! The words, lines and numbers of VTK's older format, which is text, or text with binary numbers between its
//! lines.

use std::borrow::Cow;

use super::array::{Budget, Values, number_of_legacy};
use crate::grammar::counted;
use crate::io::checks::{check_declared_count, cut_off, excerpt_of_bytes};
use crate::io::text::unsigned_integer;
use crate::io::volumes::raw::Number;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// A place in the file.
pub(super) struct Cursor<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub is_binary: bool,
}

impl<'a> Cursor<'a> {
    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Where this is, for error messages.
    pub fn place(&self) -> String {
        self.place_of(self.at)
    }

    /// Like [`Cursor::place`], for another byte. Lines are counted for it, so it is for errors and notes
    /// only.
    pub fn place_of(&self, at: usize) -> String {
        if self.is_binary {
            return format!("byte {at}");
        }
        let above = self.bytes.get(..at).unwrap_or_default();
        format!("line {}", 1 + above.iter().filter(|byte| **byte == b'\n').count())
    }

    pub fn error(&self, problem: String, remedy: &str) -> Error {
        Error::input(Some(self.place()), problem, remedy)
    }

    fn cut_off(&self, missing: &str) -> Error {
        cut_off(self.place(), missing)
    }

    /// The next word, on this line or a later one.
    pub fn word(&mut self) -> Option<&'a [u8]> {
        let (word, end) = self.next_word()?;
        self.at = end;
        Some(word)
    }

    fn next_word(&self) -> Option<(&'a [u8], usize)> {
        let rest = self.rest();
        let begin = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let rest = &rest[begin..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        Some((&rest[..length], self.at + begin + length))
    }

    /// Whether the next word is this one; if so, it is passed.
    pub fn skip_word(&mut self, word: &str) -> bool {
        match self.next_word() {
            Some((own, end)) if own.eq_ignore_ascii_case(word.as_bytes()) => {
                self.at = end;
                true
            }
            _ => false,
        }
    }

    /// The next word of this line as a whole number, if it is one.
    pub fn number_on_line(&mut self) -> Option<u64> {
        let rest = self.rest();
        let line = &rest[..rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len())];
        let (word, end) = self.next_word()?;
        let number = unsigned_integer(word).filter(|_| !line.trim_ascii().is_empty())?;
        self.at = end;
        Some(number)
    }

    pub fn required_word(&mut self, what: &str) -> Result<&'a [u8]> {
        let missing = format!("there is no {what}");
        self.word().ok_or_else(|| self.cut_off(&missing))
    }

    /// A number of things.
    pub fn count(&mut self, what: &str) -> Result<usize> {
        let word = self.required_word(what)?;
        let count = unsigned_integer(word).and_then(|count| usize::try_from(count).ok());
        count.ok_or_else(|| {
            let problem = format!("'{}' is not a {what}", excerpt_of_bytes(word));
            self.error(problem, "repair the file, or export the mesh again")
        })
    }

    /// A name, whose unusual characters are percent-encoded.
    pub fn name(&mut self) -> Result<String> {
        let word = self.required_word("name")?;
        Ok(percent_encoding::percent_decode(word).decode_utf8_lossy().into_owned())
    }

    /// Passes the end of a line behind which binary numbers begin.
    pub fn end_line(&mut self) {
        if self.is_binary {
            let length = self.rest().iter().position(|byte| *byte == b'\n');
            self.at += length.map_or(self.rest().len(), |at| at + 1);
        }
    }

    /// The rest of this line.
    pub fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        Some(rest[..length].trim_ascii())
    }

    /// Bytes of the file at this place.
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let Some(own) = self.rest().get(..count) else {
            let declared = counted(count, ["byte of numbers is", "bytes of numbers are"]);
            let left = counted(self.rest().len(), ["is", "are"]);
            let missing = format!("{declared} declared, but {left} left");
            return Err(self.cut_off(&missing));
        };
        self.at += count;
        Ok(own)
    }

    /// This many numbers of a type; `None` for text, which is skipped. An unknown type is an error.
    pub fn values(
        &mut self,
        type_name: &[u8],
        count: usize,
        budget: &mut Budget,
    ) -> Result<Option<Values<'a>>> {
        let lower = String::from_utf8_lossy(type_name).to_ascii_lowercase();
        if matches!(lower.as_str(), "string" | "utf8_string") {
            return self.skip_texts(count).map(|()| None);
        }
        let is_bits = lower == "bit";
        let number = if is_bits { Some(Kind::U8.into()) } else { number_of_legacy(&lower) };
        let Some(number) = number else {
            let problem = format!("'{}' is not a type of numbers", excerpt_of_bytes(type_name));
            return Err(self.error(problem, "export the mesh again with int, float or double"));
        };
        if !self.is_binary {
            return self.text_values(count, budget).map(Some);
        }
        if is_bits {
            budget.take(count as u64)?;
            let packed = self.take(count.div_ceil(8))?;
            let bit = |k: usize| packed[k / 8] >> (7 - k % 8) & 1;
            let bytes = Cow::Owned((0..count).map(bit).collect());
            return Ok(Some(Values { number, bytes, is_big_endian: true }));
        }
        let bytes = self.take(count.saturating_mul(number.bytes()))?;
        Ok(Some(Values { number, bytes: Cow::Borrowed(bytes), is_big_endian: true }))
    }

    fn text_values(&mut self, count: usize, budget: &mut Budget) -> Result<Values<'a>> {
        let left = self.rest().len() as u64 + 1;
        if (count as u64).saturating_mul(2) > left {
            check_declared_count(count as u64, ["number", "numbers"], 2, left, self.place())?;
        }
        budget.take(8 * count as u64)?;
        let mut words = std::iter::from_fn(|| self.word());
        let values = Values::of_words(&mut words, count);
        let values = values.map_err(|error| match error {
            Error::Input { problem, remedy, .. } => Error::input(Some(self.place()), problem, remedy),
            other => other,
        })?;
        if values.len() < count {
            return Err(self.cut_off(&format!(
                "there are {} of {}",
                values.len(),
                counted(count, ["number", "numbers"])
            )));
        }
        Ok(values)
    }

    /// Passes texts: a line each, or bytes behind their number, of which the first two bits say how long it
    /// is.
    fn skip_texts(&mut self, count: usize) -> Result<()> {
        if !self.is_binary {
            self.line();
        }
        for _ in 0..count {
            if !self.is_binary {
                self.line().ok_or_else(|| self.cut_off("lines of text are missing"))?;
                continue;
            }
            let first = *self.take(1)?.first().unwrap_or(&0);
            let more = match first >> 6 {
                3 => 0,
                2 => 1,
                1 => 3,
                _ => 7,
            };
            let length =
                self.take(more)?.iter().fold(u64::from(first & 63), |sum, b| sum << 8 | u64::from(*b));
            self.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        }
        Ok(())
    }

    /// Passes what describes the array above: lines up to an empty one.
    pub fn skip_description(&mut self) {
        self.line();
        while self.line().is_some_and(|line| !line.is_empty()) {}
    }
}

/// The type of numbers that have a name.
pub(super) fn known_type(type_name: &[u8]) -> Option<Number> {
    let lower = String::from_utf8_lossy(type_name).to_ascii_lowercase();
    if lower == "bit" { Some(Kind::U8.into()) } else { number_of_legacy(&lower) }
}
