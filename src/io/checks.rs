//! Checks that several readers make, and text from a file as an error message can show it.

use crate::grammar::counted;
use crate::{Error, Result};

/// Whether this many bytes are more than a file of `file_bytes` bytes can stand for in good faith: compressed
/// data, and parts that a file refers to repeatedly, can claim any amount.
pub(crate) fn expands_too_far(expanded_bytes: u64, file_bytes: u64) -> bool {
    expanded_bytes > file_bytes.saturating_mul(256).saturating_add(64 << 20)
}

/// Whether a reader would take more memory than its file of `file_bytes` bytes can justify. In the end that
/// is 64 MiB and 40 times the unpacked file, since lists that grow take up to three times what is in them.
pub(crate) fn outgrows(bytes: u64, file_bytes: u64) -> bool {
    bytes > file_bytes.saturating_mul(11).saturating_add(16 << 20)
}

/// Makes room for `more` elements, or says that memory is short: Rust would end the program otherwise.
pub(crate) fn reserve<T>(list: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    list.try_reserve(more).map_err(|error| {
        let bytes = (list.len() as u64 + more as u64).saturating_mul(size_of::<T>() as u64);
        let what = what.to_owned();
        let problem = "more than is available".to_owned();
        let remedy = "use a machine with more memory, or a smaller file".to_owned();
        Error::OutOfMemory { what, bytes, problem, remedy, source: None }.caused_by(error)
    })
}

/// Refuses a mesh without vertices or faces, or with more vertices than can be indexed. `faces` counts the
/// file's faces before triangulation.
pub(crate) fn check_counts(vertices: u64, faces: u64) -> Result<()> {
    check_vertex_count(vertices)?;
    if faces == 0 { Err(no_faces()) } else { Ok(()) }
}

/// The error for a file of points where a mesh is wanted.
pub(crate) fn no_faces() -> Error {
    let remedy = "give a surface mesh, or make a mesh of the points with `cloud::surface`";
    Error::input(None, "the file has no faces", remedy)
}

/// Like [`check_counts`], for formats whose files may have points only.
pub(crate) fn check_vertex_count(vertices: u64) -> Result<()> {
    if vertices == 0 {
        return Err(Error::input(None, "the file has no vertices", "give a mesh with vertices and faces"));
    }
    // u32::MAX itself stands for "no vertex".
    if vertices >= u64::from(u32::MAX) {
        let problem = format!("the file has {vertices} vertices, more than the {} possible", u32::MAX - 1);
        return Err(Error::input(None, problem, "split or simplify the mesh first"));
    }
    Ok(())
}

/// Refuses a declared count of elements that the rest of the file is too short for, before memory is
/// allocated for them; `noun` is one of them and several. `bytes_each` is the least that one takes.
pub(crate) fn check_declared_count(
    count: u64,
    noun: [&str; 2],
    bytes_each: u64,
    bytes_left: u64,
    place: String,
) -> Result<()> {
    let least = count.saturating_mul(bytes_each);
    if least <= bytes_left {
        return Ok(());
    }
    let declared = counted(count, noun);
    Err(cut_off(place, &format!("it declares {}", too_much(&declared, least, bytes_left))))
}

/// How much `declared` takes, and how little there is.
pub(crate) fn too_much(declared: &str, least: u64, bytes_left: u64) -> String {
    let least = counted(least, ["byte", "bytes"]);
    format!("{declared} of at least {least}, but {} left", counted(bytes_left, ["byte is", "bytes are"]))
}

/// The error for a file that ends too early.
pub(crate) fn cut_off(place: String, missing: &str) -> Error {
    let problem = format!("the file is cut off: {missing}");
    Error::input(Some(place), problem, "get the complete file, or export the mesh again")
}

/// Refuses binary data where text is expected. `remedy` says what to give instead.
pub(crate) fn refuse_binary(bytes: &[u8], remedy: &str) -> Result<()> {
    let Some(at) = bytes.iter().position(|byte| *byte == 0) else { return Ok(()) };
    let line = 1 + bytes.iter().take(at).filter(|byte| **byte == b'\n').count();
    Err(Error::input(Some(format!("line {line}")), "binary data in a text format", remedy))
}

/// A text without the NUL and Ctrl-Z bytes at its end, which some programs write to fill a block or to mark
/// the end, and without blanks between them.
pub(crate) fn without_padding(text: &[u8]) -> &[u8] {
    let is_mark = |byte: &u8| matches!(byte, 0 | 0x1a);
    let is_content = |byte: &u8| !is_mark(byte) && !byte.is_ascii_whitespace();
    let length = text.iter().rposition(is_content).map_or(0, |last| last + 1);
    let (content, end) = text.split_at(length);
    if end.iter().any(is_mark) { content } else { text }
}

/// `text` shortened to fit into an error message, with control characters escaped.
pub(crate) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut short = String::new();
    for escaped in text.chars().map(char::escape_debug) {
        if short.chars().count() + escaped.len() > LONGEST {
            short.push_str("...");
            break;
        }
        short.extend(escaped);
    }
    short
}

/// Like [`excerpt`], for bytes that need not be UTF-8.
pub(crate) fn excerpt_of_bytes(word: &[u8]) -> String {
    excerpt(&String::from_utf8_lossy(word))
}

#[cfg(test)]
mod tests {
    use super::check_declared_count;

    #[test]
    fn numbers_agree_with_their_nouns() {
        let said = |count: u64, bytes_each: u64, bytes_left: u64| {
            let noun = ["triangle", "triangles"];
            let checked = check_declared_count(count, noun, bytes_each, bytes_left, "line 1".to_owned());
            checked.unwrap_err().to_string()
        };
        for (text, wanted) in [
            (said(1, 4, 1), "it declares 1 triangle of at least 4 bytes, but 1 byte is left"),
            (said(1, 1, 0), "it declares 1 triangle of at least 1 byte, but 0 bytes are left"),
            (said(2, 4, 7), "it declares 2 triangles of at least 8 bytes, but 7 bytes are left"),
        ] {
            assert!(text.contains(wanted), "{text}");
        }
    }
}
