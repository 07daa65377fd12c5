//! Decompression of gzip files.

use std::io::Read;

use flate2::read::MultiGzDecoder;

use super::checks::expands_too_far;
use crate::{Error, Result};

/// Whether these bytes are a gzip file.
pub(crate) fn is_compressed(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// Bytes decompressed at a time.
const CHUNK: usize = 1 << 16;

/// The decompressed content. A few bytes can stand for terabytes, so its size is limited relative to the
/// file's.
pub(crate) fn decompress(compressed: &[u8]) -> Result<Vec<u8>> {
    let mut decoder = MultiGzDecoder::new(compressed);
    let (mut plain, mut chunk) = (Vec::new(), vec![0; CHUNK]);
    loop {
        let damaged = |error: std::io::Error| {
            let place = format!("byte {} of the decompressed file", plain.len());
            let remedy = "get the complete file, or compress it again";
            Error::input(Some(place), format!("the gzip data is cut off or damaged ({error})"), remedy)
                .caused_by(error)
        };
        let read = decoder.read(&mut chunk).map_err(damaged)?;
        if read == 0 {
            return Ok(plain);
        }
        if plain.try_reserve(read).is_err() {
            let problem = format!("there is not enough memory for its more than {} bytes", plain.len());
            return Err(Error::input(None, problem, "use a machine with more memory"));
        }
        plain.extend_from_slice(chunk.get(..read).unwrap_or_default());
        if expands_too_far(plain.len() as u64, compressed.len() as u64) {
            let problem =
                format!("{} bytes of gzip data expand to more than {}", compressed.len(), plain.len() - 1);
            return Err(Error::input(None, problem, "decompress the file first if that is intended"));
        }
    }
}
