//! The numbers of arrays in VTK's XML files: text, base64 or plain bytes, packed in blocks or not.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use flate2::read::ZlibDecoder;

use super::array::{Array, Budget, Values};
use super::xml::{Declared, Document, Form};
use crate::grammar::counted;
use crate::io::checks::{cut_off, excerpt, reserve};
use crate::io::text::words;
use crate::{Error, Result};

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The compressor whose blocks are read.
const ZLIB: &str = "vtkZLibDataCompressor";

/// Numbers in the bytes of a file, behind the place where they begin.
#[derive(Clone, Copy)]
enum Encoded<'a> {
    Plain(&'a [u8]),
    Base64(&'a [u8]),
}

impl<'a> Encoded<'a> {
    /// The next `count` bytes, written together, and what follows.
    fn take(self, count: u64) -> Option<(Cow<'a, [u8]>, Self)> {
        let count = usize::try_from(count).ok()?;
        match self {
            Self::Plain(bytes) => {
                let (own, rest) = bytes.split_at_checked(count)?;
                Some((Cow::Borrowed(own), Self::Plain(rest)))
            }
            Self::Base64(text) => {
                let (own, rest) = text.split_at_checked(count.div_ceil(3).checked_mul(4)?)?;
                let mut bytes = BASE64.decode(own).ok()?;
                if bytes.len() < count {
                    return None;
                }
                bytes.truncate(count);
                Some((Cow::Owned(bytes), Self::Base64(rest)))
            }
        }
    }
}

/// Reads the arrays of one file.
pub(super) struct Decoder<'d, 'a> {
    pub document: &'d Document<'a>,
    pub budget: &'d mut Budget,
}

/// The number at this place of a header, of `width` bytes.
fn header_number(header: &[u8], index: usize, (width, is_big_endian): (usize, bool)) -> u64 {
    let mut eight = [0; 8];
    let own = header.get(index * width..(index + 1) * width).unwrap_or_default();
    eight[..own.len()].copy_from_slice(own);
    if is_big_endian {
        eight[..own.len()].reverse();
    }
    u64::from_le_bytes(eight)
}

impl<'a> Decoder<'_, 'a> {
    /// Of the numbers in headers, bytes of each, and whether the highest comes first.
    fn layout(&self) -> (usize, bool) {
        (self.document.header_bytes, self.document.is_big_endian)
    }

    /// The array with at least `wanted` numbers, or with all that the file has.
    ///
    /// # Errors
    /// [`Error::Input`] with its name: it is cut off, packed in another way, or too large for the file.
    pub fn array(&mut self, declared: &Declared<'a>, wanted: Option<usize>) -> Result<Array<'a>> {
        let values = self.values(declared, wanted).map_err(|error| match error {
            Error::Input { path, place, problem, remedy, source } => {
                let name = format!("the array '{}'", excerpt(&declared.name));
                let place = Some(place.map_or(name.clone(), |place| format!("{name}, {place}")));
                Error::Input { path, place, problem, remedy, source }
            }
            other => other,
        })?;
        let Some(number) = declared.number else { return Err(unknown_type()) };
        if let Some(wanted) = wanted.filter(|wanted| values.len() < *wanted) {
            let place = format!("the array '{}'", excerpt(&declared.name));
            let wanted = counted(wanted, ["number", "numbers"]);
            return Err(cut_off(place, &format!("it has {} of {wanted}", values.len())));
        }
        let Declared { name, purpose, components, .. } = declared;
        Ok(Array { name: name.clone(), purpose: *purpose, number, components: *components, values })
    }

    fn values(&mut self, declared: &Declared<'a>, wanted: Option<usize>) -> Result<Values<'a>> {
        let Some(number) = declared.number else { return Err(unknown_type()) };
        let encoded = match declared.form {
            Form::Ascii => {
                // A digit and a blank each.
                let most = declared.text.len() / 2 + 1;
                let count = match wanted {
                    Some(wanted) => wanted.min(most),
                    None => words(declared.text).count(),
                };
                self.budget.take(8 * count as u64)?;
                return Values::of_words(words(declared.text), count);
            }
            Form::Binary => Encoded::Base64(declared.text),
            Form::Appended => {
                let missing = || cut_off("its numbers".to_owned(), "they are missing");
                let appended = self.document.appended.ok_or_else(missing)?;
                let begin = usize::try_from(declared.offset).ok();
                let rest = begin.and_then(|begin| appended.bytes.get(begin..)).ok_or_else(missing)?;
                if appended.is_base64 { Encoded::Base64(rest) } else { Encoded::Plain(rest) }
            }
        };
        let bytes = match self.document.compressor.as_deref() {
            None => self.plain(encoded)?,
            Some(ZLIB) => self.unpack(encoded)?,
            Some(other) => {
                let problem = format!("it is packed by {}, which is not supported", excerpt(other));
                let remedy = "write the file with zlib or without compression";
                return Err(Error::input(None, problem, remedy));
            }
        };
        Ok(Values { number, bytes, is_big_endian: self.document.is_big_endian })
    }

    /// Bytes behind their number. Base64 may be one text for both, or one for each.
    fn plain(&mut self, encoded: Encoded<'a>) -> Result<Cow<'a, [u8]>> {
        let missing = || cut_off("its numbers".to_owned(), "there are fewer bytes than declared");
        let width = self.document.header_bytes;
        let (head, rest) = encoded.take(width as u64).ok_or_else(missing)?;
        let count = header_number(&head, 0, self.layout());
        let is_one_text = match (encoded, rest) {
            (Encoded::Base64(all), Encoded::Base64(rest)) => {
                !all[..all.len() - rest.len()].ends_with(b"=") && !width.is_multiple_of(3)
            }
            _ => false,
        };
        self.check_text(encoded, count)?;
        if !is_one_text {
            return rest.take(count).map(|(bytes, _)| bytes).ok_or_else(missing);
        }
        let whole = count.checked_add(width as u64).and_then(|count| encoded.take(count));
        let (bytes, _) = whole.ok_or_else(missing)?;
        let mut bytes = bytes.into_owned();
        Ok(Cow::Owned(bytes.split_off(width)))
    }

    /// Counts the bytes that base64 stands for, which are new ones.
    fn check_text(&mut self, encoded: Encoded, count: u64) -> Result<()> {
        match encoded {
            Encoded::Base64(text) => self.budget.take(count.min(text.len() as u64)),
            Encoded::Plain(_) => Ok(()),
        }
    }

    /// Blocks behind their number, length and packed lengths.
    fn unpack(&mut self, encoded: Encoded<'a>) -> Result<Cow<'a, [u8]>> {
        let missing = || cut_off("its numbers".to_owned(), "there are fewer packed bytes than declared");
        let layout = self.layout();
        let width = layout.0 as u64;
        let (head, _) = encoded.take(3 * width).or_else(|| encoded.take(width)).ok_or_else(missing)?;
        let blocks = header_number(&head, 0, self.layout());
        if blocks == 0 {
            return Ok(Cow::Borrowed(&[]));
        }
        let [full, last] = [1, 2].map(|index| header_number(&head, index, layout));
        let header_bytes = blocks.checked_add(3).and_then(|count| count.checked_mul(width));
        let (head, rest) = header_bytes.and_then(|bytes| encoded.take(bytes)).ok_or_else(missing)?;
        let blocks = usize::try_from(blocks).map_err(|_| missing())?;
        let packed_lengths = (3..blocks + 3).map(|index| header_number(&head, index, layout));
        let packed_bytes = packed_lengths.clone().fold(0, u64::saturating_add);
        self.check_text(encoded, packed_bytes)?;
        let (packed, _) = rest.take(packed_bytes).ok_or_else(missing)?;
        let last = if last == 0 { full } else { last };
        let total = full.checked_mul(blocks as u64 - 1).and_then(|bytes| bytes.checked_add(last));
        let total = total.ok_or_else(missing)?;
        self.budget.unpack(total)?;
        let mut plain = Vec::new();
        reserve(&mut plain, usize::try_from(total).unwrap_or(usize::MAX), "the numbers of a VTK file")?;
        let mut rest: &[u8] = &packed;
        for (block, length) in packed_lengths.enumerate() {
            let Some((own, others)) = usize::try_from(length).ok().and_then(|at| rest.split_at_checked(at))
            else {
                return Err(missing());
            };
            rest = others;
            let expected = if block + 1 == blocks { last } else { full };
            let read = ZlibDecoder::new(own).take(expected).read_to_end(&mut plain);
            let damaged = |problem: String| {
                let remedy = "get the complete file, or export it again";
                Error::input(Some(format!("block {block}")), problem, remedy)
            };
            let read = read.map_err(|error| {
                damaged(format!("the zlib data is cut off or damaged ({error})")).caused_by(error)
            })?;
            if read as u64 != expected {
                let expected = counted(expected, ["byte", "bytes"]);
                return Err(damaged(format!("the block has {read} of {expected}")));
            }
        }
        Ok(Cow::Owned(plain))
    }
}

fn unknown_type() -> Error {
    Error::input(None, "its numbers are of no known type", "write Int8 to UInt64, Float32 or Float64")
}
