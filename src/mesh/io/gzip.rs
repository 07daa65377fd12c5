//! Files packed by gzip.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::unfolds_too_far;
use crate::{Error, Result};

/// Whether these bytes are packed.
pub(super) fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// What was packed. A few bytes can stand for terabytes, so it must not be very much larger than the file.
pub(super) fn unpack(packed: &[u8]) -> Result<Vec<u8>> {
    let mut decoder = MultiGzDecoder::new(packed);
    let mut plain = Vec::new();
    loop {
        let before = plain.len();
        let read = decoder.by_ref().take(1 << 20).read_to_end(&mut plain);
        let damaged = |error: std::io::Error| {
            let place = format!("byte {} of the unpacked file", plain.len());
            let remedy = "get the whole file or pack it again";
            Error::input(Some(place), format!("the gzip data is cut off or damaged ({error})"), remedy)
        };
        read.map_err(damaged)?;
        if plain.len() == before {
            return Ok(plain);
        }
        if unfolds_too_far(plain.len() as u64, packed.len() as u64) {
            let problem = format!("{} bytes of gzip data unpack to more than {before}", packed.len());
            return Err(Error::input(None, problem, "unpack the file yourself if that is right"));
        }
    }
}
