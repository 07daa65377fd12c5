//! Files packed by gzip.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::unfolds_too_far;
use crate::{Error, Result};

/// Whether these bytes are packed.
pub(crate) fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// Bytes that are unpacked at once.
const CHUNK: usize = 1 << 16;

/// What was packed. A few bytes can stand for terabytes, so it must not be very much larger than the file.
pub(crate) fn unpack(packed: &[u8]) -> Result<Vec<u8>> {
    let mut decoder = MultiGzDecoder::new(packed);
    let (mut plain, mut chunk) = (Vec::new(), vec![0; CHUNK]);
    loop {
        let damaged = |error: std::io::Error| {
            let place = format!("byte {} of the unpacked file", plain.len());
            let remedy = "get the whole file or pack it again";
            Error::input(Some(place), format!("the gzip data is cut off or damaged ({error})"), remedy)
                .caused_by(error)
        };
        let read = decoder.read(&mut chunk).map_err(damaged)?;
        if read == 0 {
            return Ok(plain);
        }
        if plain.try_reserve(read).is_err() {
            let problem = format!("there is no memory for the more than {} bytes in it", plain.len());
            return Err(Error::input(None, problem, "use a machine with more memory"));
        }
        plain.extend_from_slice(chunk.get(..read).unwrap_or_default());
        if unfolds_too_far(plain.len() as u64, packed.len() as u64) {
            let problem =
                format!("{} bytes of gzip data unpack to more than {}", packed.len(), plain.len() - 1);
            return Err(Error::input(None, problem, "unpack the file yourself if that is right"));
        }
    }
}
