//! Splits a file into its JSON and, in a `.glb` file, its binary data.

use crate::grammar::counted;
use crate::io::checks::cut_off;
use crate::{Error, Result};

/// The parts of a file.
pub(crate) struct Parts<'a> {
    pub json: &'a [u8],
    /// The buffer of a `.glb`.
    pub binary: Option<&'a [u8]>,
}

const JSON: u32 = 0x4E4F_534A;
const BINARY: u32 = 0x004E_4942;

pub(crate) fn split_container(bytes: &[u8]) -> Result<Parts<'_>> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Parts { json: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), binary: None });
    }
    let mut at = 4;
    let version = read_u32(bytes, &mut at)?;
    if version != 2 {
        let problem = format!("this is glTF version {version}, not 2");
        return Err(Error::input(Some("byte 4".to_owned()), problem, "export the mesh again as glTF 2.0"));
    }
    let length = read_u32(bytes, &mut at)? as usize;
    // Bytes beyond the declared length are ignored.
    let Some(file) = bytes.get(..length) else {
        let length = counted(length, ["byte", "bytes"]);
        let missing = format!("the header says {length}, but there are {}", bytes.len());
        return Err(cut_off("byte 8".to_owned(), &missing));
    };
    let (kind, json) = read_chunk(file, &mut at)?;
    if kind != JSON {
        let place = Some("byte 16".to_owned());
        return Err(Error::input(place, "the first chunk is not JSON", "export the mesh again"));
    }
    let mut binary = None;
    while binary.is_none() && at < file.len() {
        let (kind, data) = read_chunk(file, &mut at)?;
        binary = (kind == BINARY).then_some(data);
    }
    Ok(Parts { json, binary })
}

fn read_u32(bytes: &[u8], at: &mut usize) -> Result<u32> {
    let Some((word, _)) = bytes.get(*at..).and_then(|rest| rest.split_first_chunk::<4>()) else {
        return Err(cut_off(format!("byte {at}"), "the header of a chunk is missing"));
    };
    *at += 4;
    Ok(u32::from_le_bytes(*word))
}

fn read_chunk<'a>(bytes: &'a [u8], at: &mut usize) -> Result<(u32, &'a [u8])> {
    let length = read_u32(bytes, at)? as usize;
    let kind = read_u32(bytes, at)?;
    let rest = bytes.get(*at..).unwrap_or_default();
    let Some(data) = rest.get(..length) else {
        let length = counted(length, ["byte", "bytes"]);
        let missing = format!("a chunk has {length}, but {} left", counted(rest.len(), ["is", "are"]));
        return Err(cut_off(format!("byte {at}"), &missing));
    };
    *at += length;
    Ok((kind, data))
}
