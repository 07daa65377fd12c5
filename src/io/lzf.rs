//! LZF, the compression of PCD files: runs of bytes as they are, and copies of earlier ones.
//!
//! Own code of forty lines, so that what is unpacked is bounded by the length of the file.

/// The bytes that `packed` stands for, if it is whole and they are `length`. A byte stands for 88 at most, so
/// no more memory is taken than that.
pub(crate) fn decompress(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    if length > packed.len().saturating_mul(88) {
        return None;
    }
    let mut plain = Vec::with_capacity(length);
    let mut rest = packed.iter();
    while let Some(control) = rest.next() {
        let control = usize::from(*control);
        if control < 32 {
            let run = rest.as_slice().get(..=control)?;
            plain.extend_from_slice(run);
            rest = rest.as_slice()[run.len()..].iter();
        } else {
            let mut count = control >> 5;
            if count == 7 {
                count += usize::from(*rest.next()?);
            }
            let back = ((control & 31) << 8 | usize::from(*rest.next()?)) + 1;
            let first = plain.len().checked_sub(back)?;
            // The copy may reach into what it appends.
            for k in first..first + count + 2 {
                plain.push(*plain.get(k)?);
            }
        }
        if plain.len() > length {
            return None;
        }
    }
    (plain.len() == length).then_some(plain)
}
