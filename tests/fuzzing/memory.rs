//! Any bytes read as a file, a part of them many times, in memory that the length of the file justifies.

use rtfmesh::io::{Encoding, Format, Input, Reader};

/// Longest files that are made.
const LONGEST: usize = 1 << 20;
/// What a reader may take for a file of any length, less than the 64 MiB that are promised.
const BASE: usize = 48 << 20;
/// What it may take for each byte of the unpacked file.
const FACTOR: usize = 40;

/// The format and the file of these data: its first byte is the format, the next four say which part of the
/// rest is repeated and how often.
pub fn expanded(data: &[u8]) -> Option<(Option<Encoding>, Vec<u8>)> {
    let ([kind, from, length, times, more], rest) = data.split_first_chunk::<5>()?;
    let format = Format::ALL.get(usize::from(*kind) % (Format::ALL.len() + 1)).copied();
    let begin = (usize::from(*from) * rest.len()) / 256;
    let end = (begin + 1 + usize::from(*length)).min(rest.len());
    let part = rest.get(begin..end)?;
    let most = (LONGEST / part.len().max(1)).max(1);
    let times = (usize::from(*times) << (more % 12)).clamp(1, most);
    let file = [&rest[..begin], &part.repeat(times), &rest[end..]].concat();
    Some((format.map(|format| Encoding { format, gzip: false }), file))
}

/// Reads the file, with and without materials. `peak` runs a job and returns the most bytes that it had at a
/// time. Gzip data is left out: it is the unpacked file that counts.
pub fn check(data: &[u8], peak: &dyn Fn(&mut dyn FnMut()) -> usize) {
    let Some((declared, file)) = expanded(data) else { return };
    if file.starts_with(&[0x1f, 0x8b]) {
        return;
    }
    for materials in [false, true] {
        let mut vertices = 0;
        let taken = peak(&mut || {
            let read = Reader::new().format(declared).materials(materials).read_any_bytes(&file);
            vertices = match &read {
                Ok(Input::Mesh(loaded)) => loaded.mesh.vertices.len(),
                Ok(Input::Volume(volume)) => volume.values.len(),
                _ => 0,
            };
        });
        let most = BASE + FACTOR * file.len();
        assert!(taken <= most, "{taken} bytes for {} of a file with {vertices} vertices", file.len());
    }
}
